"""Abstract base class of curves: a continuous map from a parameter range into voxel space.

A curve must not know voxels, colours or displays.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Hashable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from voxdisplay.compute.array_types import Bools, Evaluate, Floats, Ints
from voxdisplay.curves import checked_methods
from voxdisplay.curves.short_repr import short_repr

NO_BREAKS = checked_methods.NO_BREAKS


class Curve(ABC):
    """A parametric space curve P(t), a <= t <= b.

    Coordinates are voxel space: voxel (i, j, k) is the cube [i, i+1) x [j, j+1) x [k, k+1), its
    centre at +1/2 (paper, equation 3).

    Attributes
    ----------
    t_range : (float, float)
        The range (a, b), finite, a < b.
    closed : bool or None
        Whether P(a) and P(b) are joined. None: found from the end points.
    family : hashable
        Key of curves that `batch_evaluator` takes together: equal for curves of one class with
        the same formula, the same ``degree`` and the same ``thread_safe``. None: evaluated alone.
    point_count : int or None
        Number of points that the curve was made of, if it passes through them at t = 0, 1, 2, ...
        and each may have a colour of its own. None for all others.

    """

    t_range: tuple[float, float]
    closed: bool | None = None
    family: Hashable = None
    point_count: int | None = None
    _arguments: Mapping[str, object] = MappingProxyType({})

    def __init_subclass__(cls, **named: Any) -> None:
        super().__init_subclass__(**named)
        # A subclass that overrides `position` must not inherit bounds, a degree or a batch
        # evaluator of the formula it replaced: they would prove another curve.
        owners = {name: owner for owner in reversed(cls.__mro__) for name in vars(owner)}
        order = cls.__mro__.index
        for name in _OF_THE_FORMULA:
            if order(owners["position"]) < order(owners[name]):
                setattr(cls, name, vars(Curve)[name])
        if checked_methods.is_foreign(cls):
            checked_methods.check_class(cls)

    def __repr__(self) -> str:
        arguments = self._arguments or {"t_range": getattr(self, "t_range", None)}
        shown = [f"{k}={short_repr(v)}" for k, v in arguments.items() if v is not None]
        return f"{type(self).__name__}({', '.join(shown)})"

    breaks = checked_methods.Breaks(NO_BREAKS)

    @property
    def degree(self) -> int | None:
        """Degree of x, y and z as polynomials of t between breaks; None if they are none.

        A hint for sampling: a polynomial of low degree turns rarely and needs few samples.
        """
        return None

    @property
    def min_length(self) -> float:
        """Lower bound of the length in max norm, in voxels; 0 if the formula has none."""
        return 0.0

    @property
    def always_defined(self) -> bool:
        """True if the formula has a value for every t: it divides by nothing that may be 0."""
        return False

    @property
    def thread_safe(self) -> bool:
        """True if `position` may be called from several threads at once."""
        return False

    @abstractmethod
    def position(self, t: Floats) -> Floats:
        """Return the points at t.

        Parameters
        ----------
        t : (n,) float64 array
            Parameters inside ``t_range``; n may be 0 or 1.

        Returns
        -------
        (3, n) float64 array
            Rows x, y, z, in voxels. Not finite where the curve has no point.

        """

    def derivative(self, t: Floats) -> Floats | None:  # noqa: ARG002 - for those that have one
        """Return dP/dt at t as a (3, n) float64 array, or None when it is not known."""
        return None

    @staticmethod
    def batch_evaluator(curves: Sequence[Any]) -> Evaluate:
        """Return a function that evaluates curves of one family together.

        Parameters
        ----------
        curves : sequence
            Curves whose classes share this function, of equal ``family``.

        Returns
        -------
        callable
            ``(which, t)`` -> (3, n) points: for each of n parameters, the position of the curve
            with that index, (n,) int64; to the bit what its ``position`` returns.

        """

        def evaluate(which: Ints, t: Floats) -> Floats:
            points = np.empty((3, t.size))
            for index in np.unique(which):
                own = which == index
                points[:, own] = curves[index].position(t[own])
            return points

        return evaluate

    def enclosure(self, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats] | None:  # noqa: ARG002 - as above
        """Return boxes that hold all of the curve between pairs of parameters.

        Certified voxelisation rests on them: see `voxelization.certify`.

        Parameters
        ----------
        t_lo, t_hi : (n,) float64 array
            Inside ``t_range``, t_lo <= t_hi; the same array for the curve's points.

        Returns
        -------
        (3, n), (3, n) float64 arrays, or None
            Bounds of P(t) for all real t from t_lo to t_hi, as exact arithmetic would have it.
            One or both nan where nothing is known, as where the curve may have no point. None if
            the curve has no bounds at all.

        """
        return None

    @np.errstate(all="ignore")
    def unbounded(self, t_lo: Floats, t_hi: Floats) -> Bools | None:
        """Return where the curve has no finite bounds between pairs of parameters, (n,).

        There it may have no value at a single parameter. None if it has no bounds at all.
        """
        box = self.enclosure(t_lo, t_hi)
        if box is None:
            return None
        return np.asarray(~(np.isfinite(box[0]) & np.isfinite(box[1])).all(axis=0))


_OF_THE_FORMULA = (
    "min_length",
    "degree",
    "always_defined",
    "thread_safe",
    "batch_evaluator",
    "enclosure",
    "unbounded",
)

"""What a curve is, to everything that draws one.

A curve is a continuous map from a parameter range into voxel space. It knows no voxels, no
colours and no display: only where it is.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np

from voxdisplay.compute.array_types import Evaluate, Floats, Ints


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
    breaks : (k,) float64 array
        Parameters inside the range, ascending, where the direction may turn sharply (the vertices
        of a polyline). A hint for sampling; never needed for correctness.
    family : hashable
        What curves of one class have in common that `together` takes, which have one ``degree``,
        too, and are ``reentrant`` or not. None: nothing, evaluate it by itself.

    """

    t_range: tuple[float, float]
    closed: bool | None = None
    breaks: Floats = np.empty(0)
    family: Hashable = None

    def __init_subclass__(cls, **named: Any) -> None:
        super().__init_subclass__(**named)
        # What it inherits from behind its position would speak of another formula, and prove
        # another curve.
        owners = {name: owner for owner in reversed(cls.__mro__) for name in vars(owner)}
        order = cls.__mro__.index
        for name in ("degree", "reentrant", "together", "enclosure"):
            if order(owners["position"]) < order(owners[name]):
                setattr(cls, name, vars(Curve)[name])

    @property
    def degree(self) -> int | None:
        """That of the polynomials of t that x, y and z are, between breaks; None: they are not.

        A hint for sampling: a curve that turns rarely needs no close look.
        """
        return None

    @property
    def reentrant(self) -> bool:
        """Whether it may be asked where it is from several threads at once."""
        return False

    @abstractmethod
    def position(self, t: Floats) -> Floats:
        """Give the points at t.

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
        """Give dP/dt at t as a (3, n) float64 array, or None when it is not known."""
        return None

    @staticmethod
    def together(curves: Sequence[Any]) -> Evaluate:
        """Prepare to evaluate curves of one family at once.

        Parameters
        ----------
        curves : sequence
            Curves whose classes share this function, of equal ``family``.

        Returns
        -------
        callable
            ``(which, t)`` -> (3, n) points: for each of n parameters, the position of the curve
            with that index, (n,) int64; to the bit what its ``position`` gives.

        """

        def evaluate(which: Ints, t: Floats) -> Floats:
            points = np.empty((3, t.size))
            for index in np.unique(which):
                mine = which == index
                points[:, mine] = curves[index].position(t[mine])
            return points

        return evaluate

    def enclosure(self, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats] | None:  # noqa: ARG002 - as above
        """Give boxes that hold all of the curve between pairs of parameters.

        What makes voxels provable: see `voxelize.certify`.

        Parameters
        ----------
        t_lo, t_hi : (n,) float64 array
            Inside ``t_range``, t_lo <= t_hi; the same array for the curve's points.

        Returns
        -------
        (3, n), (3, n) float64 arrays, or None
            Bounds of P(t) for all real t from t_lo to t_hi, as exact arithmetic would give it.
            One or both nan where nothing is known, as where the curve may have no point. None if
            the curve has no bounds at all.

        """
        return None

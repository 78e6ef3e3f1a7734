"""Circles and their kin: ellipse, arc, helix. Angles are radians. Knows formulas only.

All have exact derivatives and enclosures.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.compute.array_types import Bools, Evaluate, Floats, Ints
from voxdisplay.curves import arguments
from voxdisplay.curves.columns import are_moderate, from_columns
from voxdisplay.curves.curve import Curve
from voxdisplay.curves.orthonormal_basis import orthonormal_bases, orthonormal_basis
from voxdisplay.expressions.interval import Interval
from voxdisplay.expressions.trigonometric_intervals import cos, sin

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import ArrayLike


# Ranges of fewer radians are quickly sampled: they need no bound.
_SHORT = 1e3


class _Helical(Curve):
    """P(t) = center + cos(t) a + sin(t) b + t rise: uniform rotation and translation."""

    family = "helical"
    always_defined = True
    thread_safe = True
    t_range = (0.0, math.tau)
    closed: bool | None = True
    _numbers: Floats  # (4, 3): center, a, b, rise; one array, as there may be many curves

    def __init__(
        self,
        center: ArrayLike,
        a: Floats,
        b: Floats,
        *,
        t_range: tuple[float, float] = (0.0, math.tau),
        rise: Floats | None = None,
        closed: bool | None = True,
    ) -> None:
        self.t_range = t_range
        self.closed = closed
        still = np.zeros(3) if rise is None else rise
        self._numbers = np.array((arguments.vector("center", center), a, b, still))

    @property
    def _center(self) -> Floats:
        return self._numbers[0, :, None]

    @property
    def _a(self) -> Floats:
        return self._numbers[1, :, None]

    @property
    def _b(self) -> Floats:
        return self._numbers[2, :, None]

    @property
    def _rise(self) -> Floats:
        return self._numbers[3, :, None]

    @property
    def min_length(self) -> float:
        """Lower bound of the length in max norm: the variation of the coordinate that varies most.

        In each whole turn a_k cos t + b_k sin t varies by 4 hypot(a_k, b_k), and with a drift by
        no less, because half a turn later its slope is the opposite.
        """
        length = self.t_range[1] - self.t_range[0]
        if length < _SHORT:  # as most are; a bound of 0 is no worse for them
            return 0.0
        turns = np.floor(length / math.tau)
        with np.errstate(all="ignore"):
            variation = 4 * turns * np.hypot(self._a, self._b)
            return float(np.maximum(variation, np.abs(self._rise) * length).max())

    @np.errstate(all="ignore")
    def position(self, t: Floats) -> Floats:
        """Return the points at t, (n,), as a (3, n) float64 array."""
        center, a, b, rise = self._numbers[:, :, None]
        return _helical_position(center, a, b, rise, t)

    @staticmethod
    def batch_evaluator(curves: Sequence[_Helical]) -> Evaluate:
        """Return an evaluator of helical curves: see `Curve.batch_evaluator`."""
        numbers = np.array([curve._numbers for curve in curves]).reshape(-1, 12).T.copy()

        @np.errstate(all="ignore")
        def evaluate(which: Ints, t: Floats) -> Floats:
            center, a, b, rise = numbers.take(which, axis=1).reshape(4, 3, -1)
            return _helical_position(center, a, b, rise, t)

        return evaluate

    @np.errstate(all="ignore")
    def derivative(self, t: Floats) -> Floats:
        """Return dP/dt at t, (n,), as a (3, n) float64 array."""
        return self._b * np.cos(t) - self._a * np.sin(t) + self._rise

    @np.errstate(all="ignore")
    def enclosure(self, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats]:
        """Return boxes, (3, n) and (3, n), that hold the curve from t_lo to t_hi, (n,)."""
        t = Interval(t_lo, t_hi)
        box = self._center + self._a * cos(t) + self._b * sin(t) + self._rise * t
        return box.lo, box.hi


def _helical_position(center: Floats, a: Floats, b: Floats, rise: Floats, t: Floats) -> Floats:
    return center + a * np.cos(t) + b * np.sin(t) + rise * t


class Ellipse(_Helical):
    """An ellipse: center + cos(t) axes[0] + sin(t) axes[1], 0 <= t <= 2 pi.

    Parameters
    ----------
    center : (3,) array
    axes : (2, 3) array
        Two half axes. They need not be perpendicular (conjugate half diameters), nor independent.
    closed : bool, optional

    """

    def __init__(self, center: ArrayLike, axes: ArrayLike, *, closed: bool = True) -> None:
        a, b = arguments.array("axes", axes, (2, 3))
        super().__init__(center, a, b, closed=closed)

    @cached_property
    def _arguments(self) -> Mapping[str, object]:  # type: ignore[override]  # made when it is shown
        return {"center": self._numbers[0], "axes": self._numbers[1:3]}

    @classmethod
    @np.errstate(all="ignore")
    def many(cls, center: Floats, axes: Floats, closed: Sequence[bool]) -> list[Ellipse | None]:
        """Return many ellipses, which cost less than one by one; None where an argument is wrong.

        Parameters
        ----------
        center : (n, 3) float64 array
        axes : (n, 2, 3) float64 array
        closed : sequence of bool

        """
        numbers = np.stack((center, *axes.transpose(1, 0, 2), np.zeros_like(center)), axis=1)
        return from_columns(cls, are_moderate(numbers), _numbers=numbers, closed=closed)


class Circle(_Helical):
    """A circle; t is the angle, see `orthonormal_basis` for where it begins.

    Parameters
    ----------
    center : (3,) array
    radius : float
    normal : (3,) array, optional
        Perpendicular to the circle's plane, of any length. The circle runs counter-clockwise when
        seen against it.
    closed : bool, optional

    """

    def __init__(
        self,
        center: ArrayLike,
        radius: float,
        normal: ArrayLike = (0, 0, 1),
        *,
        closed: bool = True,
    ) -> None:
        radius = arguments.positive("radius", radius)
        u, v, _ = orthonormal_basis("normal", normal)
        super().__init__(center, radius * u, radius * v, closed=closed)
        self._radius, self._normal = radius, normal

    @cached_property
    def _arguments(self) -> Mapping[str, object]:  # type: ignore[override]  # made when it is shown
        return {"center": self._numbers[0], "radius": self._radius, "normal": self._normal}

    @classmethod
    @np.errstate(all="ignore")
    def many(
        cls, center: Floats, radius: Floats, normal: Floats, closed: Sequence[bool]
    ) -> list[Circle | None]:
        """Return many circles, which cost less than one by one; None where an argument is wrong.

        Parameters
        ----------
        center, normal : (n, 3) float64 array
        radius : (n,) float64 array
        closed : sequence of bool

        """
        numbers, good = _circular_numbers(center, radius, normal)
        columns = {"_numbers": numbers, "_radius": radius.tolist(), "_normal": normal}
        return from_columns(cls, good, closed=closed, **columns)


def _circular_numbers(center: Floats, radius: Floats, normal: Floats) -> tuple[Floats, Bools]:
    """Return ``_numbers`` of many circles, (n, 4, 3), and where all arguments are good, (n,)."""
    u, v, good = orthonormal_bases(normal)
    good &= (radius > 0) & (radius <= arguments.MAX_MAGNITUDE)
    good &= are_moderate(center) & are_moderate(normal)
    size = radius[:, None]
    return np.stack((center, size * u, size * v, np.zeros_like(center)), axis=1), good


class Arc(_Helical):
    """A part of a circle, from the angle start to the angle end, which may be the smaller.

    Parameters
    ----------
    center, radius, normal
        As of `Circle`.
    start, end : float
        Angles in radians. The curve runs clockwise when end < start.
    closed : bool, optional

    """

    def __init__(
        self,
        center: ArrayLike,
        radius: float,
        start: float,
        end: float,
        normal: ArrayLike = (0, 0, 1),
        *,
        closed: bool | None = None,
    ) -> None:
        radius = arguments.positive("radius", radius)
        start, end = arguments.finite("start", start), arguments.finite("end", end)
        if start == end:
            raise arguments.ArgumentError("end", f"must differ from start: both are {start:g}")
        u, v, _ = orthonormal_basis("normal", normal)
        turn = math.copysign(1.0, end - start)  # clockwise: t is minus the angle
        t_range = arguments.parameter_range("angle", turn * start, turn * end)
        super().__init__(center, radius * u, turn * radius * v, t_range=t_range, closed=closed)
        self._radius, self._normal, self._turn = radius, normal, turn

    @cached_property
    def _arguments(self) -> Mapping[str, object]:  # type: ignore[override]  # made when it is shown
        start, end = (self._turn * angle for angle in self.t_range)
        return {
            "center": self._numbers[0],
            "radius": self._radius,
            "start": start,
            "end": end,
            "normal": self._normal,
            "closed": self.closed,
        }

    @classmethod
    @np.errstate(all="ignore")
    def many(
        cls,
        center: Floats,
        radius: Floats,
        angles: Floats,
        normal: Floats,
        closed: Sequence[bool | None],
    ) -> list[Arc | None]:
        """Return many arcs, which cost less than one by one; None where an argument is wrong.

        Parameters
        ----------
        center, normal : (n, 3) float64 array
        radius : (n,) float64 array
        angles : (n, 2) float64 array
            Starts and ends.
        closed : sequence of bool or None

        """
        numbers, good = _circular_numbers(center, radius, normal)
        good &= are_moderate(angles) & (angles[:, 0] != angles[:, 1])
        turn = np.where(angles[:, 1] < angles[:, 0], -1.0, 1.0)
        numbers[:, 2] *= turn[:, None]  # to the bit, as it is the sign alone
        return from_columns(
            cls,
            good,
            _numbers=numbers,
            _radius=radius.tolist(),
            _normal=normal,
            _turn=turn.tolist(),
            t_range=map(tuple, (turn[:, None] * angles).tolist()),
            closed=closed,
        )


class Helix(_Helical):
    """A helix; t is the angle, see `orthonormal_basis` for where it begins.

    Parameters
    ----------
    center : (3,) array
        The point of the axis beside which the helix begins.
    radius : float
    pitch : float
        Advance along the axis in one turn. Negative: against the axis, left-handed.
    turns : float
        Number of turns, above 0, not necessarily whole.
    axis : (3,) array, optional
        Direction of the axis, of any length.
    start : float, optional
        Angle at which it begins, in radians.
    closed : bool, optional

    """

    def __init__(
        self,
        center: ArrayLike,
        radius: float,
        pitch: float,
        turns: float,
        axis: ArrayLike = (0, 0, 1),
        *,
        start: float = 0.0,
        closed: bool | None = None,
    ) -> None:
        radius = arguments.positive("radius", radius)
        start = arguments.finite("start", start)
        end = start + math.tau * arguments.positive("turns", turns)
        u, v, n = orthonormal_basis("axis", axis)
        rise = arguments.finite("pitch", pitch) / math.tau * n
        origin = arguments.vector("center", center)
        super().__init__(
            origin - start * rise,
            radius * u,
            radius * v,
            t_range=arguments.parameter_range("angle", start, end),
            rise=rise,
            closed=closed,
        )
        self._arguments = {
            "center": origin,
            "radius": radius,
            "pitch": pitch,
            "turns": turns,
            "axis": axis,
            "start": start,
            "closed": closed,
        }

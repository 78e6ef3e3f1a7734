"""Curves with names: lines, circles and their kin, Lissajous curves, torus knots.

All have exact derivatives and enclosures. Angles are radians. Knows formulas only.

Where an angle begins: the curves that turn about a direction n (a circle's normal, a helix's
axis) measure their angle in the plane across n, from the direction u nearest to +x, towards
n x u, which is counter-clockwise for who looks against n. When n is along x, u is +y. So with
n = [0, 0, 1] angle 0 is +x and 90 degrees is +y; with n = [1, 0, 0] they are +y and +z.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.compute.array_types import Evaluate, Floats, Ints
from voxdisplay.curves import arguments
from voxdisplay.curves.curve import Curve
from voxdisplay.curves.span_bounds import Box, enclose_spans
from voxdisplay.expressions.interval import Interval, cos, interval, sin

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike


class Polyline(Curve):
    """Straight lines from point to point; vertex i is at t = i.

    Parameters
    ----------
    points : (n, 3) array
        The vertices, n >= 2.
    closed : bool, optional
        True adds the line back to the first point, if that is not the last one already.

    """

    degree = 1
    reentrant = True
    _least = 2

    def __init__(self, points: ArrayLike, *, closed: bool | None = None) -> None:
        vertices = arguments.points("points", points, least=self._least)
        if (closed and not np.array_equal(vertices[0], vertices[-1])) or len(vertices) == 1:
            vertices = np.concatenate((vertices, vertices[:1]))
        self.closed = closed
        self.t_range = (0.0, len(vertices) - 1.0)
        self.breaks = np.arange(1.0, len(vertices) - 1)
        self.family = len(vertices)
        self._vertices = vertices.T.copy()

    def position(self, t: Floats) -> Floats:
        """Give the points at t, (n,), as a (3, n) float64 array."""
        i = self._line(t)
        f = t - i
        return self._vertices[:, i] * (1 - f) + self._vertices[:, i + 1] * f

    @staticmethod
    def together(curves: Sequence[Polyline]) -> Evaluate:
        """Prepare to evaluate polylines of equally many points at once, see `Curve.together`."""
        vertices = np.concatenate([curve._vertices for curve in curves], axis=1)
        size = curves[0]._vertices.shape[1]

        def evaluate(which: Ints, t: Floats) -> Floats:
            i = curves[0]._line(t)
            f = t - i
            at = which * size + i
            return np.asarray(vertices[:, at] * (1 - f) + vertices[:, at + 1] * f)

        return evaluate

    def derivative(self, t: Floats) -> Floats:
        """Give dP/dt at t, (n,), as a (3, n) float64 array; at a vertex, of the line after it."""
        i = self._line(t)
        return self._vertices[:, i + 1] - self._vertices[:, i]

    def enclosure(self, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats]:
        """Give boxes that hold the curve from t_lo to t_hi, (n,): (3, n), (3, n)."""
        return enclose_spans(np.arange(self.t_range[1] + 1), t_lo, t_hi, self._box)

    def _box(self, i: Ints, t_lo: Floats, t_hi: Floats) -> Box:
        ends = []
        for t in (t_lo, t_hi):
            f = interval(t) - i
            ends.append(self._vertices[:, i] * (1 - f) + self._vertices[:, i + 1] * f)
        return np.minimum(ends[0].lo, ends[1].lo), np.maximum(ends[0].hi, ends[1].hi)

    def _line(self, t: Floats) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
        return np.clip(np.floor(t), 0, self._vertices.shape[1] - 2).astype(np.intp)


class Points(Polyline):
    """Ordered points, joined by straight lines; a single one is a curve that stays there."""

    _least = 1


class Segment(Polyline):
    """The straight line from start (t = 0) to end (t = 1), each (3,)."""

    def __init__(self, start: ArrayLike, end: ArrayLike, *, closed: bool | None = None) -> None:
        super().__init__((arguments.vector("start", start), arguments.vector("end", end)))
        self.closed = closed


class _Turning(Curve):
    """P(t) = center + cos(t) a + sin(t) b + t rise: all that turns evenly."""

    family = "turning"
    reentrant = True

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
        self._center = arguments.vector("center", center)[:, None]
        self._a, self._b = a[:, None], b[:, None]
        self._rise = np.zeros((3, 1)) if rise is None else rise[:, None]

    def position(self, t: Floats) -> Floats:
        """Give the points at t, (n,), as a (3, n) float64 array."""
        return _turn(self._center, self._a, self._b, self._rise, t)

    @staticmethod
    def together(curves: Sequence[_Turning]) -> Evaluate:
        """Prepare to evaluate such curves at once, see `Curve.together`."""
        center = np.concatenate([curve._center for curve in curves], axis=1)
        a = np.concatenate([curve._a for curve in curves], axis=1)
        b = np.concatenate([curve._b for curve in curves], axis=1)
        rise = np.concatenate([curve._rise for curve in curves], axis=1)
        return lambda which, t: _turn(center[:, which], a[:, which], b[:, which], rise[:, which], t)

    def derivative(self, t: Floats) -> Floats:
        """Give dP/dt at t, (n,), as a (3, n) float64 array."""
        return self._b * np.cos(t) - self._a * np.sin(t) + self._rise

    def enclosure(self, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats]:
        """Give boxes that hold the curve from t_lo to t_hi, (n,): (3, n), (3, n)."""
        t = Interval(t_lo, t_hi)
        box = self._center + self._a * cos(t) + self._b * sin(t) + self._rise * t
        return box.lo, box.hi


def _turn(center: Floats, a: Floats, b: Floats, rise: Floats, t: Floats) -> Floats:
    return center + a * np.cos(t) + b * np.sin(t) + rise * t


class Ellipse(_Turning):
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


class Circle(_Turning):
    """A circle; t is the angle, see `primitives` for where it begins.

    Parameters
    ----------
    center : (3,) array
    radius : float
    normal : (3,) array, optional
        Perpendicular to the circle's plane, of any length. The circle runs counter-clockwise for
        who looks against it.
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
        u, v, _ = _frame("normal", normal)
        super().__init__(center, radius * u, radius * v, closed=closed)


class Arc(_Turning):
    """A part of a circle, from the angle start to the angle end, whichever is greater.

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
        u, v, _ = _frame("normal", normal)
        turn = math.copysign(1.0, end - start)  # clockwise: t is minus the angle
        t_range = arguments.parameter_range("angle", turn * start, turn * end)
        super().__init__(center, radius * u, turn * radius * v, t_range=t_range, closed=closed)


class Helix(_Turning):
    """A helix; t is the angle, see `primitives` for where it begins.

    Parameters
    ----------
    center : (3,) array
        Where the helix begins on its axis.
    radius : float
    pitch : float
        How far it advances along the axis in one turn. Negative: against the axis, left-handed.
    turns : float
        How often it turns, at least a part of once.
    axis : (3,) array, optional
        The axis' direction, of any length.
    start : float, optional
        The angle it begins at, in radians.
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
        u, v, n = _frame("axis", axis)
        rise = arguments.finite("pitch", pitch) / math.tau * n
        super().__init__(
            arguments.vector("center", center) - start * rise,
            radius * u,
            radius * v,
            t_range=arguments.parameter_range("angle", start, end),
            rise=rise,
            closed=closed,
        )


class Lissajous(Curve):
    """P(t) = center + amplitude * sin(frequency * t + phase), 0 <= t <= 2 pi.

    Parameters
    ----------
    center, amplitude, frequency : (3,) array
        For x, y and z. Whole frequencies close the curve.
    phase : (3,) array, optional
        Radians.
    closed : bool, optional
        None: found from the end points.

    """

    t_range = (0.0, math.tau)
    reentrant = True

    def __init__(
        self,
        center: ArrayLike,
        amplitude: ArrayLike,
        frequency: ArrayLike,
        phase: ArrayLike = (0, 0, 0),
        *,
        closed: bool | None = None,
    ) -> None:
        self.closed = closed
        self._center = arguments.vector("center", center)[:, None]
        self._amplitude = arguments.vector("amplitude", amplitude)[:, None]
        self._frequency = arguments.vector("frequency", frequency)[:, None]
        self._phase = arguments.vector("phase", phase)[:, None]

    def position(self, t: Floats) -> Floats:
        """Give the points at t, (n,), as a (3, n) float64 array."""
        return self._center + self._amplitude * np.sin(self._frequency * t + self._phase)

    def derivative(self, t: Floats) -> Floats:
        """Give dP/dt at t, (n,), as a (3, n) float64 array."""
        rate = self._amplitude * self._frequency
        return np.asarray(rate * np.cos(self._frequency * t + self._phase))

    def enclosure(self, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats]:
        """Give boxes that hold the curve from t_lo to t_hi, (n,): (3, n), (3, n)."""
        angle = self._frequency * Interval(t_lo, t_hi) + self._phase
        box = self._center + self._amplitude * sin(angle)
        return box.lo, box.hi


class TorusKnot(Curve):
    """The (p, q) torus knot: p times around the axis while q times around the tube.

    Parameters
    ----------
    p, q : int
        Not 0 and without common divisor; (2, 3) is the trefoil.
    center : (3,) array
    major, minor : float
        Radius of the torus' middle circle, and of its tube.
    axis : (3,) array, optional
        The torus' axis, of any length.
    closed : bool, optional

    """

    t_range = (0.0, math.tau)
    reentrant = True

    def __init__(
        self,
        p: float,
        q: float,
        center: ArrayLike,
        major: float,
        minor: float,
        axis: ArrayLike = (0, 0, 1),
        *,
        closed: bool = True,
    ) -> None:
        self._p, self._q = arguments.whole("p", p), arguments.whole("q", q)
        if math.gcd(self._p, self._q) != 1:
            raise arguments.ArgumentError(
                "p",
                f"= {self._p} and q = {self._q} make no knot",
                hint="they must have no common divisor: (2, 3) is a trefoil, (1, 5) a coil",
            )
        self.closed = closed
        self._center = arguments.vector("center", center)[:, None]
        self._major = arguments.positive("major", major)
        self._minor = arguments.positive("minor", minor)
        self._axes = np.stack(_frame("axis", axis), axis=1)

    def position(self, t: Floats) -> Floats:
        """Give the points at t, (n,), as a (3, n) float64 array."""
        around, along = self._p * t, self._q * t
        reach = self._major + self._minor * np.cos(along)
        local = (reach * np.cos(around), reach * np.sin(around), self._minor * np.sin(along))
        return self._center + self._axes @ np.stack(local)

    def derivative(self, t: Floats) -> Floats:
        """Give dP/dt at t, (n,), as a (3, n) float64 array."""
        around, along = self._p * t, self._q * t
        reach = self._major + self._minor * np.cos(along)
        widening = -self._q * self._minor * np.sin(along)
        local = (
            widening * np.cos(around) - self._p * reach * np.sin(around),
            widening * np.sin(around) + self._p * reach * np.cos(around),
            self._q * self._minor * np.cos(along),
        )
        return np.asarray(self._axes @ np.stack(local))

    def enclosure(self, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats]:
        """Give boxes that hold the curve from t_lo to t_hi, (n,): (3, n), (3, n)."""
        t = Interval(t_lo, t_hi)
        around, along = self._p * t, self._q * t
        reach = self._major + self._minor * cos(along)
        u, v, n = self._axes.T[:, :, None]
        box = self._center + u * (reach * cos(around))
        box = box + v * (reach * sin(around)) + n * (self._minor * sin(along))
        return box.lo, box.hi


def _frame(name: str, direction: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Give unit vectors u, v, n, right-handed, n along a direction, u where angles begin."""
    n = arguments.vector(name, direction)
    n = n / (np.abs(n).max() or 1.0)  # so that its square neither overflows nor vanishes
    length = np.linalg.norm(n)
    if length == 0:
        raise arguments.ArgumentError(name, "has no direction: it is 0")
    n = n / length
    towards = np.array([1.0, 0.0, 0.0])
    if np.hypot(n[1], n[2]) < 1e-9:
        towards = np.array([0.0, 1.0, 0.0])
    u = towards - (towards @ n) * n
    u /= np.linalg.norm(u)
    return u, np.cross(n, u), n

"""Splines: Bezier curve, B-spline (and NURBS), Catmull-Rom spline. Knows formulas only.

All have exact derivatives and enclosures. Points are (n, 3) arrays, in voxels.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.compute.array_types import Evaluate, Floats
from voxdisplay.compute.kernel_backend import with_kernel
from voxdisplay.curves import arguments
from voxdisplay.curves.columns import are_moderate, from_columns
from voxdisplay.curves.curve import Curve
from voxdisplay.curves.span_bounds import Box, control_box, enclose_spans
from voxdisplay.expressions.interval import Interval, interval

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import ArrayLike

    from voxdisplay.compute.array_types import Ints

MAX_DEGREE = 64
"""Highest degree of a Bezier curve or B-spline; the work grows with its square."""

KNOT_ROUNDING = 1e-6
"""So far, as a share of their range, knots may descend: they were rounded to 32 bits or to text."""


class Bezier(Curve):
    """A Bezier curve of any degree, 0 <= t <= 1, by de Casteljau's algorithm.

    Parameters
    ----------
    points : (n, 3) array
        The control points, 2 <= n <= `MAX_DEGREE` + 1; the degree is n - 1.
    closed : bool, optional
        None: found from the end points.

    """

    t_range = (0.0, 1.0)
    always_defined = True
    thread_safe = True

    def __init__(self, points: ArrayLike, *, closed: bool | None = None) -> None:
        self.closed = closed
        self._points = arguments.points("points", points, least=2)
        _check_degree("points", len(self._points) - 1)
        self.family = len(self._points)

    @cached_property
    def _arguments(self) -> Mapping[str, object]:  # type: ignore[override]  # made when it is shown
        return {"points": self._points, "closed": self.closed}

    @classmethod
    def many(cls, points: Floats, closed: Sequence[bool | None]) -> list[Bezier | None]:
        """Return many curves of one degree, which cost less than one by one.

        Parameters
        ----------
        points : (m, n, 3) float64 array
            The control points of each.
        closed : sequence of bool or None

        Returns
        -------
        list of Bezier or None
            None where an argument is wrong.

        """
        size = points.shape[1]
        if not 2 <= size <= MAX_DEGREE + 1:
            return [None] * len(points)
        families = [size] * len(points)
        good = are_moderate(points)
        return from_columns(cls, good, _points=points, closed=closed, family=families)

    @cached_property
    def _slopes(self) -> Floats:
        """Control points, (n - 1, 3), of the derivative: its degree is one less."""
        return self.degree * np.diff(self._points, axis=0)

    @property
    def degree(self) -> int:
        """Degree of the polynomials: one less than the number of control points."""
        return len(self._points) - 1

    @np.errstate(all="ignore")
    def position(self, t: Floats) -> Floats:
        """Return the points at t, (n,), as a (3, n) float64 array."""
        return _de_casteljau(self._points[:, :, None], t)

    @np.errstate(all="ignore")
    def derivative(self, t: Floats) -> Floats:
        """Return dP/dt at t, (n,), as a (3, n) float64 array."""
        return _de_casteljau(self._slopes[:, :, None], t)

    @np.errstate(all="ignore")
    def enclosure(self, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats]:
        """Return boxes, (3, n) and (3, n), that hold the curve from t_lo to t_hi, (n,)."""
        knots = np.repeat((0.0, 1.0), len(self._points) - 1)[:, None]
        return control_box(interval(self._points[:, :, None]), knots, t_lo, t_hi)

    @staticmethod
    def batch_evaluator(curves: Sequence[Bezier]) -> Evaluate:
        """Return an evaluator of Bezier curves of one degree: see `Curve.batch_evaluator`."""
        rows = np.concatenate([curve._points for curve in curves])
        points = np.ascontiguousarray(rows.reshape(len(curves), -1, 3).transpose(1, 2, 0))
        return lambda which, t: evaluate_beziers(points, which, t)


@with_kernel
def evaluate_beziers(control: Floats, which: Ints, t: Floats) -> Floats:
    """Evaluate Bezier curves of one degree, with control points (degree + 1, 3, curves)."""
    return _de_casteljau(control.take(which, axis=2), t)


def _de_casteljau(layer: Floats, t: Floats) -> Floats:
    """Evaluate at t, (n,), from control points (degree + 1, 3, n), or 1 in place of n."""
    if len(layer) == 1:
        return np.array(np.broadcast_to(layer[0], (3, t.size)))
    rest = 1 - t
    while len(layer) > 1:
        layer = layer[:-1] * rest + layer[1:] * t
    return np.asarray(layer[0])


class BSpline(Curve):
    """A B-spline; with weights, a NURBS curve.

    Parameters
    ----------
    points : (n, 3) array
        The control points, n > degree.
    degree : int, optional
    knots : (n + degree + 1,) or (n + degree - 1,) array, optional
        Not descending; t runs from ``knots[degree]`` to ``knots[n]``. Two less are taken as CAD
        programs write them, without the first and the last, which have no influence. A knot inside
        the range that stands ``degree + 1`` times makes the curve jump, unless the two control
        points that meet there are the same. Default: 0, 1, 2, ... with the ends repeated, so that
        the curve begins at the first point and ends at the last.
    weights : (n,) array, optional
        Not negative; a control point of weight 0 has no influence. Default: all alike.
    closed : bool, optional
        True without knots: the curve is periodic, as smooth where it closes as anywhere.

    """

    always_defined = True
    thread_safe = True

    def __init__(
        self,
        points: ArrayLike,
        degree: float = 3,
        knots: ArrayLike | None = None,
        weights: ArrayLike | None = None,
        *,
        closed: bool | None = None,
    ) -> None:
        self.closed = closed
        self._degree = p = arguments.whole("degree", degree)
        if p < 1:
            raise arguments.ArgumentError("degree", f"must be 1 or more, not {p}")
        _check_degree("degree", p)
        control = arguments.points("points", points, least=p + 1)
        self._rational = weights is not None
        self._arguments = {
            "points": control,
            "degree": p,
            "knots": knots,
            "weights": weights,
            "closed": closed,
        }
        if weights is not None:
            control = _homogeneous(control, weights)
            self.always_defined = bool((control[:, 3] > 0).all())
        if knots is None and closed:
            control = np.concatenate((control, control[:p]))
            self._knots = np.arange(-p, len(control) + 1.0)
        elif knots is None:
            inner = np.arange(len(control) - p + 1.0)
            self._knots = np.concatenate((np.zeros(p), inner, np.full(p, inner[-1])))
        else:
            self._knots = _checked_knots(knots, len(control), p)
        self._points = control
        n = len(control)
        self.t_range = (float(self._knots[p]), float(self._knots[n]))
        if not self.always_defined:
            _check_spans(control[:, 3], self._knots, p)
        values, counts = np.unique(self._knots[p + 1 : n], return_counts=True)
        self.breaks = values[counts >= p]
        # The derivative is a B-spline too, of one degree less. Where its denominator is 0, it has
        # no weight anywhere in the range.
        length = self._knots[p + 1 : -1] - self._knots[1 : -p - 1]
        self._slopes = p * np.diff(control, axis=0) / np.where(length, length, 1.0)[:, None]

    @np.errstate(all="ignore")
    def position(self, t: Floats) -> Floats:
        """Return the points at t, (n,), as a (3, n) float64 array."""
        points = _de_boor(self._points, self._knots, self._degree, t)
        return np.asarray(points[:3] / points[3]) if self._rational else points

    @np.errstate(all="ignore")
    def derivative(self, t: Floats) -> Floats:
        """Return dP/dt at t, (n,), as a (3, n) float64 array; at a kink, of the side after it."""
        slopes = _de_boor(self._slopes, self._knots[1:-1], self._degree - 1, t)
        if not self._rational:
            return slopes
        points = _de_boor(self._points, self._knots, self._degree, t)
        return np.asarray((slopes[:3] - points[:3] / points[3] * slopes[3]) / points[3])

    @np.errstate(all="ignore")
    def enclosure(self, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats]:
        """Return boxes, (3, n) and (3, n), that hold the curve from t_lo to t_hi, (n,)."""
        inner = self._knots[self._degree : len(self._points) + 1]
        return enclose_spans(np.unique(inner), t_lo, t_hi, self._box)

    def _box(self, i: Ints, t_lo: Floats, t_hi: Floats) -> Box:
        p = self._degree
        inner = np.unique(self._knots[p : len(self._points) + 1])
        k = np.searchsorted(self._knots, inner[i], side="right") - 1
        control = np.stack([self._points[k - p + j].T for j in range(p + 1)])
        knots = np.stack([self._knots[k - p + 1 + j] for j in range(2 * p)])
        low, high = control_box(interval(control), knots, t_lo, t_hi)
        if not self._rational:
            return low, high
        box = Interval(low[:3], high[:3]) / Interval(low[3], high[3])
        return box.lo, box.hi


def _homogeneous(points: Floats, weights: ArrayLike) -> Floats:
    """Return homogeneous coordinates, (n, 4): x w, y w, z w, w."""
    factors = arguments.array("weights", weights, (len(points),))
    if (factors < 0).any():
        raise arguments.ArgumentError(
            "weights",
            f"must not be negative, as {factors.min():g}",
            hint="a weight pulls the curve to its point; 0 takes the point out",
        )
    return np.column_stack((points * factors[:, None], factors))


def _check_spans(weights: Floats, knots: Floats, p: int) -> None:
    """Raise ArgumentError if weights leave a curve without a point between two knots."""
    n = len(weights)
    for k in range(p, n):
        if knots[k] < knots[k + 1] and not weights[k - p : k + 1].any():
            raise arguments.ArgumentError(
                "weights",
                f"are 0 for all points from {k - p} to {k}, so that the curve has no point from "
                f"t = {knots[k]:g} to {knots[k + 1]:g}",
                hint="give one of these points a positive weight",
            )


def _checked_knots(knots: ArrayLike, n: int, p: int) -> Floats:
    values = arguments.array("knots", knots, (None,))
    if len(values) == n + p - 1 and len(values):
        values = np.concatenate((values[:1], values, values[-1:]))
    if len(values) != n + p + 1:
        raise arguments.ArgumentError(
            "knots",
            f"are {len(values)}, not {n + p + 1}: {n} points + degree {p} + 1",
            hint=f"write each knot as often as it counts; {n + p - 1} are taken, too, as of CAD "
            "programs that leave out the first and the last",
        )
    values = _ascending(values)
    if values[p] == values[n]:
        raise arguments.ArgumentError(
            "knots",
            "leave no range for t",
            hint=f"t runs from knot {p} to knot {n}, counted from 0, which are the same",
        )
    inside = values[(values > values[p]) & (values < values[n])]
    often, counts = np.unique(inside, return_counts=True)
    if (counts > p + 1).any():
        worst = int(np.argmax(counts > p + 1))
        raise arguments.ArgumentError(
            "knots",
            f"have {often[worst]:g} {counts[worst]} times, and {p + 1} is the most",
            hint=f"leave out {counts[worst] - p - 1} of them and as many points, which have no "
            "influence",
        )
    return values


def _ascending(knots: Floats) -> Floats:
    """Return knots whose descents were rounding errors, or raise ArgumentError."""
    steps = np.diff(knots)
    worst = int(np.argmin(steps))
    if steps[worst] >= -KNOT_ROUNDING * np.ptp(knots):
        return np.maximum.accumulate(knots)
    raise arguments.ArgumentError(
        "knots",
        f"must not descend, as from {knots[worst]:g} to {knots[worst + 1]:g}",
        hint="for the same curve, negate all of them" if (steps <= 0).all() else None,
    )


def _de_boor(points: Floats, knots: Floats, p: int, t: Floats) -> Floats:
    """Return points, (dimensions, n), of a B-spline at t, (n,), by de Boor's algorithm."""
    # The span of each t: the last k with knots[k] <= t < knots[k + 1]; at the end, the last one
    # that has a length.
    last = np.searchsorted(knots, knots[len(points)], side="left") - 1
    k = np.clip(np.searchsorted(knots, t, side="right") - 1, p, last)
    layer = [points[k - p + j].T for j in range(p + 1)]
    for r in range(1, p + 1):
        for j in range(p, r - 1, -1):
            low, high = knots[k - p + j], knots[k + 1 + j - r]
            f = (t - low) / (high - low)
            layer[j] = layer[j - 1] * (1 - f) + layer[j] * f
    return layer[p]


class CatmullRom(Curve):
    """A smooth curve through points: the centripetal Catmull-Rom spline.

    Between two points, t grows by the square root of their distance, which keeps the curve from
    overshooting and from looping. An open curve leaves and arrives as if its neighbouring point
    were mirrored at the end.

    Parameters
    ----------
    points : (n, 3) array
        At least two that differ; a point equal to the one before it counts once.
    closed : bool, optional
        True: the curve goes on to the first point, smoothly.

    """

    always_defined = True
    thread_safe = True

    def __init__(self, points: ArrayLike, *, closed: bool | None = None) -> None:
        self.closed = closed
        nodes = arguments.points("points", points, least=2)
        self._arguments = {"points": nodes, "closed": closed}
        if closed:
            nodes = np.concatenate((nodes, nodes[:1]))
        nodes = nodes[np.r_[True, (np.diff(nodes, axis=0) != 0).any(axis=1)]]
        if len(nodes) < 2:
            raise arguments.ArgumentError("points", "are all the same")
        ends = (
            (nodes[-2], nodes[1])
            if closed
            else (2 * nodes[0] - nodes[1], 2 * nodes[-1] - nodes[-2])
        )
        chords = np.diff(np.concatenate((ends[:1], nodes, ends[1:])), axis=0)
        # hypot, which is 0 for none but equal points
        steps = np.sqrt(np.hypot(np.hypot(chords[:, 0], chords[:, 1]), chords[:, 2]))[:, None]
        rates = chords / steps
        before, after = steps[:-1], steps[1:]
        # The slope at a node, of the parabola through it and its neighbours.
        self._slopes = (rates[:-1] * after + rates[1:] * before) / (before + after)
        self._nodes = nodes
        self._t = np.concatenate(([0.0], np.cumsum(steps[1:-1])))
        self.t_range = (0.0, float(self._t[-1]))
        # Where it comes back the way it went, it stops and turns.
        stops = np.linalg.norm(self._slopes[1:-1], axis=1) <= 1e-9 * steps[1:-2, 0]
        self.breaks = self._t[1:-1][stops]

    @np.errstate(all="ignore")
    def position(self, t: Floats) -> Floats:
        """Return the points at t, (n,), as a (3, n) float64 array."""
        a, b, slope_a, slope_b, h, f = self._span(t)
        g = 1 - f
        return (
            (1 + 2 * f) * g * g * a
            + f * g * g * h * slope_a
            + f * f * (3 - 2 * f) * b
            - f * f * g * h * slope_b
        )

    @np.errstate(all="ignore")
    def derivative(self, t: Floats) -> Floats:
        """Return dP/dt at t, (n,), as a (3, n) float64 array."""
        a, b, slope_a, slope_b, h, f = self._span(t)
        g = 1 - f
        return 6 * f * g * (b - a) / h + g * (1 - 3 * f) * slope_a + f * (3 * f - 2) * slope_b

    @np.errstate(all="ignore")
    def enclosure(self, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats]:
        """Return boxes, (3, n) and (3, n), that hold the curve from t_lo to t_hi, (n,)."""
        return enclose_spans(self._t, t_lo, t_hi, self._box)

    def _box(self, i: Ints, t_lo: Floats, t_hi: Floats) -> Box:
        a, b = (interval(self._nodes[k].T) for k in (i, i + 1))
        slope_a, slope_b = (self._slopes[k].T for k in (i, i + 1))
        # The cubic with these ends and slopes, as a Bezier curve.
        third = (interval(self._t[i + 1]) - self._t[i]) / 3.0
        points = (a, a + third * slope_a, b - third * slope_b, b)
        low, high = (np.stack([getattr(point, end) for point in points]) for end in ("lo", "hi"))
        knots = np.repeat((self._t[i], self._t[i + 1]), 3, axis=0)
        return control_box(Interval(low, high), knots, t_lo, t_hi)

    def _span(self, t: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
        """Return the two nodes around each t, their slopes, their distance in t, and its share."""
        i = np.clip(np.searchsorted(self._t, t, side="right") - 1, 0, len(self._t) - 2)
        h = self._t[i + 1] - self._t[i]
        nodes, slopes = self._nodes.T, self._slopes.T
        return nodes[:, i], nodes[:, i + 1], slopes[:, i], slopes[:, i + 1], h, (t - self._t[i]) / h


def _check_degree(name: str, degree: int) -> None:
    if degree > MAX_DEGREE:
        what = "is" if name == "degree" else "make a curve of degree"
        raise arguments.ArgumentError(name, f"{what} {degree}: more than {MAX_DEGREE}")

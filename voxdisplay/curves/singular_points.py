"""Isolated singular parameters of curves, and curves completed there by their limits.

``20*sin(t)/t`` has no value at t = 0, though both sides meet in one point: a removable
singularity, which is drawn through. Where both sides have limits that differ, as those of
``t/abs(t)``, the curve jumps. Where a side has none, there is a pole: an error.

Candidates come from bounds: where an enclosure knows nothing, however narrow the interval, the
formula may have no value. A callable has no bounds; it is tried at parameters that people use.

Must not know voxels or how curves are sampled.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, final

import numpy as np

from voxdisplay.curves import arguments, checked_methods
from voxdisplay.curves.curve import Curve
from voxdisplay.curves.one_sided_limits import Limit, limit
from voxdisplay.errors import CurveError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from voxdisplay.compute.array_types import Floats

AXES = "xyz"
SAME_POINT = 1e-3
"""Limits of two sides that are this near, in voxels, are one point."""
MAX_COORDINATE = 2.0**30
"""Coordinates beyond this have no voxel."""
REPEATABLE = 1e-6
"""Values of one parameter that differ by more, in voxels and relative, are not of one function."""
# Intervals that are bounded first, parts of an unbounded one in each further round, and most
# intervals that are followed: more are a stretch without values.
_FIRST_INTERVALS, _PARTS, _MOST_INTERVALS = 16, 16, 512
# Of fewer parameters all are evaluated again.
_LEAST_FOR_SOME = 8
# Parts of the range whose ends are among the customary parameters.
_EVEN_PARTS = 64
# Most singular parameters of one curve, in each coordinate.
_MOST = 256
# More finite candidates beyond `MAX_COORDINATE` are no poles, but a curve that is far out.
_MOST_FAR = 8
# The outermost distance of samples towards a singular parameter, as a share of the range. Not a
# power of 2, so that an oscillation whose period divides the range is not sampled in step.
_REACH = 0.0127
HINT = "shorten the range of t so that it keeps away from this parameter"


@dataclass(frozen=True, slots=True)
class SingularPoint:
    """A parameter at which one coordinate of a curve has no value, though both sides have limits.

    Attributes
    ----------
    axis : str
        ``"x"``, ``"y"`` or ``"z"``.
    t : float
        The parameter.
    jump : bool
        True if the limits of both sides differ; else it is drawn through.

    """

    axis: str
    t: float
    jump: bool = False

    def __str__(self) -> str:
        drawn = "jumps there" if self.jump else "is drawn with its limit there"
        return f"{self.axis} has no value at t = {self.t!r}, and {drawn}"


@dataclass(frozen=True, slots=True, eq=False)
class _Side:
    """Linear interpolation of one coordinate, from its limit at ``t`` to its value at ``end``."""

    row: int
    t: float
    end: float
    at_limit: float
    at_end: float

    def patch(self, t: Floats, points: Floats) -> None:
        low, high = sorted((self.t, self.end))
        near = (t >= low) & (t <= high)
        if near.any():
            share = (t[near] - self.t) / (self.end - self.t)
            points[self.row, near] = self.at_limit + share * (self.at_end - self.at_limit)


@final
class CompletedCurve(Curve):
    """A curve with isolated singular parameters, where it takes the limits of its sides.

    Made by `complete`. Bounds are those of the formula: over an interval that holds a singular
    parameter nothing is known, so that no certificate rests on a numerical limit.

    Parameters
    ----------
    curve : Curve
    singular_points : sequence of SingularPoint
    sides : sequence
        Of each, the coordinate beside it.

    """

    def __init__(
        self,
        curve: Curve,
        singular_points: Iterable[SingularPoint],
        sides: Iterable[_Side],
    ) -> None:
        self.curve = curve
        self.singular_points = tuple(singular_points)
        self._sides = tuple(sides)
        self.t_range, self.closed = curve.t_range, curve.closed
        jumps = [point.t for point in self.singular_points if point.jump]
        self.breaks = np.union1d(curve.breaks, jumps) if jumps else curve.breaks
        self._arguments = {"curve": curve, "singular_points": self.singular_points}

    @property
    def min_length(self) -> float:
        """`Curve.min_length` of the curve inside."""
        return self.curve.min_length

    @property
    def thread_safe(self) -> bool:
        """`Curve.thread_safe` of the curve inside."""
        return self.curve.thread_safe

    @np.errstate(all="ignore")
    def position(self, t: Floats) -> Floats:
        """Return the points at t, (n,), as a (3, n) float64 array."""
        points = np.array(self.curve.position(t if self.thread_safe else t.copy()), dtype=float)
        for side in self._sides:
            side.patch(t, points)
        return points

    @np.errstate(all="ignore")
    def derivative(self, t: Floats) -> Floats | None:
        """Return dP/dt at t, (n,), as (3, n); the mean slope beside singular parameters."""
        slopes = self.curve.derivative(t)
        if slopes is None:
            return None
        slopes = np.array(slopes, dtype=float)
        for side in self._sides:
            low, high = sorted((side.t, side.end))
            near = (t >= low) & (t <= high)
            slopes[side.row, near] = (side.at_end - side.at_limit) / (side.end - side.t)
        return slopes

    def enclosure(self, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats] | None:
        """Return boxes of the formula itself, nan over intervals that hold a singular parameter."""
        box = self.curve.enclosure(t_lo, t_hi)
        if box is None:
            return None
        low, high = np.array(box[0]), np.array(box[1])
        for point in self.singular_points:
            low[AXES.index(point.axis), (t_lo <= point.t) & (point.t <= t_hi)] = np.nan
        return low, high


def singular_points(curve: Curve) -> tuple[SingularPoint, ...]:
    """Return the singular parameters of a curve that `complete` returned, ascending."""
    # isinstance takes longer for abstract classes, and there may be many curves.
    return curve.singular_points if type(curve) is CompletedCurve else ()


@np.errstate(all="ignore")
def complete(curve: Curve, also: Iterable[float] = ()) -> Curve:
    """Return a curve that has a point at its isolated singular parameters, if it has any.

    Parameters
    ----------
    curve : Curve
    also : iterable of float
        Parameters at which it is known to have no value.

    Returns
    -------
    Curve
        The same object if nothing is found.

    Raises
    ------
    CurveError
        If it has a pole; or if it is a callable that returns other points for the same t.

    """
    also = list(also)
    checked_methods.check_curve(curve)
    if curve.always_defined and not also:
        return curve
    if isinstance(curve, CompletedCurve):
        if not also:
            return curve
        also += [point.t for point in curve.singular_points]
        curve = curve.curve
    candidates = np.union1d(_candidates(curve), also)
    if not candidates.size:
        return curve
    points = _evaluate(curve, candidates)
    _check_repeatable(curve, candidates, points)
    with np.errstate(all="ignore"):
        far = (~(np.abs(points) < MAX_COORDINATE)).any(axis=0)
        finite = np.isfinite(points).all(axis=0)
    if np.count_nonzero(far & finite) > _MOST_FAR:  # it is far out as a whole
        far &= ~finite
    found: list[SingularPoint] = []
    sides: list[_Side] = []
    singular = candidates[far]
    for index in np.flatnonzero(far).tolist():
        if len(found) > 3 * _MOST:
            raise CurveError(
                f"{found[0].axis} has no value at more than {_MOST} parameters, the first at "
                f"t = {found[0].t!r}",
                axis=found[0].axis,
                hint="shorten the range of t, or write a formula that has values there",
            )
        some, beside = _analyse(curve, float(candidates[index]), points[:, index], singular)
        found += some
        sides += beside
    return CompletedCurve(curve, found, sides) if found else curve


def _evaluate(curve: Curve, t: Floats) -> Floats:
    with np.errstate(all="ignore"):
        points = curve.position(t.copy())
    if curve.thread_safe:  # of this package
        return np.asarray(points, dtype=float)
    return arguments.curve_points(curve.position.__qualname__, points, t.size)


def _check_repeatable(curve: Curve, t: Floats, points: Floats) -> None:
    """Raise CurveError if a callable returns other points for the same parameters.

    The second time only some are passed, without the ends and not around the same middle, and in
    reverse: points may not depend on what else is in the array, either, nor on its order.
    """
    if curve.thread_safe:
        return
    if t.size > _LEAST_FOR_SOME:
        some = slice(1, 2 * t.size // 3)
        t, points = t[some], points[:, some]
    t, points = t[::-1], points[:, ::-1]
    again = _evaluate(curve, t)
    with np.errstate(all="ignore"):
        apart = np.abs(again - points) > REPEATABLE * (1 + np.abs(points))
    apart |= np.isnan(again) != np.isnan(points)
    if apart.any():
        row, at = np.argwhere(apart)[0]
        raise CurveError(
            f"the curve's function returns other values for the same t: at t = {float(t[at])!r}, "
            f"{AXES[row]} = {points[row, at]:.9g}, then {again[row, at]:.9g}",
            axis=AXES[row],
            hint="it must depend on t alone, and on each element of t by itself: draw random "
            "numbers, read clocks, and take the range and number of parameters, outside of it",
        )


# ------------------------------------------------------------------------------- candidates


def _candidates(curve: Curve) -> Floats:
    """Return parameters at which a curve may have no value, ascending."""
    unbounded = _unbounded(curve)
    return customary_parameters(*curve.t_range) if unbounded is None else unbounded


@cache
@np.errstate(all="ignore")
def customary_parameters(first: float, last: float) -> Floats:
    """Return parameters in a range at which formulas of people tend to be singular, ascending.

    Its ends and what divides it evenly, 0, whole numbers and tenths, multiples of pi/2.
    """
    length = last - first
    if not np.isfinite(length):
        return np.array([first, last])
    found = [np.linspace(first, last, _EVEN_PARTS + 1)]
    for unit in (10.0 ** np.floor(np.log10(length) - 1), 1.0, np.pi / 2):
        low, high = np.ceil(first / unit), np.floor(last / unit)
        if 0 <= high - low <= 128:
            found.append(np.arange(low, high + 1) * unit)
    decimals = int(np.clip(1 - np.floor(np.log10(length)), 0, 300))
    found[1:] = [np.append(each, np.round(each, decimals)) for each in found[1:]]
    t = np.unique(np.concatenate(found) + 0.0)
    t = t[(t >= first) & (t <= last)]
    t.flags.writeable = False
    return np.asarray(t)


@np.errstate(all="ignore")
def _unbounded(curve: Curve) -> Floats | None:
    """Return parameters at which nothing bounds a curve, however narrow the interval.

    None for a curve without bounds.
    """
    first, last = curve.t_range
    edges = first + (last - first) * np.linspace(0.0, 1.0, _FIRST_INTERVALS + 1)
    edges[-1] = last
    resolution = 4 * float(np.spacing(max(abs(first), abs(last))))
    low, high = edges[:-1], edges[1:]
    while True:
        unknown = curve.unbounded(low, high)
        if unknown is None:
            return None
        low, high = low[unknown], high[unknown]
        if not low.size or (high - low).max() <= resolution or low.size > _MOST_INTERVALS:
            break
        share = np.linspace(0.0, 1.0, _PARTS + 1)
        edge = low[:, None] + (high - low)[:, None] * share
        edge[:, -1] = high
        low, high = edge[:, :-1].ravel(), edge[:, 1:].ravel()
        low, high = low[high > low], high[high > low]
    if not low.size:
        return low
    # Intervals that share an end are one place.
    apart = low[1:] > high[:-1] + resolution
    begin, end = low[np.append(True, apart)], high[np.append(apart, True)]
    middle = begin + (end - begin) / 2
    tries = [begin, end, middle, np.clip(0.0, begin, end)]
    tries += [np.clip(np.round(middle, digits), begin, end) for digits in range(16)]
    steps = np.arange(1, 16)[:, None] / 16
    tries.append((begin + (end - begin) * steps).ravel())
    tries.append(customary_parameters(first, last) if low.size > _MOST_INTERVALS else begin)
    t = np.unique(np.concatenate(tries) + 0.0)
    # Of the parameters of one place without a value, one is enough: `_analyse` looks at both sides.
    points = _evaluate(curve, t)
    defined = (np.abs(points) < MAX_COORDINATE).all(axis=0)
    place = np.searchsorted(begin, t, side="right")
    keep = np.ones(t.size, dtype=bool)
    for one in np.unique(place[~defined]):
        here = np.flatnonzero((place == one) & ~defined)
        simplest = min(here, key=lambda k: (len(repr(float(t[k]))), k))
        keep[here] = False
        keep[simplest] = True
    return np.asarray(t[keep])


# ----------------------------------------------------------------------------------- limits


def _analyse(
    curve: Curve, at: float, here: Floats, singular: Floats
) -> tuple[list[SingularPoint], list[_Side]]:
    """Find the limits of both sides of a singular parameter, or raise CurveError."""
    first, last = curve.t_range
    others = singular[singular != at]
    found, sides = [], []
    rows = np.flatnonzero(~(np.abs(here) < MAX_COORDINATE))
    limits: dict[int, list[float]] = {int(row): [] for row in rows}
    for direction, border in ((-1, first), (1, last)):
        if at == border:
            continue
        blocked = others[(others - at) * direction > 0]
        room = min(abs(border - at), *np.abs(blocked - at).tolist(), (last - first) / 2)
        reach = min(_REACH * (last - first), 0.31 * room)
        resolution = 8 * float(np.spacing(max(abs(first), abs(last))))
        count = max(int(np.log2(reach / resolution)), 1) if reach > resolution else 1
        t = at + direction * reach * 0.5 ** np.arange(count)
        points = _evaluate(curve, t)
        for row, of_row in limits.items():
            outcome = limit(points[row])
            if np.isfinite(here[row]) and not outcome.diverges:
                if not abs(outcome.value) < MAX_COORDINATE:  # no singularity, but far out
                    continue
            elif not np.isfinite(outcome.value):
                raise _no_limit(at, row, here[row], points[row], outcome)
            end = outcome.settled
            sides.append(_Side(row, at, float(t[end]), outcome.value, float(points[row, end])))
            of_row.append(outcome.value)
    for row, values in limits.items():
        if not values:
            continue
        jump = len(values) == 2 and abs(values[1] - values[0]) > SAME_POINT
        if len(values) == 2 and not jump:  # both sides end in the very same point
            middle = (values[0] + values[1]) / 2
            sides = [
                _Side(side.row, side.t, side.end, middle, side.at_end) if side.row == row else side
                for side in sides
            ]
        found.append(SingularPoint(AXES[row], at, jump))
    return found, sides


def _no_limit(at: float, row: int, here: float, values: Floats, outcome: Limit) -> CurveError:
    axis = AXES[row]
    where = f"{axis} = {here:.6g} at t = {at!r}"
    if outcome.diverges:
        problem = "too far out to have a voxel" if np.isfinite(here) else "not finite"
        message = f"{where} is {problem}: {axis} grows without bound towards it"
    elif not np.isfinite(values).any():
        message = f"{where} is not finite, nor is {axis} beside it"
    else:
        message = f"{where} is not finite, and {axis} does not settle towards it"
    return CurveError(message, axis=axis, hint=HINT)

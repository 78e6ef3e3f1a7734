"""Distances between voxels and a curve, measured on a fine polyline and then on the curve itself.

This module must not know how voxels are chosen and shares no code with the methods it judges:
curves are sampled here anew, by bisection.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Bools, Floats, Ints
from voxdisplay.curves.curve import Curve
from voxdisplay.curves.singular_points import complete, singular_points
from voxdisplay.errors import CurveError
from voxdisplay.voxelization.index_ranges import expand_ranges
from voxdisplay.voxelization.length_estimate import estimated_min_length
from voxdisplay.voxelization.spatial_hash import PAIRS_PER_BLOCK, SpatialHash

Voxels = NDArray[np.integer]
Value = TypeVar("Value")

# The polyline in place of the curve: segments at most this long, with the curve's middle this
# close to theirs (voxels). Distances do not depend on it; the search for candidates does.
SEGMENT = 0.5
SAG = 0.01
# No distance is looked for along a polyline of more segments than this.
MAX_SEGMENTS = 50_000_000
# No more samples than this, for a sequence of no voxels and for each voxel, are spent on SAG.
MIN_SAG_SAMPLES, SAG_SAMPLES_PER_VOXEL = 1 << 15, 256
# A candidate segment may be this much further away than the nearest, and hold the nearest point.
SLACK = 4 * SAG
# Size of the cells, in voxels, of which consecutive segments have one box.
BOX = 0.25
GOLDEN = (5**0.5 - 1) / 2


@np.errstate(all="ignore")
def distances(voxels: Voxels, curve: Curve, *, hints: Floats | None = None) -> Floats:
    """Return the distances of voxel centres from a curve.

    Parameters
    ----------
    voxels : (N, 3) integer array
        Any voxels; their centres are at + 1/2 (paper, equation 3).
    curve : Curve
        The curve, from P(a) to P(b).
    hints : (n,) float64 array, optional
        Parameters where to look, as well as everywhere: for features narrower than 1/256 of the
        range of t. Distances are from the curve's points, whatever the hints.

    Returns
    -------
    (N,) float64 array
        Distance to the nearest point of the curve, in voxels, to about 1e-6: the nearest segments
        of a fine polyline, then a golden-section search on the curve itself.

    """
    voxels, index = _distinct(voxels)
    centres = np.asarray(voxels, dtype=float).T + 0.5
    found = _with_completed(curve, partial(_distances, centres, _sag_budget(voxels), hints))
    return np.asarray(found[index])


def _distances(centres: Floats, budget: int, hints: Floats | None, curve: Curve) -> Floats:
    t, begin, solid = _polyline(curve, budget, hints)
    after = np.arange(t.size) + np.append(solid, False)  # a segment of length 0 before a jump
    t_end, end = t[after], begin[:, after]
    boxes = _Boxes(begin, end)
    best = np.full(centres.shape[1], np.inf)
    todo = np.arange(best.size)
    size = 1.0  # nearly all voxels that show a curve are nearer than this less a box
    while todo.size:
        cells = SpatialHash(np.floor(boxes.middle / size))
        for of, box in cells.neighbours(np.floor(centres[:, todo] / size)):
            for voxel_of, segment in boxes.candidates(centres[:, todo], of, box):
                centre = centres[:, todo[voxel_of]]
                rough = _segment_distances(centre, begin[:, segment], end[:, segment])
                voxel, nearest = _group_minima(voxel_of, rough)
                close = rough <= nearest[np.searchsorted(voxel, voxel_of)] + SLACK
                arc = segment[close]
                exact = _arc_distances(curve, centre[:, close], t[arc], t_end[arc])
                _, best[todo[voxel]] = _group_minima(voxel_of[close], exact)
        # Whatever was not looked at is further off than a cell, less half a box.
        todo = todo[best[todo] > size - boxes.largest - SLACK]
        size *= 4
    return best


def _distinct(voxels: Voxels) -> tuple[Voxels, Ints]:
    """Return the distinct voxels, (m, 3), and the index among them of each voxel, (N,)."""
    order = np.lexsort(voxels.T)
    ascending = voxels[order]
    first = np.ones(len(voxels), dtype=bool)
    first[1:] = (ascending[1:] != ascending[:-1]).any(axis=1)
    index = np.empty(len(voxels), dtype=np.int64)
    index[order] = np.cumsum(first) - 1
    return ascending[first], index


class _Boxes:
    """Boxes around consecutive segments in one small cell: one for many where they are short.

    Parameters
    ----------
    begin, end : (3, n) float64 arrays
        The ends of the segments, along the curve.

    """

    def __init__(self, begin: Floats, end: Floats) -> None:
        cell = np.floor((begin + end) / (2 * BOX))
        opens = np.append(True, (cell[:, 1:] != cell[:, :-1]).any(axis=0)).nonzero()[0]
        self._first = opens
        self._count = np.diff(opens, append=begin.shape[1])
        low = np.minimum.reduceat(np.minimum(begin, end), opens, axis=1)
        high = np.maximum.reduceat(np.maximum(begin, end), opens, axis=1)
        self.middle = (low + high) / 2
        half = high - self.middle
        self._radius = np.sqrt((half * half).sum(axis=0))
        self.largest = float(self._radius.max(initial=0.0))

    def candidates(self, centres: Floats, of: Ints, box: Ints) -> Iterator[tuple[Ints, Ints]]:
        """Yield voxels with the segments among which their nearest ones are.

        Parameters
        ----------
        centres : (3, m) float64 array
            Of the voxels.
        of, box : (k,) int64 arrays
            Indices of voxels, ascending, and of boxes near them.

        Yields
        ------
        of, segment : (j,) int64 arrays
            Indices of voxels, ascending, and of segments. All pairs of a voxel come together.

        """
        offset = centres[:, of] - self.middle[:, box]
        apart = np.sqrt((offset * offset).sum(axis=0))
        voxel, farthest = _group_minima(of, apart + self._radius[box])
        near = apart - self._radius[box] <= farthest[np.searchsorted(voxel, of)] + SLACK
        of, box = of[near], box[near]
        count = self._count[box]
        total = np.cumsum(count)
        firsts = np.flatnonzero(np.diff(of, prepend=-1, append=-1))  # of voxels, and the end
        start = 0
        while start < firsts.size - 1:
            done = int(total[firsts[start] - 1]) if firsts[start] else 0
            reached = np.searchsorted(total[firsts[1:] - 1], done + PAIRS_PER_BLOCK, side="right")
            stop = max(int(reached), start + 1)
            some = slice(firsts[start], firsts[stop])
            segments = expand_ranges(self._first[box[some]], count[some])
            yield np.repeat(of[some], count[some]), segments
            start = stop


@np.errstate(under="ignore")
def coverage(voxels: Voxels, curve: Curve) -> float:
    """Return the largest distance of a curve from the voxels that show it.

    Parameters
    ----------
    voxels : (N, 3) integer array
        Any voxels.
    curve : Curve
        The curve.

    Returns
    -------
    float
        The largest distance of a point of the curve (of a fine polyline's vertices) from the
        nearest voxel centre, in voxels; infinite if there are no voxels.

    """
    if not len(voxels):
        return float("inf")
    centres = np.asarray(voxels, dtype=float).T + 0.5
    budget = _sag_budget(voxels)
    _, points, _ = _with_completed(curve, lambda completed: _polyline(completed, budget))
    best = np.full(points.shape[1], np.inf)
    todo = np.arange(best.size)
    size = 1.5
    while todo.size:
        cells = SpatialHash(np.floor(centres / size))
        for of, voxel in cells.neighbours(np.floor(points[:, todo] / size)):
            apart = points[:, todo[of]] - centres[:, voxel]
            point, nearest = _group_minima(of, np.sqrt((apart * apart).sum(axis=0)))
            best[todo[point]] = nearest
        todo = todo[best[todo] > size]
        size *= 4
    return float(best.max())


def _sag_budget(voxels: Voxels) -> int:
    """Return how many samples may be spent on the bends of a curve with these voxels."""
    return MIN_SAG_SAMPLES + SAG_SAMPLES_PER_VOXEL * len(voxels)


def _polyline(
    curve: Curve, budget: int, hints: Floats | None = None
) -> tuple[Floats, Floats, Bools]:
    """Return fine samples of a curve, and those at any hints.

    Parameters
    ----------
    curve : Curve
    budget : int
        With more samples than this, segments are split for their length alone: a curve whose
        formula is noise at every scale bends however short they are.
    hints : (n,) float64 array, optional

    Returns
    -------
    t : (n,) float64 array
    points : (3, n) float64 array
    solid : (n - 1,) bool array
        False where the curve jumps from one sample to the next.

    """
    first, last = curve.t_range
    resolution = 4 * float(np.spacing(max(abs(first), abs(last))))
    t = np.union1d(np.linspace(first, last, 258), curve.breaks)
    if hints is not None:
        t = np.union1d(t, hints)
    t = t[(t >= first) & (t <= last)]
    points = _position(curve, t)
    settled = np.zeros(t.size - 1, dtype=bool)
    unchecked = MIN_SAG_SAMPLES
    while not settled.all():
        index = np.flatnonzero(~settled)
        middle = (t[index] + t[index + 1]) / 2
        there = _position(curve, middle)
        length = points[:, index + 1] - points[:, index]
        sag = there - (points[:, index] + points[:, index + 1]) / 2
        fine = (length * length).sum(axis=0) <= 4 * SEGMENT * SEGMENT
        if t.size <= budget:
            fine &= (sag * sag).sum(axis=0) <= SAG * SAG
        fine |= t[index + 1] - t[index] < resolution
        t = np.insert(t, index + 1, middle)
        points = np.insert(points, index + 1, there, axis=1)
        settled = np.insert(settled, index, fine)
        settled[index + np.arange(1, index.size + 1)] = fine
        if t.size > unchecked:
            unchecked = MAX_SEGMENTS
            total, chord = estimated_min_length(curve)
            endless = total > MAX_SEGMENTS * SEGMENT and chord > SEGMENT
            if endless or t.size > MAX_SEGMENTS:
                raise CurveError(
                    "the curve is too long or too rough to measure distances from it",
                    hint="measure a shorter range of t, or a smoother curve",
                )
    length = np.diff(points, axis=1)
    return t, points, np.asarray((length * length).sum(axis=0) <= 4 * SEGMENT * SEGMENT)


def _position(curve: Curve, t: Floats) -> Floats:
    with np.errstate(all="ignore"):
        # A curve of somebody else's may work in place: it gets an array of its own.
        points = np.asarray(curve.position(t if curve.thread_safe else t.copy()), dtype=float)
    good = np.isfinite(points).all(axis=0)
    if not good.all():
        raise _UndefinedError(float(t[np.argmin(good)]))
    return points


class _UndefinedError(Exception):
    """The curve has no point at a parameter, the only argument."""


def _with_completed(curve: Curve, measured: Callable[[Curve], Value]) -> Value:
    """Return a measurement of a curve, completed by its limits where it has no point."""
    curve = complete(curve)
    while True:
        try:
            return measured(curve)
        except _UndefinedError as error:
            (t,) = error.args
            known = len(singular_points(curve))
            curve = complete(curve, (t,))
            if len(singular_points(curve)) <= known:
                raise CurveError(f"the curve has no point at t = {t!r}") from None


def _segment_distances(point: Floats, begin: Floats, end: Floats) -> Floats:
    """Return the distances, (n,), of points from segments, (3, n) each."""
    along, apart = end - begin, point - begin
    length = np.maximum((along * along).sum(axis=0), np.finfo(float).tiny)
    share = np.clip((apart * along).sum(axis=0) / length, 0.0, 1.0)
    apart -= share * along
    return np.asarray(np.sqrt((apart * apart).sum(axis=0)))


def _arc_distances(curve: Curve, point: Floats, low: Floats, high: Floats) -> Floats:
    """Return the distances, (n,), of points, (3, n), from arcs P(t), low <= t <= high."""

    def square(t: Floats) -> Floats:
        apart = _position(curve, t) - point
        return np.asarray((apart * apart).sum(axis=0))

    best = np.minimum(square(low), square(high))
    left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_left, at_right = square(left), square(right)
    for _ in range(16):
        lower = at_left < at_right
        low, high = np.where(lower, low, left), np.where(lower, right, high)
        fresh = np.where(lower, high - GOLDEN * (high - low), low + GOLDEN * (high - low))
        at_fresh = square(fresh)
        left, right = np.where(lower, fresh, right), np.where(lower, left, fresh)
        at_left, at_right = (
            np.where(lower, at_fresh, at_right),
            np.where(lower, at_left, at_fresh),
        )
    best = np.minimum(best, np.minimum(at_left, at_right))
    # What is left of the arc is straight: drop a perpendicular on it.
    here, there = _position(curve, low), _position(curve, high)
    along = there - here
    length = np.maximum((along * along).sum(axis=0), np.finfo(float).tiny)
    share = np.clip(((point - here) * along).sum(axis=0) / length, 0.0, 1.0)
    best = np.minimum(best, square(low + share * (high - low)))
    return np.asarray(np.sqrt(best))


def _group_minima(group: Ints, values: Floats) -> tuple[Ints, Floats]:
    """Return the distinct groups of an ascending list, (n,), and the least value of each."""
    first = np.flatnonzero(np.diff(group, prepend=-1))
    return group[first], np.minimum.reduceat(values, first) if first.size else values

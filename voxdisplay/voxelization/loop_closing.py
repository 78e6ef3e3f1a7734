"""Closing of loops at their first voxel, and at corners that must stay.

A closed curve is thinned as if it were open, from the voxel of its first point S to the same
voxel. Often the voxels before and after it are adjacent, a chord. Then the loop is led through S by
a small detour, the nearest to the curve, found by exhaustive search; if there is none, S stays and
the chord with it, as at a right angle between two axes. Corners are treated as S is. This module
knows curves only as points.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Bools, Floats, Ints
from voxdisplay.voxelization.curve_batch import CurveBatch
from voxdisplay.voxelization.loop_detours import MAX_REPLACED, Joints, cheapest_detours
from voxdisplay.voxelization.thinning import WINDOW
from voxdisplay.voxelization.voxel_events import VoxelEvents

Voxel = tuple[int, int, int]

# A loop of fewer voxels is left as it is.
MIN_LOOP = 5
# Points of the curve on each side of a joint, to tell how far voxels are from it.
POINTS = 57

# Places along a loop, counted from a joint, between which a chord would lead over it.
_PAIRS = np.array(
    [(low, low + d) for d in range(2, WINDOW + 1) for low in range(max(-d, 1 - WINDOW), 1)],
    dtype=np.int64,
)
_PAIRS = _PAIRS[_PAIRS[:, 1] < WINDOW]


@dataclass(frozen=True, slots=True)
class Loops:
    """Closed curves among thinned events.

    Attributes
    ----------
    curve : (n,) int64 array
        Indices of the curves, ascending.
    begin, size : (n,) int64 arrays
        The first event of each, and the number of its voxels.

    """

    curve: Ints
    begin: Ints
    size: Ints


class Ring(NamedTuple):
    """A closed sequence: voxels, parameters, and which voxels must stay."""

    voxels: list[Voxel]
    t: list[float]
    stays: list[bool]


def loops_of(events: VoxelEvents, curve: Ints, begin: Ints, end: Ints) -> Loops:
    """Return loops of events from ``begin`` to ``end``, of which the last may repeat the first."""
    again = (events.voxels[:, begin] == events.voxels[:, end - 1]).all(axis=0)
    size = end - begin
    return Loops(curve, begin, size - (again & (size > 1)))


def close_loops(
    batch: CurveBatch, events: VoxelEvents, loops: Loops, corners: Ints
) -> dict[int, tuple[NDArray[np.int32], Floats]]:
    """Lead loops through their first voxels and their corners without chords, where possible.

    Parameters
    ----------
    batch : CurveBatch
        The curves.
    events : VoxelEvents
        Thinned.
    loops : Loops
        Closed curves among them. First and last voxel of each are adjacent.
    corners : (k,) int64 array
        Events, ascending, whose voxels are to stay as well.

    Returns
    -------
    dict
        For those that change, by the index of the curve: voxels, (n, 3), and parameters, (n,). The
        first voxel stays the first. No two voxels near the joints are neighbours but consecutive
        ones, unless that is impossible with voxels near the curve that cover it.

    """
    inside = loops.begin.searchsorted(corners, side="right") - 1
    at = corners - loops.begin[inside]
    inner = (inside >= 0) & (at > 0) & (at < loops.size[inside])
    of = np.concatenate((np.arange(loops.begin.size), inside[inner]))
    at = np.concatenate((np.zeros(loops.begin.size, dtype=np.int64), at[inner]))
    order = np.lexsort((at, of))
    of, at = of[order], at[order]
    touching = _has_chord(events, loops, of, at).nonzero()[0]
    if not touching.size:
        return {}
    # In an order that knows no beginning: detours at joints near to each other are not independent.
    voxels = events.voxels.take(loops.begin[of[touching]] + at[touching], axis=1)
    touching = touching[np.lexsort((*voxels, of[touching]))]
    points = _points_around(batch, events, loops, of, at, touching)
    opens = np.searchsorted(of, np.arange(loops.begin.size + 1))
    rings: dict[int, Ring] = {}
    rerouted: set[int] = set()
    loop, last = of[touching], batch.last[loops.curve]
    # Loop by loop one joint after the other, but those of many loops together.
    nth = np.arange(touching.size) - loop.searchsorted(loop)
    for turn in range(int(nth.max()) + 1):
        here = (nth == turn).nonzero()[0]
        asked = []
        for number, joint in zip(loop[here].tolist(), touching[here].tolist(), strict=True):
            first, end = int(opens[number]), int(opens[number + 1])
            if number not in rings:
                rings[number] = _ring_of(events, loops, number, at[first:end])
            ring = rings[number]
            at_joint = [k for k, stays in enumerate(ring.stays) if stays][joint - first]
            asked.append((ring, at_joint))
        ends = last[loop[here]].tolist()
        found = _rerouted(asked, points[here], ends)
        fresh = {
            number: ring for number, ring in zip(loop[here].tolist(), found, strict=True) if ring
        }
        rings.update(fresh)
        rerouted.update(fresh)
    return {
        int(loops.curve[number]): (
            np.array(rings[number].voxels, dtype=np.int32),
            np.maximum.accumulate(rings[number].t),
        )
        for number in sorted(rerouted)
    }


def _ring_of(events: VoxelEvents, loops: Loops, number: int, at: Ints) -> Ring:
    """Return a loop as a ring in which the voxels at its joints stay."""
    begin, size = int(loops.begin[number]), int(loops.size[number])
    stays = np.zeros(size, dtype=bool)
    stays[at] = True
    voxels = zip(*events.voxels[:, begin : begin + size].tolist(), strict=True)
    return Ring(list(voxels), events.t[begin : begin + size].tolist(), stays.tolist())


def _has_chord(events: VoxelEvents, loops: Loops, of: Ints, at: Ints) -> Bools:
    """Return which loops have a chord that leads over a joint: ``at`` of loop ``of``, (m,) each."""
    size = loops.size[of]
    reach = np.arange(1 - WINDOW, WINDOW)
    around = (at[:, None] + reach) % size[:, None] + loops.begin[of, None]
    low, high = _PAIRS.T + (WINDOW - 1)
    chord = np.zeros(of.size, dtype=bool)
    close = np.ones((of.size, len(_PAIRS)), dtype=bool)
    for row in events.voxels:
        ring = row[around]
        close &= np.abs(ring[:, high] - ring[:, low]) <= 1
    # A loop has no more places than voxels; and two of them are neighbours anyway.
    close &= high - low <= (size - 2)[:, None]
    within = np.minimum(WINDOW, size)[:, None]
    close &= (_PAIRS[:, 1] < within) & (-_PAIRS[:, 0] < within)
    np.logical_or.reduce(close, axis=1, out=chord)
    return np.asarray(chord & (size >= MIN_LOOP))


def _points_around(
    batch: CurveBatch, events: VoxelEvents, loops: Loops, of: Ints, at: Ints, some: Ints
) -> Floats:
    """Return points of the curve before and after some of the joints: (m, 3, 2 * POINTS).

    They go as far as voxels may be replaced, and not over the next joint.
    """
    last_of_loop = np.append(of[1:] != of[:-1], True)
    following = np.where(last_of_loop, loops.size[of], np.append(at[1:], 0))[some]
    previous = np.append(0, at[:-1])
    previous[at == 0] = at[last_of_loop]
    of, at, previous = of[some], at[some], previous[some]
    size, begin, curve = loops.size[of], loops.begin[of], loops.curve[of]
    reach = np.minimum(MAX_REPLACED, size // 2 - 1)
    t, first, last = events.t, batch.first[curve], batch.last[curve]
    middle = t[begin + at]
    end = np.where(at == 0, last, middle)
    low = t[begin + np.maximum(np.where(at == 0, size, at) - reach, previous)]
    beyond = np.minimum(at + reach, following)
    high = np.where(beyond < size, t[begin + np.minimum(beyond, size - 1)], last)
    share = np.linspace(0.0, 1.0, POINTS)
    sides = [a[:, None] + (b - a)[:, None] * share for a, b in ((low, end), (middle, high))]
    along = np.clip(np.concatenate(sides, axis=1), first[:, None], last[:, None])
    order = np.argsort(curve, kind="stable")  # they must ascend
    points = batch.evaluate(curve[order].repeat(2 * POINTS), along[order].reshape(-1))
    points = points.reshape(3, order.size, 2 * POINTS).transpose(1, 0, 2)
    return np.asarray(points[np.argsort(order)])


def _rerouted(
    asked: list[tuple[Ring, int]], points: Floats, last: list[float]
) -> list[Ring | None]:
    """Return rings led through the voxels at joints without chords; None where that is impossible.

    Parameters
    ----------
    asked : list of (Ring, int)
        Rings, and the index of a joint in each.
    points : (m, 3, 2 * POINTS) float64 array
        The curve around each joint.
    last : list of float
        The last parameter of each curve.

    """
    around = [_around(ring, at) for ring, at in asked]
    sides = np.zeros((2, len(asked), MAX_REPLACED, 3), dtype=np.int64)
    for nth, ((ring, _), both) in enumerate(zip(asked, around, strict=True)):
        for side, indices in zip(sides, both, strict=True):
            if indices:
                side[nth, : len(indices)] = [ring.voxels[k] for k in indices]
    count = np.array([[len(both[side]) for both in around] for side in (0, 1)])
    start = np.array([ring.voxels[at] for ring, at in asked], dtype=np.int64)
    detours = cheapest_detours(Joints(start, sides, count, points))
    ways = [
        [list(map(tuple, each[:used])) for each, used in zip(voxels, counts, strict=True)]
        for voxels, counts in zip(detours.voxels.tolist(), detours.counts.tolist(), strict=True)
    ]
    return [
        _with_detour(ring, at, end, both, (out, back), (j, i)) if found else None
        for (ring, at), end, both, found, out, back, j, i in zip(
            asked, last, around, detours.found.tolist(), *ways, *detours.join.tolist(), strict=True
        )
    ]


def _around(ring: Ring, at: int) -> tuple[list[int], list[int]]:
    """Return the places that may be replaced after and before a joint, from there on."""
    size = len(ring.t)
    reach = max(min(MAX_REPLACED, size // 2 - 1), 0)
    sides = []
    for way in (1, -1):
        side = [(at + way * (k + 1)) % size for k in range(reach)]
        # Detours do not lead over other joints.
        stop = next((k for k, index in enumerate(side) if ring.stays[index]), reach)
        sides.append(side[: stop + 1])
    return sides[0], sides[1]


def _with_detour(
    ring: Ring,
    at: int,
    last: float,
    around: tuple[list[int], list[int]],
    ways: tuple[list[Voxel], list[Voxel]],
    joins: tuple[int, int],
) -> Ring:
    """Return a ring with a detour to both sides of a joint, which join the sides at places."""
    size = len(ring.t)
    (after, before), (out, back), (j, i) = around, ways, joins
    t_out = ring.t[after[j]] if after[j] else last
    t_back = ring.t[before[i]]
    begin, end = ring.t[at], ring.t[at] if at else last
    fresh_out = [begin + (t_out - begin) * (k + 1) / (len(out) + 1) for k in range(len(out))]
    fresh_back = [end + (t_back - end) * (k + 1) / (len(back) + 1) for k in range(len(back))]
    parts = []
    for old, new_out, new_back in (
        (ring.voxels, out, back),
        (ring.t, fresh_out, fresh_back),
        (ring.stays, [False] * len(out), [False] * len(back)),
    ):
        turned = old[at:] + old[:at]
        kept = turned[1 + j : size - i]
        parts.append([turned[0], *new_out, *kept, *new_back[::-1]])
    if at:  # turn it back
        start = 1 + len(out) + (size - at) - (1 + j)
        parts = [part[start:] + part[:start] for part in parts]
    return Ring(*parts)

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
from voxdisplay.voxelization.thinning import (
    COST_UNITS,
    FAR,
    MAX_UNCOVERED,
    TINY,
    VOXEL_COST,
    WINDOW,
)
from voxdisplay.voxelization.voxel_events import VoxelEvents

Voxel = tuple[int, int, int]

# How far from a joint voxels may be replaced, and by how many on each side.
MAX_REPLACED = 7
MAX_DETOUR = 3
# A loop of fewer voxels is left as it is.
MIN_LOOP = 5
# Points of the curve on each side of a joint, to tell how far voxels are from it.
POINTS = 57
# Squared distance from the curve up to which voxels may be part of a detour: less than that of all
# four voxels around a line along their edge, which would be led around it.
MAX_SQUARE = 0.5 - 1e-6

# Places along a loop, counted from a joint, between which a chord would lead over it.
_PAIRS = np.array(
    [(low, low + d) for d in range(2, WINDOW + 1) for low in range(max(-d, 1 - WINDOW), 1)],
    dtype=np.int64,
)
_PAIRS = _PAIRS[_PAIRS[:, 1] < WINDOW]
_CELL = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.int64).T


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


class Path(NamedTuple):
    """A chordless path from a joint's voxel to one side of the loop; sets of voxels as bits."""

    cost: int  # of its voxels and of what is left of the side
    nodes: tuple[int, ...]
    join: int  # where it arrives on the side
    own: int
    ends: int  # its voxels and that of the side where it arrives
    rest: int  # what is left of the side
    near_own: int
    near_ends: int


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
    changed: dict[int, tuple[NDArray[np.int32], Floats]] = {}
    rings: dict[int, Ring] = {}
    for joint, near in zip(touching.tolist(), points, strict=True):
        number = int(of[joint])
        index, nth = int(loops.curve[number]), joint - int(opens[number])
        if number not in rings:
            some = slice(int(loops.begin[number]), int(loops.begin[number] + loops.size[number]))
            stays = np.zeros(int(loops.size[number]), dtype=bool)
            stays[at[opens[number] : opens[number + 1]]] = True
            listed = list(zip(*events.voxels[:, some].tolist(), strict=True))
            rings[number] = Ring(listed, events.t[some].tolist(), stays.tolist())
        before = rings[number]
        here = [k for k, stays in enumerate(before.stays) if stays][nth]
        ring = _reroute(before, here, near, float(batch.last[index]))
        if ring is not before:
            rings[number] = ring
            t = np.maximum.accumulate(ring.t)
            changed[index] = np.array(ring.voxels, dtype=np.int32), t
    return changed


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


def _reroute(ring: Ring, at: int, points: Floats, last: float) -> Ring:
    """Return a ring led through the voxel at a joint without chords; the same if impossible."""
    size = len(ring.t)
    reach = min(MAX_REPLACED, size // 2 - 1)
    if reach < 1:
        return ring
    around = [[(at + way * (k + 1)) % size for k in range(reach)] for way in (1, -1)]
    for side in around:  # detours do not lead over other joints
        stop = next((k for k, index in enumerate(side) if ring.stays[index]), reach)
        del side[stop + 1 :]
    after, before = around
    found = _best_detour(
        ring.voxels[at],
        [ring.voxels[k] for k in after],
        [ring.voxels[k] for k in before],
        points,
    )
    if found is None:
        return ring
    out, j, back, i = found
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
        fresh = [turned[0], *new_out, *kept, *new_back[::-1]]
        parts.append(fresh)
    if at:  # turn it back
        start = 1 + len(out) + (size - at) - (1 + j)
        parts = [part[start:] + part[:start] for part in parts]
    return Ring(*parts)


def _best_detour(
    start: Voxel, after: list[Voxel], before: list[Voxel], points: Floats
) -> tuple[list[Voxel], int, list[Voxel], int] | None:
    """Return the paths from ``start`` to both sides of a ring that lie nearest to the curve.

    Returns
    -------
    out, j, back, i
        Over the voxels ``out`` to ``after[j]``, over ``back`` to ``before[i]``. They have the least
        cost, that of `thinning`; of several, those that come first in the order of voxels, read
        from either end.

    """
    voxels, square, usable = _candidates(start, {*after, *before}, points)
    number = {voxel: k for k, voxel in enumerate(voxels)}
    costs = np.floor((np.minimum(square, FAR) + VOXEL_COST) * COST_UNITS + 0.5)
    centres = np.array(voxels).T
    apart = np.abs(centres[:, :, None] - centres[:, None, :]).max(axis=0) <= 1
    near = [int.from_bytes(row, "little") for row in np.packbits(apart, axis=1, bitorder="little")]
    allowed = sum(1 << k for k in usable.nonzero()[0].tolist())
    cost = [int(each) for each in costs]
    sides = [[number[voxel] for voxel in side] for side in (after, before)]
    outs, backs = (_chordless_paths(number[start], side, allowed, near, cost) for side in sides)
    best: tuple[int, list[Voxel]] | None = None
    found = None
    for out in outs:
        if not backs or (best and out.cost + backs[0].cost > best[0]):
            break
        for back in backs:
            total = out.cost + back.cost
            if best and total > best[0]:
                break
            if out.near_ends & (back.ends | back.rest) or back.near_ends & out.rest:
                continue
            way = [
                *(voxels[k] for k in back.nodes[::-1]),
                start,
                *(voxels[k] for k in out.nodes),
            ]
            key = min(way, way[::-1])
            if best and total == best[0] and key >= best[1]:
                continue
            if _covered(points, [*way, *after[out.join :], *before[back.join :]]):
                best, found = (total, key), (out, back)
    if found is None:
        return None
    (out, back) = found
    ways = [[voxels[k] for k in path.nodes] for path in found]
    return ways[0], out.join, ways[1], back.join


def _candidates(
    start: Voxel, known: set[Voxel], points: Floats
) -> tuple[list[Voxel], Floats, Bools]:
    """Return voxels near a joint, their squared distances from the curve, and which may be used.

    Those are near the curve and near ``start``; ``known`` ones, and ``start``, are listed anyway.
    """
    cells = np.floor(points - 0.5).astype(np.int64)
    fresh = (cells[:, 1:] != cells[:, :-1]).any(axis=0)
    cells = cells[:, np.append(True, fresh)]
    corners = (cells[:, :, None] + _CELL[:, None, :]).reshape(3, -1)
    corners = corners[:, (np.abs(corners.T - start) <= MAX_DETOUR).all(axis=1)]
    voxels = sorted({*zip(*corners.tolist(), strict=True), *known, start})
    centres = np.array(voxels, dtype=float).T + 0.5
    begin, along = points[:, None, :-1], np.diff(points, axis=1)[:, None]
    offset = centres[:, :, None] - begin
    length = np.maximum((along * along).sum(axis=0), TINY)
    share = np.clip((offset * along).sum(axis=0) / length, 0.0, 1.0)
    offset -= share * along
    square = (offset * offset).sum(axis=0).min(axis=1)
    usable = square <= MAX_SQUARE
    usable[voxels.index(start)] = False
    return voxels, square, usable


def _chordless_paths(
    start: int, side: list[int], allowed: int, near: list[int], cost: list[int]
) -> list[Path]:
    """Return chordless paths over at most ``MAX_DETOUR`` voxels to a side, the cheapest first."""
    rest, rest_cost = [0] * (len(side) + 1), [0] * (len(side) + 1)
    for k in range(len(side) - 1, -1, -1):
        rest[k] = rest[k + 1] | 1 << side[k]
        rest_cost[k] = rest_cost[k + 1] + cost[side[k]]
    found = []

    def extend(nodes: tuple[int, ...], own: int, passed: int, near_own: int, spent: int) -> None:
        """Extend a path; ``passed`` is what is near ``start`` or its voxels but the last."""
        tip = nodes[-1] if nodes else start
        if near[tip] & rest[0]:
            # The furthest it touches is where it must join: any other would leave a chord.
            join = max(k for k, node in enumerate(side) if near[tip] >> node & 1)
            if not passed & rest[join]:
                found.append(
                    Path(
                        spent + rest_cost[join],
                        nodes,
                        join,
                        own,
                        own | 1 << side[join],
                        rest[join],
                        near_own,
                        near_own | near[side[join]],
                    )
                )
        if len(nodes) == MAX_DETOUR:
            return
        free = allowed & near[tip] & ~passed & ~(1 << tip)
        while free:
            bit = free & -free
            free ^= bit
            node = bit.bit_length() - 1
            extend(
                (*nodes, node),
                own | bit,
                passed | near[tip],
                near_own | near[node],
                spent + cost[node],
            )

    extend((), 0, 0, 0, 0)
    return sorted(found)


def _covered(points: Floats, voxels: list[Voxel]) -> bool:
    """Return whether all points, (3, n), are within ``MAX_UNCOVERED`` of a voxel."""
    centres = np.array(voxels, dtype=float).T + 0.5
    apart = centres[:, :, None] - points[:, None, :]
    return bool(((apart * apart).sum(axis=0).min(axis=0) <= MAX_UNCOVERED * MAX_UNCOVERED).all())

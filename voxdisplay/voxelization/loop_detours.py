"""Cheapest chordless detours through voxels of loops, for many loops at once.

A *joint* is a voxel that a loop must lead through, such as its first one. Its detour leaves the
joint over at most ``MAX_DETOUR`` voxels to the side after it, and over as many to the side before
it. All detours are enumerated, in arrays over all joints, and the nearest to the curve is taken.
This module must not know loops or events: a joint is a voxel, two lists of voxels, and points.
"""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Bools, Floats, Ints
from voxdisplay.voxelization.index_ranges import expand_ranges
from voxdisplay.voxelization.thinning import COST_UNITS, FAR, MAX_UNCOVERED, TINY, VOXEL_COST

# How far from a joint voxels may be replaced, and by how many on each side.
MAX_REPLACED = 7
MAX_DETOUR = 3
# Squared distance from the curve up to which voxels may be part of a detour: less than that of all
# four voxels around a line along their edge, which would be led around it.
MAX_SQUARE = 0.5 - 1e-6

# Voxels around a joint are numbered in their order, by x, then y, then z.
_SIDE = 2 * MAX_DETOUR + 1
_VOXELS = _SIDE**3
_CENTRE = _VOXELS // 2
_NONE = _VOXELS
# Where voxels that are not there lie: no two kinds are near to each other or to the joint.
_AWAY = np.array([1000, -1000]).reshape(2, 1, 1, 1)
_NO_NODE = 500
# Ways to each side that are combined at first, the cheapest ones. More are, where none of these
# combinations is possible or others may cost as little.
_FIRST_WAYS = 12
# Rows of temporary arrays, so that these stay in a core's cache.
_ROWS = 256
_MOST_PAIRS = 1 << 18
_FIRST_PAIRS = 1 << 16


class Joints(NamedTuple):
    """Joints of loops, m of them.

    Attributes
    ----------
    start : (m, 3) int64 array
        Their voxels.
    sides : (2, m, MAX_REPLACED, 3) int64 array
        The voxels after each, and those before it, from the joint on.
    counts : (2, m) int64 array
        How many of them there are; the others mean nothing.
    points : (m, 3, n) float64 array
        The curve, before and after it.

    """

    start: Ints
    sides: Ints
    counts: Ints
    points: Floats

    def take(self, some: Ints) -> Joints:
        """Return some of them."""
        return Joints(
            self.start[some], self.sides[:, some], self.counts[:, some], self.points[some]
        )


class Detours(NamedTuple):
    """Detours of m joints.

    Attributes
    ----------
    found : (m,) bool array
        Where there is one. Elsewhere the rest means nothing.
    voxels : (2, m, MAX_DETOUR, 3) int64 array
        From the joint to the side after it, and to the side before it.
    counts : (2, m) int64 array
        How many voxels there are.
    join : (2, m) int64 array
        Indices of the voxels of the sides to which they lead.

    """

    found: Bools
    voxels: Ints
    counts: Ints
    join: Ints


class _Lattice(NamedTuple):
    """The voxels around a joint, and one more that is near to none."""

    offsets: Ints  # (_VOXELS + 1, 3)
    near: Bools  # (_VOXELS + 1, _VOXELS + 1): equal or adjacent
    neighbours: Ints  # (_VOXELS + 1, 26)


class _Paths(NamedTuple):
    """Chordless paths from joints over usable voxels, P of them; and what they touch.

    Sides are indexed [side, path].
    """

    joint: Ints
    nodes: Ints  # (P, MAX_DETOUR) numbers of voxels, _NONE behind the last
    valid: Bools  # (2, P) whether they arrive at a side without a chord
    join: Ints  # (2, P)
    furthest: Ints  # (2, P) the furthest voxel of a side that one of the nodes touches; -1
    cost: Ints  # (2, P) of its voxels and of what is left of the side


@cache
def _lattice() -> _Lattice:
    steps = np.indices((_SIDE,) * 3).reshape(3, -1).T - MAX_DETOUR
    near = np.zeros((_VOXELS + 1, _VOXELS + 1), dtype=np.bool_)
    near[:-1, :-1] = (np.abs(steps[:, None] - steps) <= 1).all(axis=2)
    around = np.array([step for step in np.ndindex(3, 3, 3) if step != (1, 1, 1)]) - 1
    beside = steps[:, None] + around
    number = (beside + MAX_DETOUR) @ np.array([_SIDE * _SIDE, _SIDE, 1])
    number[(np.abs(beside) > MAX_DETOUR).any(axis=2)] = _NONE
    neighbours = np.concatenate((number, np.full((1, len(around)), _NONE)))
    offsets = np.concatenate((steps, np.full((1, 3), _NO_NODE)))
    return _Lattice(offsets, near, neighbours)


def cheapest_detours(joints: Joints, ways: int | None = None) -> Detours:
    """Return the detours that lie nearest to the curve.

    They have the least cost, that of `thinning`; of several, those that come first in the order of
    voxels, read from either end. No two of their voxels and of the sides that are left are
    neighbours but consecutive ones, and every point is within ``MAX_UNCOVERED`` of one of them.

    Parameters
    ----------
    joints : Joints
    ways : int, optional
        How many ways to each side, the cheapest ones, are combined at first: the result is the
        same for any. By default all that a few joints have.

    """
    size = len(joints.start)
    if ways is None:
        ways = max(_FIRST_WAYS, math.isqrt(_FIRST_PAIRS // size))
    apart = joints.sides - joints.start[:, None]
    missing = np.arange(MAX_REPLACED) >= joints.counts[:, :, None]
    apart = np.where(missing[..., None], _AWAY, apart)
    paths = _chordless_paths(joints, apart, missing)
    between = (np.abs(apart[0][:, :, None] - apart[1][:, None]) <= 1).all(axis=3)
    reach = _last_true(between), _last_true(between.transpose(0, 2, 1))

    # The ways to each side, the cheapest first.
    node_key = _packed(paths.nodes)
    listed, firsts, counts = [], [], []
    bound = np.full(size, np.iinfo(np.int64).max)
    least, beyond = [], []
    for side in (0, 1):
        rows = paths.valid[side].nonzero()[0]
        rows = rows[np.lexsort((node_key[rows], paths.cost[side, rows], paths.joint[rows]))]
        first = paths.joint[rows].searchsorted(np.arange(size + 1))
        count = np.diff(first)
        cost = np.append(paths.cost[side, rows], 0)
        least.append(cost[first[:-1]])
        beyond.append(np.where(count > ways, cost[np.minimum(first[:-1] + ways, rows.size)], -1))
        listed.append(rows)
        firsts.append(first[:-1])
        counts.append(np.minimum(count, ways))
    # Combinations with other ways than those cost at least so much.
    both = (counts[0] > 0) & (counts[1] > 0)
    for cheap, dear in (least[0], beyond[1]), (least[1], beyond[0]):
        here = both & (dear >= 0)
        bound[here] = np.minimum(bound, cheap + dear)[here]

    out, back = _compatible_pairs(paths, reach, listed, firsts, counts)
    joint, total = paths.joint[out], paths.cost[0, out] + paths.cost[1, back]
    order = np.lexsort(
        (node_key[out], paths.cost[0, out], _way_key(paths.nodes, out, back), total, joint)
    )
    out, back, joint, total = out[order], back[order], joint[order], total[order]
    chosen = _first_covered(joints, paths, out, back, joint)
    found = chosen >= 0
    unsure = (bound < np.iinfo(np.int64).max) & ~found
    unsure[found] = total[chosen[found]] >= bound[found]
    which = np.stack((out, back))[:, chosen] if out.size else np.zeros((2, size), dtype=np.int64)
    nodes = paths.nodes[which]
    voxels = _lattice().offsets[nodes] + joints.start[:, None]
    join = np.stack([paths.join[side, which[side]] for side in (0, 1)])
    detours = Detours(found, voxels, (nodes != _NONE).sum(axis=2), join)
    again = unsure.nonzero()[0]
    if again.size:
        better = cheapest_detours(joints.take(again), 4 * ways)
        found[again] = better.found
        for mine, other in zip(detours[1:], better[1:], strict=True):
            mine[:, again] = other
    return detours


def _chordless_paths(joints: Joints, apart: Ints, missing: Bools) -> _Paths:
    """Return all paths over at most ``MAX_DETOUR`` usable voxels, the empty ones included.

    Parameters
    ----------
    joints : Joints
    apart : (2, m, MAX_REPLACED, 3) int64 array
        The sides relative to the joints; far away where there are none.
    missing : (2, m, MAX_REPLACED) bool array
        Where there are none.

    """
    usable, cost, side_cost = _costs(joints, apart, missing)
    joint, nodes = _walks(usable)
    count = (nodes != _NONE).sum(axis=1)
    spent = cost[joint[:, None], nodes].sum(axis=1)
    rest = np.cumsum(side_cost[:, :, ::-1], axis=2)[:, :, ::-1]
    offsets, row = _lattice().offsets[nodes], np.arange(joint.size)
    found = []
    for side in (0, 1):
        here = apart[side][joint]
        touch = np.ones((joint.size, MAX_DETOUR + 1, MAX_REPLACED), dtype=np.bool_)
        for axis in range(3):
            beside = here[:, :, axis]
            touch[:, 0] &= np.abs(beside) <= 1
            touch[:, 1:] &= np.abs(offsets[:, :, None, axis] - beside[:, None]) <= 1
        passed = touch & (np.arange(MAX_DETOUR + 1) < count[:, None])[:, :, None]
        # The furthest that it touches is where it must join: any other would leave a chord.
        join = _last_true(touch[row, count])
        valid = (join >= 0) & (_last_true(np.asarray(passed.any(axis=1))) < join)
        furthest = _last_true(np.asarray(touch[:, 1:].any(axis=1)))
        found.append((valid, join, furthest, spent + rest[side][joint, join]))
    valid, join, furthest, total = (np.stack(each) for each in zip(*found, strict=True))
    return _Paths(joint, nodes, valid, join, furthest, total)


def _walks(usable: Bools) -> tuple[Ints, Ints]:
    """Return chordless paths over usable voxels, (m, _VOXELS + 1): joints, (P,), and nodes."""
    lattice = _lattice()
    size = len(usable)
    joint, nodes = np.arange(size), np.full((size, MAX_DETOUR), _NONE)
    joints, walks = [joint], [nodes]
    tip = np.full(size, _CENTRE)
    for depth in range(MAX_DETOUR):
        ahead = lattice.neighbours[tip]
        free = usable[joint[:, None], ahead]
        if depth:
            free &= ~lattice.near[_CENTRE][ahead]
        for before in range(depth - 1):
            free &= ~lattice.near[nodes[:, before, None], ahead]
        row, step = free.nonzero()
        joint, tip, nodes = joint[row], ahead[row, step], nodes[row]
        nodes[:, depth] = tip
        joints.append(joint)
        walks.append(nodes)
    return np.concatenate(joints), np.concatenate(walks)


def _costs(joints: Joints, apart: Ints, missing: Bools) -> tuple[Bools, Ints, Ints]:
    """Return which voxels around joints may be used, their costs, and those of the sides.

    Voxels that may be used are near the curve and near the joint.
    """
    size = len(joints.start)
    candidates = _corners_of_cells(joints)
    inside = ~missing & (np.abs(apart) <= MAX_DETOUR).all(axis=3)
    number = (apart + MAX_DETOUR) @ np.array([_SIDE * _SIDE, _SIDE, 1])
    of_side = np.broadcast_to(np.arange(size)[:, None], inside.shape[1:])
    for side in (0, 1):
        candidates[of_side[inside[side]], number[side][inside[side]]] = True
    row, at = candidates.nonzero()
    square = _squared_distances(joints, row, joints.start[row] + _lattice().offsets[at])
    usable = np.zeros((size, _VOXELS + 1), dtype=np.bool_)
    usable[row, at] = square <= MAX_SQUARE
    usable[:, _CENTRE] = False
    cost = np.zeros((size, _VOXELS + 1), dtype=np.int64)
    cost[row, at] = _units(square)
    side_cost = np.zeros(inside.shape, dtype=np.int64)
    for side in (0, 1):
        here = inside[side]
        side_cost[side][here] = cost[of_side[here], number[side][here]]
        far = (~missing[side] & ~here).nonzero()
        side_cost[side][far] = _units(_squared_distances(joints, far[0], joints.sides[side][far]))
    return usable, cost, side_cost


def _units(square: Floats) -> Ints:
    return np.floor((np.minimum(square, FAR) + VOXEL_COST) * COST_UNITS + 0.5).astype(np.int64)


def _corners_of_cells(joints: Joints) -> Bools:
    """Return which voxels around joints are corners of a dual cell on the curve: (m, _VOXELS)."""
    size, reach = len(joints.start), MAX_DETOUR + 1
    cells = np.floor(joints.points - 0.5) - joints.start[:, :, None]
    near = np.asarray(((cells >= -reach) & (cells <= MAX_DETOUR)).all(axis=1))
    row, at = near.nonzero()
    x, y, z = (cells[row, :, at] + reach).astype(np.int64).T
    on = np.zeros((size, _SIDE + 1, _SIDE + 1, _SIDE + 1), dtype=np.bool_)
    on[row, x, y, z] = True
    for axis in (1, 2, 3):
        low, high = (slice(None),) * axis + (slice(-1),), (slice(None),) * axis + (slice(1, None),)
        on = on[low] | on[high]
    return on.reshape(size, _VOXELS)


def _squared_distances(joints: Joints, joint: Ints, voxels: Ints) -> Floats:
    """Return the squared distances of voxels, (n, 3), from the polylines of these joints, (n,)."""
    least = np.empty(len(voxels))
    along = np.diff(joints.points, axis=2)
    length = along[:, 0] * along[:, 0] + along[:, 1] * along[:, 1] + along[:, 2] * along[:, 2]
    length = np.maximum(length, TINY)
    centres = voxels + 0.5
    for low in range(0, len(voxels), _ROWS):
        rows = slice(low, low + _ROWS)
        own = joint[rows]
        ways = [along[own, axis] for axis in range(3)]
        apart = [centres[rows, axis, None] - joints.points[own, axis, :-1] for axis in range(3)]
        share = apart[0] * ways[0]
        share += apart[1] * ways[1]
        share += apart[2] * ways[2]
        share /= length[own]
        np.minimum(np.maximum(share, 0.0, out=share), 1.0, out=share)
        for axis in range(3):
            ways[axis] *= share
            apart[axis] -= ways[axis]
            apart[axis] *= apart[axis]
        apart[0] += apart[1]
        apart[0] += apart[2]
        apart[0].min(axis=1, out=least[rows])
    return least


def _compatible_pairs(
    paths: _Paths,
    reach: tuple[Ints, Ints],
    listed: list[Ints],
    firsts: list[Ints],
    counts: list[Ints],
) -> tuple[Ints, Ints]:
    """Return pairs of paths, to the side after and to the side before, without a chord.

    Parameters
    ----------
    paths : _Paths
    reach : two (m, MAX_REPLACED) int64 arrays
        For each voxel of a side, the furthest one of the other side that it touches; -1.
    listed : two (n,) int64 arrays
        The paths to each side, joint by joint.
    firsts, counts : two (m,) int64 arrays each
        Where those of each joint begin, and how many are paired.

    """
    found_out, found_back = [], []
    near = _lattice().near
    outs = listed[0][expand_ranges(firsts[0], counts[0])]
    many = counts[1][paths.joint[outs]]
    ends = np.cumsum(many)
    begin = 0
    while begin < outs.size:
        done = int(ends[begin - 1]) if begin else 0
        end = max(begin + 1, int(ends.searchsorted(done + _MOST_PAIRS, side="right")))
        some, times = outs[begin:end], many[begin:end]
        out = some.repeat(times)
        back = listed[1][expand_ranges(firsts[1][paths.joint[some]], times)]
        joint, out_join, back_join = paths.joint[out], paths.join[0, out], paths.join[1, back]
        free = (reach[0][joint, out_join] < back_join) & (reach[1][joint, back_join] < out_join)
        free &= (paths.furthest[1, out] < back_join) & (paths.furthest[0, back] < out_join)
        out, back = out[free], back[free]
        apart = ~near[paths.nodes[out][:, :, None], paths.nodes[back][:, None]].any(axis=(1, 2))
        found_out.append(out[apart])
        found_back.append(back[apart])
        begin = end
    nothing = np.empty(0, dtype=np.int64)
    return np.concatenate([nothing, *found_out]), np.concatenate([nothing, *found_back])


def _first_covered(joints: Joints, paths: _Paths, out: Ints, back: Ints, joint: Ints) -> Ints:
    """Return for each joint the first of its pairs, in order, that leaves no point alone; -1."""
    first = joint.searchsorted(np.arange(len(joints.start) + 1))
    pair, stop = first[:-1].copy(), first[1:]
    chosen = np.full(pair.size, -1)
    active = (pair < stop).nonzero()[0]
    while active.size:
        now = pair[active]
        good = _covered(joints, paths, out[now], back[now], active)
        chosen[active[good]] = now[good]
        active = active[~good]
        pair[active] += 1
        active = active[pair[active] < stop[active]]
    return chosen


def _covered(joints: Joints, paths: _Paths, out: Ints, back: Ints, joint: Ints) -> Bools:
    """Return which joints, with these pairs, have a voxel near each of their points."""
    start, nodes = (
        joints.start[joint],
        np.concatenate((paths.nodes[out], paths.nodes[back]), axis=1),
    )
    offsets = _lattice().offsets[nodes]
    there = nodes != _NONE
    parts, kept = [start[:, None], start[:, None] + offsets], [np.ones((len(out), 1), bool), there]
    nth = np.arange(MAX_REPLACED)
    for side, path in ((0, out), (1, back)):
        parts.append(joints.sides[side, joint])
        join, count = paths.join[side, path], joints.counts[side, joint]
        kept.append((nth >= join[:, None]) & (nth < count[:, None]))
    voxels = np.concatenate(parts, axis=1) + 0.5
    voxels[~np.concatenate(kept, axis=1)] = np.inf
    covered = np.empty(len(out), dtype=np.bool_)
    for low in range(0, len(out), _ROWS):
        rows = slice(low, low + _ROWS)
        points = joints.points[joint[rows]]
        least = np.full((len(points), points.shape[2]), np.inf)
        for k in range(voxels.shape[1]):
            x, y, z = (voxels[rows, k, axis, None] - points[:, axis] for axis in range(3))
            np.minimum(least, x * x + y * y + z * z, out=least)
        covered[rows] = (least <= MAX_UNCOVERED * MAX_UNCOVERED).all(axis=1)
    return covered


def _packed(numbers: Ints) -> Ints:
    """Return rows of numbers of voxels, _NONE behind the last, as numbers in the same order."""
    key = np.zeros(len(numbers), dtype=np.int64)
    for column in numbers.T:
        key = key * (_VOXELS + 1) + np.where(column == _NONE, 0, column + 1)
    return key


def _way_key(nodes: Ints, out: Ints, back: Ints) -> Ints:
    """Return a key of the ways over pairs of paths: the first by it comes first in either order."""
    centre = np.full((len(out), 1), _CENTRE)
    ways = []
    for one, other in ((out, back), (back, out)):
        way = np.concatenate((nodes[one][:, ::-1], centre, nodes[other]), axis=1)
        # To the front, in their order: a shorter way comes before those that it begins.
        order = np.argsort(way == _NONE, axis=1, kind="stable")
        ways.append(_packed(np.take_along_axis(way, order, axis=1)))
    return np.minimum(*ways)


def _last_true(mask: NDArray[np.bool_]) -> Ints:
    """Return the last index along the last axis at which a mask is set; -1 if none is."""
    last = mask.shape[-1] - 1 - np.argmax(mask[..., ::-1], axis=-1)
    return np.where(mask.any(axis=-1), last, -1)

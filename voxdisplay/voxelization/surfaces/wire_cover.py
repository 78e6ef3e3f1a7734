"""Cover of wires and points: the voxels along those that a surface has lit no voxel near.

The corners of a dual face or cell are the 4 or 8 voxel centres at its corners. Where a wire
crosses a dual face none of whose corners is lit, the nearest is lit; and so is the voxel of a
wire's end in a dual cell without a lit corner. Then no point of a wire is further than 1, in max
norm, from the centre of a lit voxel. Must not know what the wires are of.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.voxelization import index_ranges

if TYPE_CHECKING:
    from voxdisplay.compute.array_types import Bools, Floats, Ints
    from voxdisplay.voxelization.voxel_box import VoxelBox


def distinct(parts: Sequence[Ints]) -> Ints:
    """Return the distinct numbers of some arrays, ascending."""
    if not parts:
        return np.empty(0, dtype=np.int64)
    return index_ranges.distinct(np.concatenate(parts))


def cover_wires(
    index: Ints,
    box: VoxelBox,
    wires: Sequence[Floats],
    inside: Callable[[Floats], Bools],
) -> Ints:
    """Return lit voxels with those added that wires need.

    Parameters
    ----------
    index : (N,) int64 array
        Scan-order indices of lit voxels in the box, ascending.
    box : VoxelBox
        Voxels outside are not lit, nor needed.
    wires : sequence of (n, 3) float64 arrays
        Polylines; finite, n >= 1.
    inside : callable
        Points, (n, 3), to (n,) bool: where wires run inside of a solid, and need nothing.

    """
    for wire in wires:
        begin, end = wire[:-1], wire[1:]
        for axis in range(3):
            points = _crossings(begin, end, axis, box)
            index = _light(index, box, points, np.arange(3) != axis, inside)
    ends = np.concatenate([wire[[0, -1]] for wire in wires])
    return _light(index, box, ends, np.ones(3, dtype=bool), inside)


def _crossings(begin: Floats, end: Floats, axis: int, box: VoxelBox) -> Floats:
    """Return where segments cross the mid-planes of an axis inside a box, (n, 3)."""
    a, b = begin[:, axis], end[:, axis]
    bounds = box.low[axis], box.high[axis] - 1
    first = np.clip(np.ceil(np.minimum(a, b) - 0.5), bounds[0], bounds[1] + 1).astype(np.int64)
    last = np.clip(np.floor(np.maximum(a, b) - 0.5), bounds[0] - 1, bounds[1]).astype(np.int64)
    count = np.where(a == b, 0, np.maximum(last - first + 1, 0))
    which = np.repeat(np.arange(len(a)), count)
    plane = first[which] + np.arange(which.size) - np.repeat(np.cumsum(count) - count, count)
    share = (plane + 0.5 - a[which]) / (b - a)[which]
    points = begin[which] + share[:, None] * (end - begin)[which]
    points[:, axis] = plane + 0.5
    return np.asarray(points)


def _light(
    index: Ints,
    box: VoxelBox,
    points: Floats,
    spread: Bools,
    inside: Callable[[Floats], Bools],
) -> Ints:
    """Add the voxels of points none of whose surrounding voxels is lit.

    These are the voxels on both sides along the axes of ``spread``, (3,) bool.
    """
    points = points[((points > box.low) & (points < box.high)).all(axis=1)]
    if not len(points):
        return index
    base = np.floor(np.where(spread, points - 0.5, points)).astype(np.int64)
    lit = np.zeros(len(points), dtype=bool)
    for step in np.ndindex(*(1 + spread.astype(int))):
        corner = base + step
        known = box.inside(corner)
        lit[known] |= contains(index, box.index_of(corner[known]))
    if lit.all():
        return index
    voxels = np.floor(points[~lit]).astype(np.int64)
    needed = box.index_of(voxels[~inside(voxels.astype(np.float64) + 0.5)])
    return distinct([index, needed]) if needed.size else index


def contains(index: Ints, at: Ints) -> Bools:
    """Return which numbers, (m,), are among ascending ones, (n,): (m,) bool."""
    if not index.size:
        return np.zeros(at.size, dtype=bool)
    place = np.searchsorted(index, at)
    return np.asarray(index[np.minimum(place, index.size - 1)] == at)

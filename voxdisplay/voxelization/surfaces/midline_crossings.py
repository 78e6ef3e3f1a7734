"""Exact crossings of triangles with the mid-lines of one axis.

A mid-line is parallel to an axis w and passes through voxel centres; along the axes u and v that
follow w cyclically it has the column numbers i and j. Whether a mid-line meets a triangle is
decided by edge functions (Pineda 1988) in int64. Must not know which voxel a crossing lights.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Bools, Floats, Ints
from voxdisplay.voxelization.surfaces.projected_triangles import (
    Hits,
    hits_in_rows,
    hits_of_alike,
    project,
)
from voxdisplay.voxelization.surfaces.snapped_mesh import UNIT
from voxdisplay.voxelization.surfaces.triangle_blocks import TriangleBlock

# Depths are right to 1e-11 voxel; closer than this to a whole number, integers decide.
NEAR_FACE = 1e-9
# Triangles are grouped by the mid-lines that their bounding boxes meet: few, along either axis, in
# groups that outweigh the calls for each mid-line, and parts that fit into a processor's cache.
_MAX_ALIKE = 32
_LEAST_ALIKE = 128
_CANDIDATES_PER_PART = 1 << 15
_HITS_AT_ONCE = 1 << 14

Three = tuple[Ints, Ints, Ints]


@dataclass(frozen=True, slots=True, eq=False)
class Crossings:
    """Crossings of triangles with the mid-lines of one axis.

    Attributes
    ----------
    axis : {0, 1, 2}
        The axis w.
    i, j : (n,) int64 array
        Columns along u and v.
    triangle : (n,) int64 array
        Indices of the triangles.
    weights : three (n,) int64 arrays
        Edge functions opposite the corners, 0 or more: barycentric coordinates times `area`.
    heights : (3, n) int32 array
        The corners' coordinates along w, in units of 2^-16 voxel.
    area : (n,) int64 array
        Twice the projected area, positive.
    turned : (n,) bool array
        Whether the normal points against w.

    """

    axis: int
    i: Ints
    j: Ints
    triangle: Ints
    weights: Three
    heights: NDArray[np.int32]
    area: Ints
    turned: Bools

    def depth(self) -> Floats:
        """Return the coordinates of the crossings along w, (n,), in voxels."""
        (a, b, c), (p, q, r) = self.weights, self.heights
        # All weights are of one sign: the error is below 1e-11 voxel however thin the triangle.
        depth = np.multiply(a, p, dtype=np.float64)
        depth += np.multiply(b, q, dtype=np.float64)
        depth += np.multiply(c, r, dtype=np.float64)
        depth /= self.area
        depth *= 1 / UNIT
        return np.asarray(depth)

    def side_of(self, level: Ints, rows: Ints) -> Ints:
        """Return the exact sign of depth - level for crossings near a level, in 2^-16 voxel."""
        (a, b, c), (p, q, r) = self.weights, self.heights
        # Products may wrap, the sum is small: exact.
        total = a[rows] * (p[rows] - level)
        total += b[rows] * (q[rows] - level)
        total += c[rows] * (r[rows] - level)
        return np.asarray(np.sign(total))


def midline_crossings(
    block: TriangleBlock, axis: int, *, half_open: bool = False
) -> Iterator[Crossings]:
    """Yield the crossings of triangles with the mid-lines of one axis, in blocks.

    Parameters
    ----------
    block : TriangleBlock
    axis : {0, 1, 2}
        The axis w.
    half_open : bool
        Each mid-line through an edge or a corner meets one of the triangles around it (top-left
        rule) instead of all.

    """
    columns, rows = (
        block.last[(axis + k) % 3] - block.first[(axis + k) % 3] + np.int32(1) for k in (1, 2)
    )
    kept = np.flatnonzero((columns > 0) & (rows > 0))
    if not kept.size:
        return
    # Triangles whose bounding boxes meet as many mid-lines along either axis become neighbours.
    largest = np.int32(_MAX_ALIKE)
    key = np.minimum(columns.take(kept), largest) * np.int32(_MAX_ALIKE + 1)
    key += np.minimum(rows.take(kept), largest)
    key = key.astype(np.uint16)
    kept = kept.take(np.argsort(key, kind="stable"))
    count = np.bincount(key)
    stops = np.cumsum(count)
    hits: list[Hits] = []
    rest = []
    pending = 0
    for each in np.flatnonzero(count).tolist():
        shape = divmod(each, _MAX_ALIKE + 1)
        alike = kept[stops[each] - count[each] : stops[each]]
        if len(alike) < _LEAST_ALIKE or shape[0] * shape[1] > _MAX_ALIKE:
            rest.append(alike)
            continue
        length = _CANDIDATES_PER_PART // (shape[0] * shape[1])
        for begin in range(0, len(alike), length):
            part = project(block, axis, alike[begin : begin + length], half_open)
            hits.append(hits_of_alike(part, *shape))
            pending += len(hits[-1].i)
            if pending > _HITS_AT_ONCE:
                yield _crossings(block, axis, Hits.joined(hits))
                hits, pending = [], 0
    if rest:
        part = project(block, axis, np.concatenate(rest), half_open)
        hits += hits_in_rows(part, columns, rows)
    if hits:
        yield _crossings(block, axis, Hits.joined(hits))


def _crossings(block: TriangleBlock, axis: int, hits: Hits) -> Crossings:
    a, b, c = hits.a, hits.b, hits.c
    return Crossings(
        axis,
        hits.i,
        hits.j,
        hits.triangle + block.begin,
        (a, b, c),
        block.corners[axis].take(hits.triangle, axis=1),
        a + b + c,
        hits.turned,
    )

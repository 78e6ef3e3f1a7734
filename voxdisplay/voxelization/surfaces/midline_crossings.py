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
from voxdisplay.voxelization.surfaces.repeats import Repeats
from voxdisplay.voxelization.surfaces.snapped_mesh import HALF, SHIFT, UNIT, SnappedMesh

CROSSINGS_PER_BLOCK = 1 << 15
# Bounds of columns are found in floating point, with errors below 2^-30 voxel, and widened by this;
# edge functions decide.
SLACK = 1e-6
# Depths are right to 1e-11 voxel; closer than this to a whole number, integers decide.
NEAR_FACE = 1e-9
# Rows of bounding boxes that are wider are narrowed down to the triangle first.
_NARROW = 3

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
    heights : three (n,) int64 arrays
        The corners' coordinates along w, in units of 2^-16 voxel.
    area : (n,) int64 array
        Twice the projected area, positive.
    turned : (n,) bool array
        Whether the normal points against w; then the corners are in the order 0, 2, 1.

    """

    axis: int
    i: Ints
    j: Ints
    triangle: Ints
    weights: Three
    heights: Three
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
        return depth

    def side_of(self, level: Ints, rows: Ints) -> Ints:
        """Return the exact sign of depth - level for crossings near a level, in 2^-16 voxel."""
        (a, b, c), (p, q, r) = self.weights, self.heights
        # Products may wrap, the sum is small: exact.
        total = a[rows] * (p[rows] - level)
        total += b[rows] * (q[rows] - level)
        total += c[rows] * (r[rows] - level)
        return np.asarray(np.sign(total))


@dataclass(frozen=True, slots=True, eq=False)
class TriangleBlock:
    """Some triangles of a mesh, with the mid-lines that their bounding boxes meet.

    Attributes
    ----------
    begin : int
        Number of the first triangle.
    corners : (3, 3, n) int32 array
        Coordinates by axis, corner and triangle.
    first, last : (3, n) int32 array
        First and last mid-plane of each axis that a triangle can meet, inside the box.
    """

    begin: int
    corners: NDArray[np.int32]
    first: NDArray[np.int32]
    last: NDArray[np.int32]


def triangle_blocks(mesh: SnappedMesh) -> Iterator[TriangleBlock]:
    """Yield the triangles of a mesh in blocks that fit into a processor's cache."""
    for begin, faces in mesh.blocks():
        corners = mesh.points.take(faces, axis=1)
        low, high = corners.min(axis=1), corners.max(axis=1)
        low += UNIT - 1 - HALF
        high -= HALF
        low >>= SHIFT
        high >>= SHIFT
        np.maximum(low, 0, out=low)
        for axis, side in enumerate(mesh.sides):
            np.minimum(high[axis], side - 1, out=high[axis])
        yield TriangleBlock(begin, corners, low, high)


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
    along_u, along_v = (axis + 1) % 3, (axis + 2) % 3
    first_i, last_i = block.first[along_u], block.last[along_u]
    first_j, last_j = block.first[along_v], block.last[along_v]
    kept = np.flatnonzero((first_i <= last_i) & (first_j <= last_j))
    if not kept.size:
        return
    u = _relative(block.corners[along_u], kept)
    v = _relative(block.corners[along_v], kept)
    area = (u[1] - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (v[1] - v[0])
    if not area.all():  # triangles seen edge-on
        wide = np.flatnonzero(area)
        kept, area, u, v = kept[wide], area[wide], u[:, wide], v[:, wide]
    w = block.corners[axis].take(kept, axis=1).astype(np.int64)
    turned = area < 0
    swap = np.flatnonzero(turned)
    for each in (u, v, w):  # counter-clockwise
        each[1, swap], each[2, swap] = each[2, swap], each[1, swap]
    np.abs(area, out=area)
    inner, j, first, count = _row_ranges(
        u, v, first_i[kept], last_i[kept], first_j[kept], last_j[kept]
    )
    bias = _bias(u, v) if half_open else None
    for start, stop in _spans(count):
        repeats = Repeats(count[start:stop])
        triangle, row = repeats.of(inner[start:stop]), repeats.of(j[start:stop])
        i = repeats.ranges(first[start:stop])
        x, y = i << SHIFT, row << SHIFT
        (x0, x1, x2), (y0, y1, y2) = (
            [each[k].take(triangle) - at for k in range(3)] for each, at in ((u, x), (v, y))
        )
        whole = area.take(triangle)
        a, b = x1 * y2 - x2 * y1, x2 * y0 - x0 * y2
        c = whole - a - b
        if bias is None:
            inside = (a | b | c) >= 0
        else:
            p, q, r = (bias[k].take(triangle) for k in range(3))
            inside = ((a - p) | (b - q) | (c - r)) >= 0
        if not inside.all():
            hit = np.flatnonzero(inside)
            triangle, row, i, whole = triangle[hit], row[hit], i[hit], whole[hit]
            a, b, c = a[hit], b[hit], c[hit]
        yield Crossings(
            axis,
            i,
            row,
            kept.take(triangle) + block.begin,
            (a, b, c),
            (w[0].take(triangle), w[1].take(triangle), w[2].take(triangle)),
            whole,
            turned.take(triangle),
        )


def _relative(coordinates: NDArray[np.int32], kept: Ints) -> Ints:
    """Return coordinates of some triangles, (3, n) int64, from the first voxel's centre."""
    return coordinates.take(kept, axis=1).astype(np.int64) - HALF


def _row_ranges(
    u: Ints,
    v: Ints,
    first_i: NDArray[np.int32],
    last_i: NDArray[np.int32],
    first_j: NDArray[np.int32],
    last_j: NDArray[np.int32],
) -> tuple[Ints, Ints, Ints, Ints]:
    """Return triangle, j, first i and count of i for each row of mid-lines that may be met."""
    rows = (last_j - first_j + np.int32(1)).astype(np.int64)
    repeats = Repeats(rows)
    inner, j = repeats.of(np.arange(len(rows))), repeats.ranges(first_j.astype(np.int64))
    width = last_i - first_i
    wide = np.flatnonzero(width > _NARROW)
    if not len(wide):
        return (
            inner,
            j,
            first_i.take(inner).astype(np.int64),
            width.take(inner).astype(np.int64) + 1,
        )
    low, high = first_i.take(inner).astype(np.int64), last_i.take(inner).astype(np.int64)
    if len(wide) == len(rows):
        low, high = _between_edges(u, v, inner, j, low, high)
    else:
        number = np.full(len(rows), -1)
        number[wide] = np.arange(len(wide))
        refined = np.flatnonzero(number.take(inner) >= 0)
        low[refined], high[refined] = _between_edges(
            u[:, wide], v[:, wide], number.take(inner.take(refined)),
            j[refined], low[refined], high[refined],
        )  # fmt: skip
    high -= low - 1
    met = np.flatnonzero(high > 0)
    if len(met) == len(high):
        return inner, j, low, high
    return inner[met], j[met], low[met], high[met]


def _between_edges(
    u: Ints, v: Ints, inner: Ints, j: Ints, first: Ints, last: Ints
) -> tuple[Ints, Ints]:
    """Return the first and the last i of rows of triangles, not beyond those given.

    In each row a triangle lies between its long edge, from the lowest corner to the highest, and
    one of the short ones.
    """
    packed = (v << 32) + (u + (1 << 31))  # ordered as v, then u
    a, b = np.minimum(packed[0], packed[1]), np.maximum(packed[0], packed[1])
    lowest, middle = np.minimum(a, packed[2]), np.minimum(b, np.maximum(a, packed[2]))
    corners = np.stack((lowest, middle, np.maximum(b, packed[2])))
    y: Floats = np.multiply(corners >> 32, 1 / UNIT)
    x: Floats = np.multiply((corners & 0xFFFFFFFF) - (1 << 31), 1 / UNIT)
    long = _slope(x, y, 0, 2)
    short = np.concatenate((_slope(x, y, 0, 1), _slope(x, y, 1, 2)))
    height = j.astype(np.float64)
    one = (height - y[0].take(inner)) * long.take(inner) + x[0].take(inner)
    # Both short edges in one array: the upper ones follow the lower ones.
    which = inner + u.shape[1] * (height >= y[1].take(inner))
    two = (height - y[:2].reshape(-1).take(which)) * short.take(which)
    two += x[:2].reshape(-1).take(which)
    low = np.maximum(np.ceil(np.minimum(one, two) - SLACK), first)
    high = np.minimum(np.floor(np.maximum(one, two) + SLACK), last)
    return low.astype(np.int64), high.astype(np.int64)


def _slope(x: Floats, y: Floats, start: int, end: int) -> Floats:
    """Return the slopes of edges, 0 for horizontal ones."""
    rise = y[end] - y[start]
    return np.asarray((x[end] - x[start]) / np.where(rise == 0, np.inf, rise))


def _bias(u: Ints, v: Ints) -> Ints:
    """Return 0 for edges that belong to their triangle, 1 for others: (3, n), by top-left rule."""
    du, dv = u[[2, 0, 1]] - u[[1, 2, 0]], v[[2, 0, 1]] - v[[1, 2, 0]]
    owned = (dv < 0) | ((dv == 0) & (du > 0))
    return np.asarray(1 - owned.astype(np.int64))


def _spans(count: Ints) -> Iterator[tuple[int, int]]:
    """Yield ranges of rows with not many more crossings than `CROSSINGS_PER_BLOCK` together."""
    end = np.cumsum(count)
    start = 0
    while start < len(count):
        before = int(end[start - 1]) if start else 0
        stop = int(np.searchsorted(end, before + CROSSINGS_PER_BLOCK, side="right"))
        stop = max(stop, start + 1)
        yield start, stop
        start = stop

"""Triangles projected along an axis, and the mid-lines of that axis that meet them.

Decided by edge functions (Pineda 1988) in int64: they are linear in the columns i and j, so that a
step to the next mid-line is an addition. Products may wrap around, the values are within 2^62:
exact. Must not know depths.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.compute.array_types import Bools, Floats, Ints
from voxdisplay.voxelization.surfaces.snapped_mesh import HALF, SHIFT, UNIT

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from voxdisplay.voxelization.surfaces.triangle_blocks import TriangleBlock

CANDIDATES_PER_BLOCK = 1 << 15
# Bounds of columns are found in floating point, with errors below 2^-30 voxel, and widened by this;
# edge functions decide.
SLACK = 1e-6
# Rows of bounding boxes that are wider are narrowed down to the triangle first.
_NARROW = 4


@dataclass(frozen=True, slots=True, eq=False)
class ProjectedTriangles:
    """Triangles whose bounding boxes meet mid-lines, with their edge functions.

    Attributes
    ----------
    triangle : (n,) int64 array
        Numbers in their block.
    i, j : (n,) int64 array
        First column along u and v that the bounding box meets.
    u, v : (3, n) int64 array
        Corners, in 2^-16 voxel from the mid-line at i, j.
    turned : (n,) bool array
        Whether the normal points against the axis.
    value, step, rise : (3, n) int64 array
        Edge functions opposite the corners at the mid-line i, j, and their differences to the next
        one along u and along v. Not negative inside.
    bias : (3, n) int64 array or None
        What has been subtracted from them so that a mid-line through an edge or a corner meets one
        triangle.

    """

    triangle: Ints
    i: Ints
    j: Ints
    u: Ints
    v: Ints
    turned: Bools
    value: Ints
    step: Ints
    rise: Ints
    bias: Ints | None


@dataclass(frozen=True, slots=True, eq=False)
class Hits:
    """Mid-lines that meet triangles.

    Attributes
    ----------
    triangle : (n,) int64 array
        Numbers in their block.
    i, j : (n,) int64 array
    a, b, c : (n,) int64 array
        Edge functions opposite the corners.
    turned : (n,) bool array

    """

    triangle: Ints
    i: Ints
    j: Ints
    a: Ints
    b: Ints
    c: Ints
    turned: Bools

    @classmethod
    def joined(cls, parts: Sequence[Hits]) -> Hits:
        """Return several as one."""
        if len(parts) == 1:
            return parts[0]
        return cls(
            *(np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(cls))
        )


def project(block: TriangleBlock, axis: int, rows: Ints, half_open: bool) -> ProjectedTriangles:
    """Return triangles projected along an axis, without those seen edge-on.

    Parameters
    ----------
    block : TriangleBlock
    axis : {0, 1, 2}
    rows : (n,) int64 array
        Numbers of the triangles in their block.
    half_open : bool
        See `midline_crossings.midline_crossings`.

    """
    i, u = _relative(block, (axis + 1) % 3, rows)
    j, v = _relative(block, (axis + 2) % 3, rows)
    value = u[1:4] * v[2:]
    value -= u[2:] * v[1:4]
    area = value[0] + value[1]
    area += value[2]
    if not area.all():
        return project(block, axis, rows[area != 0], half_open)
    step, rise = v[1:4] - v[2:], u[2:] - u[1:4]
    turned = area < 0
    sign = 1 - 2 * turned.view(np.int8).astype(np.int64)
    value *= sign
    step *= sign
    rise *= sign
    bias: Ints | None = None
    if half_open:
        # Top-left rule: a mid-line through an edge belongs to the triangle above, or to its right.
        bias = 1 - ((step > 0) | ((step == 0) & (rise > 0))).view(np.int8).astype(np.int64)
        value -= bias
    step <<= SHIFT
    rise <<= SHIFT
    return ProjectedTriangles(rows, i, j, u[:3], v[:3], turned, value, step, rise, bias)


def _relative(block: TriangleBlock, along: int, rows: Ints) -> tuple[Ints, Ints]:
    """Return first columns, (n,), and from there the corners 0, 1, 2, 0, 1, (5, n), on an axis."""
    first = block.first[along].take(rows).astype(np.int64)
    corners = np.empty((5, len(rows)), dtype=np.int64)
    np.subtract(block.corners[along].take(rows, axis=1), (first << SHIFT) + HALF, out=corners[:3])
    corners[3:] = corners[:2]
    return first, corners


def hits_of_alike(triangles: ProjectedTriangles, columns: int, rows: int) -> Hits:
    """Return the mid-lines that meet triangles whose bounding boxes meet equally many.

    Parameters
    ----------
    triangles : ProjectedTriangles
    columns, rows : int
        Numbers of mid-lines along u and v.

    """
    up: Ints | int = 0
    across: Ints | int = 0
    if columns == rows == 1:
        values = triangles.value
        place = source = _inside(values)
    else:
        size = len(triangles.i)
        upward = np.arange(rows)[None, :, None] * triangles.rise[:, None]
        upward += triangles.value[:, None]
        onward = np.arange(columns)[None, :, None] * triangles.step[:, None]
        values = (upward[:, :, None] + onward[:, None]).reshape(3, -1)
        place = _inside(values)
        cell, source = np.divmod(place, size)
        up, across = np.divmod(cell, columns)
    i, j = triangles.i.take(source) + across, triangles.j.take(source) + up
    return _hits(triangles, source, i, j, values.take(place, axis=1))


def _inside(values: Ints) -> Ints:
    """Return where no edge function, (3, n), is negative."""
    a, b, c = values
    return np.flatnonzero((a | b | c) >= 0)


def _hits(triangles: ProjectedTriangles, source: Ints, i: Ints, j: Ints, values: Ints) -> Hits:
    if triangles.bias is not None:
        values += triangles.bias.take(source, axis=1)
    a, b, c = values
    triangle, turned = triangles.triangle.take(source), triangles.turned.take(source)
    return Hits(triangle, i, j, a, b, c, turned)


def hits_in_rows(
    triangles: ProjectedTriangles, columns: NDArray[np.int32], rows: NDArray[np.int32]
) -> Iterator[Hits]:
    """Yield the mid-lines that meet triangles, row by row, in blocks.

    Parameters
    ----------
    triangles : ProjectedTriangles
    columns, rows : (N,) int32 array
        Numbers of mid-lines along u and v that the bounding boxes of a block's triangles meet.

    """
    height = rows.take(triangles.triangle).astype(np.int64)
    which = np.arange(len(height)).repeat(height)
    up = _ranks(height, which)
    first, count = (
        np.zeros(len(which), dtype=np.int64),
        columns.take(triangles.triangle.take(which)).astype(np.int64),
    )
    wide = np.flatnonzero(count > _NARROW)
    if wide.size:
        low, high = _between_edges(triangles, which[wide], up[wide], count[wide] - 1)
        first[wide], count[wide] = low, np.maximum(high - low + 1, 0)
    start_of = triangles.value.take(which, axis=1)
    start_of += triangles.rise.take(which, axis=1) * up
    start_of += triangles.step.take(which, axis=1) * first
    end = np.cumsum(count)
    start = 0
    while start < len(count):
        before = int(end[start - 1]) if start else 0
        stop = int(np.searchsorted(end, before + CANDIDATES_PER_BLOCK, side="right"))
        stop = max(stop, start + 1)
        source = np.arange(start, stop).repeat(count[start:stop])
        across = np.arange(before, before + len(source)) - (end - count).take(source)
        inner = which.take(source)
        values = triangles.step.take(inner, axis=1)
        values *= across
        values += start_of.take(source, axis=1)
        hit = _inside(values)
        source, inner = source.take(hit), inner.take(hit)
        i = triangles.i.take(inner) + first.take(source) + across.take(hit)
        j = triangles.j.take(inner) + up.take(source)
        yield _hits(triangles, inner, i, j, values.take(hit, axis=1))
        start = stop


def _ranks(count: Ints, which: Ints) -> Ints:
    """Return 0, 1, ... for each of groups that have ``count`` entries, in which they are."""
    return np.arange(len(which)) - (count.cumsum() - count).take(which)


def _between_edges(
    triangles: ProjectedTriangles, which: Ints, up: Ints, last: Ints
) -> tuple[Ints, Ints]:
    """Return the first and the last column of rows of triangles, from 0 to those given.

    In each row a triangle lies between its long edge, from the lowest corner to the highest, and
    one of the short ones.

    Parameters
    ----------
    triangles : ProjectedTriangles
    which, up : (n,) int64 array
        The triangle of each row, and how far above its first row it is.
    last : (n,) int64 array

    """
    rows = which[np.append(True, which[1:] != which[:-1])]  # each triangle once
    inner = np.cumsum(np.append(0, which[1:] != which[:-1]))
    u, v = triangles.u[:, rows], triangles.v[:, rows]
    packed = (v << 32) + (u + (1 << 31))  # ordered as v, then u
    a, b = np.minimum(packed[0], packed[1]), np.maximum(packed[0], packed[1])
    lowest, middle = np.minimum(a, packed[2]), np.minimum(b, np.maximum(a, packed[2]))
    corners = np.stack((lowest, middle, np.maximum(b, packed[2])))
    y: Floats = np.multiply(corners >> 32, 1 / UNIT)
    x: Floats = np.multiply((corners & 0xFFFFFFFF) - (1 << 31), 1 / UNIT)
    long = _slope(x, y, 0, 2)
    short = np.concatenate((_slope(x, y, 0, 1), _slope(x, y, 1, 2)))
    height = up.astype(np.float64)
    one = (height - y[0].take(inner)) * long.take(inner) + x[0].take(inner)
    # Both short edges in one array: the upper ones follow the lower ones.
    half = inner + len(rows) * (height >= y[1].take(inner))
    two = (height - y[:2].reshape(-1).take(half)) * short.take(half)
    two += x[:2].reshape(-1).take(half)
    low = np.maximum(np.ceil(np.minimum(one, two) - SLACK), 0)
    high = np.minimum(np.floor(np.maximum(one, two) + SLACK), last)
    return low.astype(np.int64), high.astype(np.int64)


def _slope(x: Floats, y: Floats, start: int, end: int) -> Floats:
    """Return the slopes of edges, 0 for horizontal ones."""
    rise = y[end] - y[start]
    return np.asarray((x[end] - x[start]) / np.where(rise == 0, np.inf, rise))

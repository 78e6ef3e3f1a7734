"""Exact crossings of triangles with the mid-lines of one axis.

A mid-line is parallel to an axis w and passes through voxel centres; along the axes u and v that
follow w cyclically it has the column numbers i and j. Whether a mid-line meets a triangle is
decided by edge functions (Pineda 1988) in int64. Must not know which voxel a crossing lights.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from voxdisplay.compute.array_types import Bools, Floats, Ints
from voxdisplay.voxelization.index_ranges import expand_ranges
from voxdisplay.voxelization.surfaces.snapped_mesh import HALF, SHIFT, UNIT, SnappedMesh

TRIANGLES_PER_BLOCK = 1 << 16
CROSSINGS_PER_BLOCK = 1 << 20
# Bounds of columns are found in floating point, with errors below 2^-37 voxel; the edge functions
# decide.
SLACK = 1e-6
# Depths are exact to 1e-11 voxel; closer than this to a whole number, integers decide.
NEAR_FACE = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Crossings:
    """Crossings of triangles with mid-lines.

    Attributes
    ----------
    i, j : (n,) int64 array
        Columns along u and v.
    triangle : (n,) int64 array
        Indices of the triangles.
    weights : three (n,) int64 arrays
        Edge functions opposite the corners, 0 or more: barycentric coordinates times `area`.
    corners : three (n,) int64 arrays
        The corners' coordinates along w, in units of 2^-16 voxel.
    area : (n,) int64 array
        Twice the projected area, positive.
    upward : (n,) bool array
        Whether the triangle's normal points along w.

    """

    i: Ints
    j: Ints
    triangle: Ints
    weights: tuple[Ints, Ints, Ints]
    corners: tuple[Ints, Ints, Ints]
    area: Ints
    upward: Bools

    def depth(self) -> Floats:
        """Return the coordinates of the crossings along w, (n,), in voxels."""
        (a, b, c), (p, q, r) = self.weights, self.corners
        # All weights are of one sign: the error is below 1e-11 voxel however thin the triangle.
        depth = np.multiply(a, p, dtype=np.float64)
        depth += np.multiply(b, q, dtype=np.float64)
        depth += np.multiply(c, r, dtype=np.float64)
        depth /= self.area
        depth *= 1 / UNIT
        return depth

    def side_of(self, level: Ints, rows: Ints) -> Ints:
        """Return the exact sign of depth - level for some crossings near a level, 2^-16 voxel."""
        (a, b, c), (p, q, r) = self.weights, self.corners
        z = level
        # Products may wrap, the sum is small: exact.
        total = a[rows] * (p[rows] - z) + b[rows] * (q[rows] - z) + c[rows] * (r[rows] - z)
        return np.asarray(np.sign(total))


def midline_crossings(
    mesh: SnappedMesh, axis: int, sides: tuple[int, int, int], *, half_open: bool = False
) -> Iterator[Crossings]:
    """Yield the crossings of a mesh with the mid-lines of one axis, in blocks.

    Parameters
    ----------
    mesh : SnappedMesh
    axis : {0, 1, 2}
        The axis w.
    sides : (int, int, int)
        Numbers of voxels of the box along x, y and z; mid-lines outside are left out.
    half_open : bool
        Each mid-line through an edge or a corner meets one of the triangles around it (top-left
        rule) instead of all.

    """
    for begin in range(0, mesh.faces.shape[1], TRIANGLES_PER_BLOCK):
        yield from _block(mesh, axis, sides, half_open, begin)


def _block(
    mesh: SnappedMesh, axis: int, sides: tuple[int, int, int], half_open: bool, begin: int
) -> Iterator[Crossings]:
    faces = mesh.faces[:, begin : begin + TRIANGLES_PER_BLOCK]
    along_u, along_v = (axis + 1) % 3, (axis + 2) % 3
    u, v = mesh.points[along_u].take(faces) - HALF, mesh.points[along_v].take(faces) - HALF
    first_j, last_j = _columns(v, sides[along_v])
    first_i, last_i = _columns(u, sides[along_u])
    kept = np.flatnonzero((first_j <= last_j) & (first_i <= last_i))
    u, v = u.take(kept, axis=1), v.take(kept, axis=1)
    area = (u[1] - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (v[1] - v[0])
    if not area.all():  # triangles seen edge-on
        solid = np.flatnonzero(area)
        kept, area, u, v = kept[solid], area[solid], u[:, solid], v[:, solid]
    w = mesh.points[axis].take(faces.take(kept, axis=1))
    upward = area > 0
    for each in (u, v, w):  # counter-clockwise
        each[1], each[2] = np.where(upward, each[1], each[2]), np.where(upward, each[2], each[1])
    area = np.abs(area)
    first_j, last_j = first_j[kept], last_j[kept]
    first_i, last_i = first_i[kept], last_i[kept]
    count = last_j - first_j + 1
    row = np.repeat(np.arange(len(kept)), count)
    j = expand_ranges(first_j, count)
    # Edge k is opposite corner k. Its function at (x, y) is du * y - dv * x + constant.
    du, dv, constant = np.empty_like(u), np.empty_like(u), np.empty_like(u)
    for k in range(3):
        p, q = (k + 1) % 3, (k + 2) % 3
        du[k], dv[k] = u[q] - u[p], v[q] - v[p]
        constant[k] = dv[k] * u[p] - du[k] * v[p]
    low, high = first_i[row].astype(np.float64), last_i[row].astype(np.float64)
    at_row = np.empty((3, len(row)), dtype=np.int64)
    for k in range(3):
        at_row[k] = du[k].take(row) * (j << SHIFT) + constant[k].take(row)
        slope = dv[k].take(row)
        with np.errstate(divide="ignore", invalid="ignore"):
            edge = at_row[k] / (slope * float(UNIT))
        np.minimum(high, np.floor(edge + SLACK), out=high, where=slope > 0)
        np.maximum(low, np.ceil(edge - SLACK), out=low, where=slope < 0)
    count = np.maximum(high - low + 1, 0).astype(np.int64)
    first = low.astype(np.int64)
    biased = _bias(du, dv) if half_open else None
    for start, stop in _spans(count):
        number = count[start:stop]
        source = np.repeat(np.arange(start, stop), number)
        i = expand_ranges(first[start:stop], number)
        inner = row[source]
        x = i << SHIFT
        e = [at_row[k].take(source) - dv[k].take(inner) * x for k in range(3)]
        if biased is None:
            inside = (e[0] | e[1] | e[2]) >= 0
        else:
            inside = (
                (e[0] - biased[0].take(inner))
                | (e[1] - biased[1].take(inner))
                | (e[2] - biased[2].take(inner))
            ) >= 0
        if not inside.all():
            hit = np.flatnonzero(inside)
            source, i, inner = source[hit], i[hit], inner[hit]
            e = [each[hit] for each in e]
        yield Crossings(
            i,
            j[source],
            kept[inner] + begin,
            (e[0], e[1], e[2]),
            (w[0].take(inner), w[1].take(inner), w[2].take(inner)),
            area.take(inner),
            upward.take(inner),
        )


def _columns(coordinate: Ints, side: int) -> tuple[Ints, Ints]:
    """Return the first and the last mid-line that each triangle, (3, n), can meet."""
    a, b, c = coordinate
    low = (np.minimum(np.minimum(a, b), c) + (UNIT - 1)) >> SHIFT
    high = np.maximum(np.maximum(a, b), c) >> SHIFT
    return np.maximum(low, 0, out=low), np.minimum(high, side - 1, out=high)


def _bias(du: Ints, dv: Ints) -> Ints:
    """Return 0 for edges that belong to their triangle, 1 for others: (3, n)."""
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

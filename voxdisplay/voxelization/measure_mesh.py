"""Independent measurement of voxel sets against triangle meshes: distances, cover, tunnels.

Distances are those of points from triangles in floating point. This module shares no code with the
voxelisers that it judges, and must not know how voxels are chosen.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Bools, Floats, Ints
from voxdisplay.voxelization.index_ranges import expand_ranges
from voxdisplay.voxelization.smallest_cover import MAX_LINES, smallest_cover

REACH = 1.5
"""Distances up to this many voxels are found; larger ones are given as infinite."""
# Triangles are cut until their bounding boxes are this long, in voxels.
_PIECE = 4.0
_PAIRS_PER_BLOCK = 1 << 20
_SPACING = 0.25
_LATTICE = 1 << 16


class VoxelLookup:
    """Rows of voxels by their coordinates.

    Parameters
    ----------
    voxels : (N, 3) integer array
        Distinct.

    """

    def __init__(self, voxels: NDArray[np.integer]) -> None:
        self._low = voxels.min(axis=0).astype(np.int64)
        self._sides = voxels.max(axis=0) - self._low + 1
        key = self._key(voxels.astype(np.int64))
        self._order = np.argsort(key)
        self._sorted = key[self._order]

    def _key(self, voxels: Ints) -> Ints:
        x, y, z = (voxels - self._low).T
        return np.asarray(x + self._sides[0] * (y + self._sides[1] * z))

    def rows(self, voxels: Ints) -> Ints:
        """Return the rows of voxels, (n, 3), -1 for those that are not there."""
        offset = voxels - self._low
        known = ((offset >= 0) & (offset < self._sides)).all(axis=1)
        key = np.where(known, self._key(voxels), -1)
        at = np.searchsorted(self._sorted, key).clip(0, len(self._sorted) - 1)
        return np.where(self._sorted[at] == key, self._order[at], -1)


def mesh_distances(voxels: NDArray[np.integer], vertices: Floats, faces: Ints) -> Floats:
    """Return the distances of voxel centres from a mesh, infinite beyond `REACH`.

    Parameters
    ----------
    voxels : (N, 3) integer array
        Distinct; N >= 1.
    vertices : (V, 3) float64 array
    faces : (F, 3) int64 array

    Returns
    -------
    (N,) float64 array

    """
    lookup = VoxelLookup(voxels)
    nearest = np.full(len(voxels), np.inf)
    for triangles in _pieces(vertices, faces):
        low = np.ceil(triangles.min(axis=1) - REACH - 0.5).astype(np.int64)
        high = np.floor(triangles.max(axis=1) + REACH - 0.5).astype(np.int64)
        for which, cell in _boxes(low, high):
            row = lookup.rows(cell)
            found = np.flatnonzero(row >= 0)
            centers: Floats = np.add(cell[found], 0.5)
            apart = _squared_distances(centers, triangles[which[found]])
            np.minimum.at(nearest, row[found], apart)
    nearest[nearest > REACH**2] = np.inf
    return np.asarray(np.sqrt(nearest))


def mesh_cover(voxels: NDArray[np.integer], vertices: Floats, faces: Ints) -> float:
    """Return the greatest distance, in max norm, of points of a mesh from a lit voxel's centre.

    The points are a quarter of a voxel apart. Infinite beyond 1.5.
    """
    lookup = VoxelLookup(voxels)
    worst = 0.0
    steps = np.array(list(np.ndindex(3, 3, 3))) - 1
    for triangles in _pieces(vertices, faces):
        size = np.ptp(triangles, axis=1).max()
        count = max(1, int(np.ceil(size / _SPACING)))
        i, j = np.indices((count + 1, count + 1)).reshape(2, -1) / count
        weights = np.stack((i, j, 1 - i - j))[:, i + j <= 1 + 1e-9]
        points = np.einsum("tcx,cp->tpx", triangles, weights).reshape(-1, 3)
        cell = np.floor(points).astype(np.int64)
        nearest = np.abs(cell + 0.5 - points).max(axis=1)
        rest = np.flatnonzero(lookup.rows(cell) < 0)
        nearest[rest] = np.inf
        for step in steps:
            lit = rest[lookup.rows(cell[rest] + step) >= 0]
            apart = np.abs(cell[lit] + step + 0.5 - points[lit]).max(axis=1)
            nearest[lit] = np.minimum(nearest[lit], apart)
        worst = max(worst, float(nearest.max()))
    return worst


def mesh_tunnels(
    voxels: NDArray[np.integer],
    vertices: Floats,
    faces: Ints,
    box: tuple[tuple[int, int, int], tuple[int, int, int]],
) -> int:
    """Return how many lines between the centres of two dark neighbours cross a mesh.

    Parameters
    ----------
    voxels : (N, 3) integer array
    vertices, faces
        As of `mesh_distances`.
    box : (low, high)
        Box of voxels inside of which both ends have to be.

    """
    lookup = VoxelLookup(voxels)
    begin, end = crossed_lines(vertices, faces, box)
    return int(((lookup.rows(begin) < 0) & (lookup.rows(end) < 0)).sum())


def mesh_minimum(
    vertices: Floats, faces: Ints, box: tuple[tuple[int, int, int], tuple[int, int, int]]
) -> int | None:
    """Return the size of the smallest set of voxels of a box without tunnels through a mesh.

    None if the mesh is too large for that: see `smallest_cover`.
    """
    begin, end = crossed_lines(vertices, faces, box)
    if len(begin) > MAX_LINES:
        return None
    low, sides = np.array(box[0]), np.subtract(box[1], box[0])
    numbers = [
        (each - low) @ np.array((1, sides[0], sides[0] * sides[1]), dtype=np.int64)
        for each in (begin, end)
    ]
    is_odd = (begin - low).sum(axis=1) & 1 == 1
    return smallest_cover(np.where(is_odd, *numbers[::-1]), np.where(is_odd, *numbers))


def crossed_lines(
    vertices: Floats, faces: Ints, box: tuple[tuple[int, int, int], tuple[int, int, int]]
) -> tuple[Ints, Ints]:
    """Return the lines between the centres of 6-neighbours of a box that cross a mesh.

    Returns
    -------
    begin, end : (n, 3) int64 array
        The voxels at the ends, distinct pairs.

    """
    low, high = np.array(box[0]), np.array(box[1])
    sides = high - low
    # As the mesh is drawn; then areas are exact up to coordinates of 1024.
    points = np.rint((vertices - low) * _LATTICE) / _LATTICE
    lines = []
    for axis in range(3):
        found = [
            cells
            for triangles in _pieces(points, faces, cut=False)
            for cells in _crossed_edges(triangles, axis, sides)
        ]
        cells = np.concatenate([np.empty((0, 3), dtype=np.int64), *found])
        step = (np.arange(3) == axis).astype(np.int64)
        inside = (cells >= 0).all(axis=1) & (cells + step < sides).all(axis=1)
        cells = np.unique(cells[inside], axis=0) + low
        lines.append((cells, cells + step))
    begin, end = (np.concatenate(ends) for ends in zip(*lines, strict=True))
    return begin, end


def _crossed_edges(triangles: Floats, axis: int, sides: Ints) -> Iterator[Ints]:
    """Yield the lower ends, (n, 3), of lines between centres that triangles cross."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    first = np.ceil(triangles.min(axis=1) - 0.5).astype(np.int64)
    last = np.floor(triangles.max(axis=1) - 0.5).astype(np.int64)
    first, last = np.maximum(first, 0), np.minimum(last, sides - 1)
    first[:, axis] = last[:, axis] = 0
    for which, cell in _boxes(first, last):
        p, q = cell[:, u] + 0.5, cell[:, v] + 0.5
        corners = triangles[which]
        weights = []
        for k in range(3):
            a, b = corners[:, (k + 1) % 3], corners[:, (k + 2) % 3]
            weights.append(
                (b[:, u] - a[:, u]) * (q - a[:, v]) - (b[:, v] - a[:, v]) * (p - a[:, u])
            )
        area = weights[0] + weights[1] + weights[2]
        hit = (area != 0) & np.logical_and.reduce([w * np.sign(area) >= 0 for w in weights])
        height = sum(w[hit] * corners[hit, k, axis] for k, w in enumerate(weights)) / area[hit]
        cells = cell[hit]
        cells[:, axis] = np.floor(height - 0.5)
        # On a centre, both lines that end there are crossed; one of them is enough.
        yield cells


def _pieces(vertices: Floats, faces: Ints, *, cut: bool = True) -> Iterator[Floats]:
    """Yield triangles, (n, 3, 3) by corner and axis, cut into small ones."""
    block = 1 << 12
    for start in range(0, len(faces), block):
        triangles = vertices[faces[start : start + block]]
        while cut and len(triangles):
            large = np.ptp(triangles, axis=1).max(axis=1) > _PIECE
            if not large.any():
                break
            a, b, c = (triangles[large][:, k] for k in range(3))
            p, q, r = (a + b) / 2, (b + c) / 2, (c + a) / 2
            parts = [(a, p, r), (p, b, q), (r, q, c), (p, q, r)]
            if not large.all():
                yield triangles[~large]
            triangles = np.concatenate([np.stack(part, axis=1) for part in parts])
        if len(triangles):
            yield triangles


def _boxes(low: Ints, high: Ints) -> Iterator[tuple[Ints, Ints]]:
    """Yield numbers of boxes and their voxels, (n, 3), in blocks."""
    sides = np.maximum(high - low + 1, 0)
    count = sides.prod(axis=1)
    end = np.cumsum(count)
    start = 0
    while start < len(count):
        before = end[start - 1] if start else 0
        stop = max(int(np.searchsorted(end, before + _PAIRS_PER_BLOCK, side="right")), start + 1)
        number = count[start:stop]
        which = np.repeat(np.arange(start, stop), number)
        rank = expand_ranges(np.zeros(len(number), dtype=np.int64), number)
        nx, ny, _ = sides[which].T
        z = rank // (nx * ny)
        y = rank // nx - z * ny
        yield which, low[which] + np.stack((rank % nx, y, z), axis=1)
        start = stop


def _squared_distances(points: Floats, triangles: Floats) -> Floats:
    """Return squared distances of points, (n, 3), from a triangle each, (n, 3, 3)."""
    a, b, c = (triangles[:, k] for k in range(3))
    best = np.minimum(_from_segment(points, a, b), _from_segment(points, b, c))
    best = np.minimum(best, _from_segment(points, c, a))
    along, other = b - a, c - a
    normal = np.cross(along, other)
    size = (normal**2).sum(axis=1)
    inside: Bools = size > 0
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= (np.cross(end - start, points - start) * normal).sum(axis=1) >= 0
    height = ((points - a) * normal).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(inside, height**2 / size, best))


def _from_segment(points: Floats, start: Floats, end: Floats) -> Floats:
    """Return squared distances of points from segments, which may have no length."""
    along, to = end - start, points - start
    length = (along**2).sum(axis=1)
    share = np.clip((to * along).sum(axis=1) / np.where(length > 0, length, 1), 0, 1)
    return np.asarray(((to - share[:, None] * along) ** 2).sum(axis=1))

"""Kernel of `silhouettes.silhouette_triangles`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Ints
from voxdisplay.compute.kernel_backend import jit
from voxdisplay.voxelization.surfaces.silhouettes import vertex_entries
from voxdisplay.voxelization.surfaces.snapped_mesh import SnappedMesh

Bytes = NDArray[np.uint8]


def silhouette_triangles(mesh: SnappedMesh) -> Ints:
    """See `silhouettes.silhouette_triangles`."""
    entry, size = vertex_entries(mesh)
    known, turns = np.zeros(size, dtype=np.uint8), np.zeros(size, dtype=np.uint8)
    faces = np.ascontiguousarray(mesh.faces)
    codes, found = np.empty(len(faces), dtype=np.uint8), np.empty(len(faces), dtype=np.int64)
    count = _silhouettes(mesh.points, faces, entry, known, turns, codes, found)
    return found[:count].copy()


@jit
def _silhouettes(
    points: NDArray[np.int32],
    faces: Ints,
    entry: Ints,
    known: Bytes,
    turns: Bytes,
    codes: Bytes,
    found: Ints,
) -> int:
    """Write the triangles that have an edge at which a section may turn; return how many."""
    for t in range(len(faces)):
        p, q, r = faces[t, 0], faces[t, 1], faces[t, 2]
        x, y, z = np.int64(points[0, p]), np.int64(points[1, p]), np.int64(points[2, p])
        x1, y1, z1 = points[0, q] - x, points[1, q] - y, points[2, q] - z
        x2, y2, z2 = points[0, r] - x, points[1, r] - y, points[2, r] - z
        nx, ny, nz = y1 * z2 - z1 * y2, z1 * x2 - x1 * z2, x1 * y2 - y1 * x2
        code = 0
        for axis in range(3):
            a, b = nz, ny
            if axis == 1:
                a, b = nx, nz
            elif axis == 2:
                a, b = ny, nx
            if a == 0:
                a = b
            code |= (int(a > 0) | int(a < 0) << 1) << 2 * axis
        if nx == 0 and ny == 0 and nz == 0:
            code = 63
        codes[t] = code
        known[entry[p]] = known[entry[q]] = known[entry[r]] = code
    for t in range(len(faces)):
        code = codes[t]
        for corner in range(3):
            at = entry[faces[t, corner]]
            different = np.uint8(63) if code == 63 else known[at] ^ code
            if different:
                turns[at] |= (different | different >> 1) & 21
    count = 0
    for t in range(len(faces)):
        p, q, r = entry[faces[t, 0]], entry[faces[t, 1]], entry[faces[t, 2]]
        a, b, c = turns[p], turns[q], turns[r]
        if (a & b) | (b & c) | (c & a):
            found[count] = t
            count += 1
    return count

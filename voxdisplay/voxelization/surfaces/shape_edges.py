"""Edges of the shape: those of its triangles, but not between two that lie in one plane. Exact.

Must not know which voxels are lit.
"""

from __future__ import annotations

import numpy as np

from voxdisplay.compute.array_types import Bools, Floats, Ints
from voxdisplay.voxelization.surfaces.mesh_topology import vertex_hashes, zero_area
from voxdisplay.voxelization.surfaces.snapped_mesh import SnappedMesh

# Triple products in floating point are right to this fraction of the product of magnitudes.
_ERROR = 1e-14


def is_shape_edge(mesh: SnappedMesh, a: Ints, b: Ints) -> Bools:
    """Return which edges belong to triangles, but not to two that continue each other.

    Those lie in one plane, on either side of the edge. Triangles without an area do not count.

    Parameters
    ----------
    mesh : SnappedMesh
    a, b : (n,) int64 array
        Vertices at the ends of the edges.

    """
    one, _ = vertex_hashes(mesh.points)
    wanted = one.take(a) + one.take(b)
    keys = np.sort(wanted)
    keys = keys[np.append(np.ones(len(keys[:1]), dtype=bool), keys[1:] != keys[:-1])]
    count = np.zeros(len(keys), dtype=np.int64)
    opposite = np.zeros((2, len(keys)), dtype=np.int64)  # vertices of up to two triangles
    solid = np.flatnonzero(~zero_area(mesh))
    for corner in range(3):
        start = one.take(mesh.faces[solid, corner])
        end = one.take(mesh.faces[solid, (corner + 1) % 3])
        edge = start + end
        at = np.minimum(np.searchsorted(keys, edge), len(keys) - 1)
        rows = np.flatnonzero((keys.take(at) == edge) & (start != end))
        # One triangle of each edge at a time.
        while len(rows):
            taken = np.full(len(keys), -1)
            taken[at[rows]] = rows
            now = taken[taken >= 0]
            slot = np.minimum(count[at[now]], 1)
            opposite[slot, at[now]] = mesh.faces[solid[now], (corner + 2) % 3]
            count[at[now]] += 1
            rows = np.setdiff1d(rows, now, assume_unique=True)
    at = np.searchsorted(keys, wanted)
    c, d = opposite[:, at]
    flat: Bools = np.equal(count[at], 2)
    rows = np.flatnonzero(flat)
    flat[rows] = _is_flat(mesh, a[rows], b[rows], c[rows], d[rows])
    return np.asarray((count[at] > 0) & ~flat)


def _is_flat(mesh: SnappedMesh, a: Ints, b: Ints, c: Ints, d: Ints) -> Bools:
    """Return whether triangles a b c and b a d lie in one plane, c and d on either side of a b."""
    base = mesh.points.take(a, axis=1).astype(np.float64)
    along, left, right = (mesh.points.take(each, axis=1) - base for each in (b, c, d))
    normal, other = np.cross(along, left, axis=0), np.cross(along, right, axis=0)
    volume = np.abs((normal * right).sum(axis=0))
    magnitude = np.prod([np.abs(each).sum(axis=0) for each in (along, left, right)], axis=0)
    flat = np.asarray(volume <= _ERROR * magnitude)
    flat &= (normal * other).sum(axis=0) < 0
    for row in np.flatnonzero(flat):  # rarely many: in thin parts alone
        flat[row] = _triple_product(along[:, row], left[:, row], right[:, row]) == 0
    return flat


def _triple_product(a: Floats, b: Floats, c: Floats) -> int:
    """Return a . (b x c) of whole numbers, exactly."""
    (p, q, r), (s, t, u), (x, y, z) = (map(int, each.tolist()) for each in (a, b, c))
    return p * (t * z - u * y) + q * (u * x - s * z) + r * (s * y - t * x)

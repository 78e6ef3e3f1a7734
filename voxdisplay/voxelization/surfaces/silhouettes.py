"""Proof that a closed mesh has no part that passes between all mid-lines of its neighbourhood.

A mid-plane cuts a closed, oriented mesh in closed curves. One that leaves a dual face, or touches
its border, meets a dual edge there, an end of which is lit. So a dual face without a lit corner
that the mesh meets holds a whole curve, and with it one of its turns, where it runs neither on nor
back: an edge of the mesh at which the direction of the curve in the plane passes from one half of
the directions to the other. These edges, the silhouettes, are few: where they meet no dual face
without a lit corner, no edge does.

Vertices of the mesh on the mid-plane itself change nothing, as planes an infinitesimal step above
and below are cut in curves likewise. Must not know what is done about thin parts.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.compute.kernel_backend import with_kernel
from voxdisplay.voxelization.surfaces.mesh_topology import vertex_hashes
from voxdisplay.voxelization.surfaces.snapped_mesh import TRIANGLES_PER_BLOCK, SnappedMesh

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from voxdisplay.compute.array_types import Ints

_AFTER = [1, 2, 0]
# For x, y and z two bits each: a triangle whose section runs in one half of directions, the other.
_BOTH = np.uint8(0b111111)
_ONES = np.uint8(0b010101)


@with_kernel
def silhouette_triangles(mesh: SnappedMesh) -> Ints:
    """Return the triangles, (n,) ascending, that have an edge at which a section may turn.

    Edges all of which belong to triangles that run on are left out; others may be among them.
    """
    entry, size = vertex_entries(mesh)
    known = np.zeros(size, dtype=np.uint8)
    codes = []
    for _, corners in mesh.blocks(TRIANGLES_PER_BLOCK):
        codes.append(_halves(mesh.points.take(corners, axis=1).astype(np.int64)))
        for each in corners:
            known[entry.take(each)] = codes[-1]  # of one of the triangles at a vertex
    turns = np.zeros(size, dtype=np.uint8)
    for (_, corners), code in zip(mesh.blocks(TRIANGLES_PER_BLOCK), codes, strict=True):
        flat = code == _BOTH
        for each in corners:
            at = entry.take(each)
            other = known.take(at)
            other ^= code
            other[flat] = _BOTH
            rows = np.flatnonzero(other)
            different = other.take(rows)
            different |= different >> np.uint8(1)
            np.bitwise_or.at(turns, at.take(rows), different & _ONES)
    turns = turns.take(entry)
    found = []
    for begin, corners in mesh.blocks(TRIANGLES_PER_BLOCK):
        at = turns.take(corners)
        at &= at[_AFTER]
        found.append(np.flatnonzero(at[0] | at[1] | at[2]) + begin)
    return np.concatenate(found)


def vertex_entries(mesh: SnappedMesh) -> tuple[Ints, int]:
    """Return the entries, (V,), that vertices have in a table, and its size.

    Vertices at the same place share an entry; so do some others, which does no harm.
    """
    one, _ = vertex_hashes(mesh.points)
    size = 1 << (4 * len(one)).bit_length()
    return (one & np.uint64(size - 1)).astype(np.int64), size


def _halves(corners: Ints) -> NDArray[np.uint8]:
    """Return in which half of directions the sections of triangles run, (n,), two bits by axis.

    Along the section by a plane across w, the direction is (n_v, -n_u) for the normal n. Triangles
    without an area have both bits: they may join any others. Those in the plane have none.
    """
    along, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = along[_AFTER] * other[[2, 0, 1]]
    normal -= along[[2, 0, 1]] * other[_AFTER]
    sign = np.sign(normal).astype(np.int8)
    code = np.zeros(sign.shape[1], dtype=np.uint8)
    for axis in range(3):
        half = 2 * sign[(axis + 2) % 3] + sign[(axis + 1) % 3]
        code |= (half > 0).view(np.uint8) << np.uint8(2 * axis)
        code |= (half < 0).view(np.uint8) << np.uint8(2 * axis + 1)
    code[~sign.any(axis=0)] = _BOTH
    return code

"""Triangle meshes on the lattice of 2^-16 voxels, on which all decisions are exact.

Must not know which voxels are lit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from voxdisplay.bodies.geometry import TriangleMesh
from voxdisplay.compute.array_types import Floats, Ints
from voxdisplay.errors import BodyError
from voxdisplay.voxelization.voxel_box import VoxelBox

SHIFT = 16
"""Binary digits of a voxel: products of three coordinates' differences fit into int64."""
UNIT = 1 << SHIFT
HALF = UNIT >> 1
LIMIT = 1 << 14
"""Coordinates that are further than this from the box, in voxels, are refused."""


@dataclass(frozen=True, slots=True, eq=False)
class SnappedMesh:
    """A mesh whose coordinates are whole multiples of 2^-16 voxel.

    Attributes
    ----------
    points : (3, V) int64 array
        Rows x, y, z, in units of 2^-16 voxel, from the low corner of the box.
    faces : (3, F) int64 array
        Indices of the three corners of each triangle.

    """

    points: Ints
    faces: Ints


def snap(mesh: TriangleMesh, box: VoxelBox) -> SnappedMesh:
    """Return a mesh on the lattice, relative to a box.

    Raises
    ------
    BodyError
        If a vertex is further than `LIMIT` voxels from the box's low corner.

    """
    scaled: Floats = (mesh.vertices - np.array(box.low)) * UNIT
    if scaled.size and np.abs(scaled).max() >= LIMIT * UNIT:
        far = int(np.argmax(np.abs(scaled).max(axis=1)))
        x, y, z = mesh.vertices[far].tolist()
        raise BodyError(
            f"vertex {far} at ({x:.6g}, {y:.6g}, {z:.6g}) is more than {LIMIT} voxels away",
            hint="scale the mesh, or fit it into the display",
        )
    return SnappedMesh(
        np.ascontiguousarray(np.rint(scaled).astype(np.int64).T),
        np.ascontiguousarray(mesh.faces.T),
    )

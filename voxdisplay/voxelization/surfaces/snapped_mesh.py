"""Triangle meshes on the lattice of 2^-16 voxels, on which all decisions are exact.

Must not know which voxels are lit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.bodies.geometry import TriangleMesh
from voxdisplay.compute.array_types import Bools, Ints
from voxdisplay.errors import BodyError
from voxdisplay.voxelization.voxel_box import Triple, VoxelBox

SHIFT = 16
"""Binary digits of a voxel: products of two differences of coordinates fit into int64."""
UNIT = 1 << SHIFT
HALF = UNIT >> 1
LIMIT = (1 << 14) - 2
"""Coordinates that are further than this from the box, in voxels, are refused."""
TRIANGLES_PER_BLOCK = 1 << 13


@dataclass(frozen=True, slots=True, eq=False)
class SnappedMesh:
    """A mesh whose coordinates are whole multiples of 2^-16 voxel.

    Attributes
    ----------
    points : (3, V) int32 array
        Rows x, y, z, in units of 2^-16 voxel, from the low corner of the box.
    faces : (F, 3) int64 array
        Indices of the three corners of each triangle.
    sides : (int, int, int)
        Numbers of voxels of the box along x, y and z.

    """

    points: NDArray[np.int32]
    faces: Ints
    sides: Triple

    def blocks(self, size: int = TRIANGLES_PER_BLOCK) -> Iterator[tuple[int, Ints]]:
        """Yield the number of the first triangle, and the corners, (3, n), of all in blocks."""
        for begin in range(0, len(self.faces), size):
            yield begin, self.faces[begin : begin + size].T.copy()

    def is_within(self) -> bool:
        """Return whether all vertices are inside the box or on its walls."""
        return all(
            int(row.min()) >= 0 and int(row.max()) <= side << SHIFT
            for row, side in zip(self.points, self.sides, strict=True)
        )

    def expanded(self, margin: int) -> SnappedMesh:
        """Return the mesh relative to a box with so many more voxels on all sides."""
        nx, ny, nz = (side + 2 * margin for side in self.sides)
        return SnappedMesh(self.points + np.int32(margin << SHIFT), self.faces, (nx, ny, nz))

    def only(self, rows: Ints) -> SnappedMesh:
        """Return the mesh of some of the triangles, by their numbers."""
        return SnappedMesh(self.points, self.faces[rows], self.sides)

    def without(self, dropped: Bools) -> SnappedMesh:
        """Return the mesh without some triangles, by a mask (F,)."""
        return SnappedMesh(self.points, self.faces[~dropped], self.sides)


def snap(mesh: TriangleMesh, box: VoxelBox) -> SnappedMesh:
    """Return a mesh on the lattice, relative to a box.

    Raises
    ------
    BodyError
        If a vertex is further than `LIMIT` voxels from the box's low corner.

    """
    points = np.empty((3, len(mesh.vertices)), dtype=np.int32)
    for axis in range(3):
        scaled = mesh.vertices[:, axis] - box.low[axis]
        scaled *= UNIT
        np.rint(scaled, out=scaled)
        if max(-scaled.min(), scaled.max()) > LIMIT * UNIT:
            far = int(np.argmax(np.abs(scaled)))
            x, y, z = mesh.vertices[far].tolist()
            raise BodyError(
                f"vertex {far} at ({x:.6g}, {y:.6g}, {z:.6g}) is more than {LIMIT} voxels away",
                hint="scale the mesh, or fit it into the display",
            )
        points[axis] = scaled
    return SnappedMesh(points, mesh.faces, box.sides)

"""Triangles of a mesh in blocks, with the mid-planes that they can meet.

Must not know which voxels are lit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.voxelization.surfaces.snapped_mesh import HALF, SHIFT, UNIT, SnappedMesh

# So many that groups of alike ones outweigh the calls for each.
TRIANGLES_PER_BLOCK = 1 << 16


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


def triangle_blocks(mesh: SnappedMesh, size: int = TRIANGLES_PER_BLOCK) -> Iterator[TriangleBlock]:
    """Yield the triangles of a mesh in blocks."""
    for begin, faces in mesh.blocks(size):
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

"""Half-open crossings of a mesh with the columns of voxel centres along an axis.

Must not know what is made of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Ints
from voxdisplay.compute.kernel_backend import with_kernel
from voxdisplay.voxelization.surfaces.mesh_topology import Topology
from voxdisplay.voxelization.surfaces.midline_crossings import (
    NEAR_FACE,
    Crossings,
    midline_crossings,
)
from voxdisplay.voxelization.surfaces.snapped_mesh import HALF, SHIFT
from voxdisplay.voxelization.surfaces.triangle_blocks import triangle_blocks


@dataclass(frozen=True, slots=True, eq=False)
class ColumnCrossings:
    """Crossings of a mesh with all columns of voxel centres along one axis w.

    Attributes
    ----------
    axis : {0, 1, 2}
    i, j : (n,) int64 array
        Columns along the two axes after w.
    level : (n,) int64 array
        First centre at or after the crossing, 0 to the number of voxels along w.
    step : (n,) int8 array
        1 where the column enters, -1 where it leaves.

    """

    axis: int
    i: Ints
    j: Ints
    level: Ints
    step: NDArray[np.int8]


@with_kernel
def column_crossings(topology: Topology, axis: int) -> ColumnCrossings:
    """Return the crossings of a mesh with all columns along an axis."""
    side = topology.mesh.sides[axis]
    parts = []
    for block in triangle_blocks(topology.mesh):
        for crossings in midline_crossings(block, axis, half_open=True):
            level = np.clip(_first_centers(crossings), 0, side)
            step = np.where(crossings.turned, 1, -1).astype(np.int8)
            parts.append(ColumnCrossings(axis, crossings.i, crossings.j, level, step))
    none = np.empty(0, dtype=np.int64)
    parts.append(ColumnCrossings(axis, none, none, none, none.astype(np.int8)))
    return ColumnCrossings(
        axis,
        np.concatenate([part.i for part in parts]),
        np.concatenate([part.j for part in parts]),
        np.concatenate([part.level for part in parts]),
        np.concatenate([part.step for part in parts]),
    )


def _first_centers(crossings: Crossings) -> Ints:
    """Return the number of the first centre along w at or after each crossing, exactly."""
    depth = crossings.depth() - 0.5
    nearest = np.rint(depth)
    level = np.ceil(depth).astype(np.int64)
    near = np.flatnonzero(np.abs(depth - nearest) < NEAR_FACE)
    if near.size:
        center = nearest[near].astype(np.int64)
        level[near] = center + (crossings.side_of((center << SHIFT) + HALF, near) > 0)
    return level

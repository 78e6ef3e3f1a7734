"""Shells of meshes: the voxels nearest to the crossings with mid-lines, one voxel thick.

Every crossing of the mesh with a mid-line lights the voxel that holds it, so that no 6-connected
path through dark voxels crosses the mesh. On a voxel's face, closed and oriented meshes light the
inner voxel, others the upper one.

Where a mid-line touches a closed mesh at a silhouette alone, and that on a voxel's face, the
triangles on either side have opposite normals, and so both voxels at that face are lit: one of them
may be just outside of the mesh's bounding box, as below the edge where a slanted side meets a flat
base. This cannot be mended triangle by triangle. Any point of a triangle is on an edge once the
triangle is split, so that a rule that splitting does not change may depend on the triangle's plane
alone; and of those, only inner, outer or both are the same in a mirror. Both voxels are within 1/2
of the mesh, and clipping to the bounding box leaves the inner one.
"""

from __future__ import annotations

import numpy as np

from voxdisplay.compute.array_types import Ints
from voxdisplay.compute.kernel_backend import with_kernel
from voxdisplay.voxelization.surfaces.lit_mask import LitMask
from voxdisplay.voxelization.surfaces.mesh_topology import Topology
from voxdisplay.voxelization.surfaces.midline_crossings import (
    NEAR_FACE,
    Crossings,
    midline_crossings,
)
from voxdisplay.voxelization.surfaces.snapped_mesh import SHIFT
from voxdisplay.voxelization.surfaces.triangle_blocks import triangle_blocks
from voxdisplay.voxelization.voxel_box import Triple


@with_kernel
def mark_shell(mask: LitMask, topology: Topology, walls: Triple) -> bool:
    """Light the voxels of a mesh's triangles; return whether all of them are in the box.

    Parameters
    ----------
    mask : LitMask
        Of the mesh's box.
    topology : Topology
    walls : (int, int, int)
        Upper walls of the grid. A surface on one lights the voxel below instead of the upper one.

    """
    whole = True
    for block in triangle_blocks(topology.mesh):
        for axis in range(3):
            for crossings in midline_crossings(block, axis):
                level = lit_levels(crossings, topology, walls[axis])
                inside = (level >= 0) & (level < mask.sides[axis])
                if inside.all():
                    mask.mark(mask.locate(axis, crossings.i, crossings.j, level))
                else:
                    whole = False
                    mask.mark(
                        mask.locate(axis, crossings.i[inside], crossings.j[inside], level[inside])
                    )
    return whole


def lit_levels(crossings: Crossings, topology: Topology, wall: int) -> Ints:
    """Return the voxels along w, (n,), that crossings light."""
    depth = crossings.depth()
    nearest = np.rint(depth)
    level = np.floor(depth).astype(np.int64)
    near = np.flatnonzero(np.abs(depth - nearest) < NEAR_FACE)
    if near.size:
        face = nearest[near].astype(np.int64)
        side = crossings.side_of(face << SHIFT, near)
        level[near] = face - (side < 0)
        tied = np.flatnonzero(side == 0)
        if tied.size:
            face = face[tied]
            outward = topology.outward
            if outward:
                upward = crossings.turned[near[tied]] == (outward < 0)
                level[near[tied]] = face - upward
            else:
                level[near[tied]] = face - (face == wall)
    return level

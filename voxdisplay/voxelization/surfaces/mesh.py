"""Voxeliser of triangle meshes: shells by crossings with mid-lines, solids by columns along z."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.voxelization.surfaces.midline_crossings import (
    NEAR_FACE,
    Crossings,
    midline_crossings,
)
from voxdisplay.voxelization.surfaces.snapped_mesh import HALF, SHIFT, SnappedMesh, snap
from voxdisplay.voxelization.voxel_set import VoxelSet

if TYPE_CHECKING:
    from voxdisplay.bodies.body import Body
    from voxdisplay.bodies.geometry import TriangleMesh
    from voxdisplay.compute.array_types import Bools, Ints
    from voxdisplay.voxelization.voxel_box import VoxelBox


def voxelize_mesh(
    geometry: TriangleMesh,
    box: VoxelBox,
    body: Body,
    *,
    certified: bool,  # noqa: ARG001 - exact anyway
) -> VoxelSet:
    """Return the voxels of a mesh inside a box: see `body_voxelization.Voxeliser`."""
    mesh = snap(geometry, box)
    mask = _solid(mesh, box) if body.kind == "solid" else _shell(mesh, box)
    return VoxelSet(box, np.flatnonzero(mask), body.kind)


def _shell(mesh: SnappedMesh, box: VoxelBox) -> Bools:
    """Return the voxels nearest to the crossings with all mid-lines: (size,) bool."""
    mask = np.zeros(box.size, dtype=bool)
    stride = np.array([1, box.sides[0], box.sides[0] * box.sides[1]])
    for axis in range(3):
        along_u, along_v = (axis + 1) % 3, (axis + 2) % 3
        side = box.sides[axis]
        for crossings in midline_crossings(mesh, axis, box.sides):
            level = _voxel_below(crossings)
            inside = (level >= 0) & (level < side)
            index = crossings.i * stride[along_u] + crossings.j * stride[along_v]
            index += level * stride[axis]
            mask[index[inside]] = True
    return mask


def _voxel_below(crossings: Crossings) -> Ints:
    """Return floor(depth), exactly."""
    depth = crossings.depth()
    nearest = np.rint(depth)
    level = np.floor(depth).astype(np.int64)
    near = np.flatnonzero(np.abs(depth - nearest) < NEAR_FACE)
    if near.size:
        face = nearest[near].astype(np.int64)
        level[near] = face - (crossings.side_of(face << SHIFT, near) < 0)
    return level


def _solid(mesh: SnappedMesh, box: VoxelBox) -> Bools:
    """Return the voxels whose centres have a winding number other than 0: (size,) bool."""
    nx, ny, nz = box.sides
    change = np.zeros((nz + 1, ny, nx), dtype=np.int32)
    for crossings in midline_crossings(mesh, 2, box.sides, half_open=True):
        depth = crossings.depth() - 0.5
        nearest = np.rint(depth)
        level = np.ceil(depth).astype(np.int64)
        near = np.flatnonzero(np.abs(depth - nearest) < NEAR_FACE)
        if near.size:
            face = nearest[near].astype(np.int64)
            level[near] = face + (crossings.side_of((face << SHIFT) + HALF, near) > 0)
        sign = np.where(crossings.upward, -1, 1)
        np.add.at(change, (np.clip(level, 0, nz), crossings.j, crossings.i), sign)
    return np.asarray(np.cumsum(change, axis=0)[:nz] != 0).reshape(-1)

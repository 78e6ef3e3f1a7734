"""Voxeliser of voxels that are lit already: clipping, ordering, and one voxel for each place."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.voxelization.voxel_set import VoxelSet

if TYPE_CHECKING:
    from voxdisplay.bodies.body import Body
    from voxdisplay.bodies.geometry import LitVoxels
    from voxdisplay.voxelization.voxel_box import VoxelBox


def voxelize_lit(
    geometry: LitVoxels,
    box: VoxelBox,
    body: Body,
    *,
    certified: bool = False,
) -> VoxelSet:
    """Return the voxels inside a box: see `body_voxelization.Voxeliser`."""
    rows = np.flatnonzero(box.inside(geometry.voxels))
    whole = len(rows) == len(geometry.voxels)
    index = box.index_of(geometry.voxels if whole else geometry.voxels[rows])
    order = np.argsort(index, kind="stable")
    index = index[order]
    last = np.append(index[1:] != index[:-1], np.ones(len(index[:1]), dtype=bool))
    kept = rows[order[last]]
    return VoxelSet(
        box,
        index[last],
        body.kind,
        None if geometry.colors is None else geometry.colors[kept],
        {name: values[kept] for name, values in geometry.parameters.items()},
        certified=certified,
    )

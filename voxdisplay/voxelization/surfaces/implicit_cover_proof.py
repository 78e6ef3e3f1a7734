"""Proof of the cover of an implicit surface: each of its points is within 1 of a lit one.

A dual cell is a unit cube with voxel centres at its corners. Cells that may hold a zero of the
function, by its bounds, must have a lit corner, or be refuted by bounds over smaller boxes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.voxelization.surfaces.interval_subdivision import (
    BRICK,
    Bricks,
    Numbers,
    bounds_over,
    halve,
    may_be_zero,
)
from voxdisplay.voxelization.surfaces.wire_cover import contains

if TYPE_CHECKING:
    from voxdisplay.bodies.implicit import SpaceFunction
    from voxdisplay.compute.array_types import Ints
    from voxdisplay.voxelization.voxel_box import VoxelBox

_HALVINGS = 3
_BRICKS = 1 << 11  # at a time
_LISTED = 3


def open_cells(
    function: SpaceFunction, bricks: Bricks | None, index: Ints, region: VoxelBox
) -> tuple[str, ...]:
    """Return what could not be proven, as notes; nothing if the cover is proven.

    Parameters
    ----------
    function : SpaceFunction
    bricks : Bricks or None
        Bricks that may hold zeros.
    index : (N,) int64 array
        Scan-order indices of the lit voxels of the region, ascending.
    region : VoxelBox

    """
    if bricks is None:
        return ("nothing is proven: a callable has no bounds",)
    found = [
        _open(function, bricks.origin[begin : begin + _BRICKS], index, region)
        for begin in range(0, len(bricks.origin), _BRICKS)
    ]
    cells = np.concatenate(found) if found else np.empty((0, 3), dtype=np.int64)
    if not len(cells):
        return ()
    places = ", ".join(str(tuple(cell)) for cell in (cells[:_LISTED] + 1).tolist())
    more = ", ..." if len(cells) > _LISTED else ""
    message = (
        f"not proven: {len(cells)} unit cubes without a lit voxel may hold parts of the surface"
    )
    return (f"{message}: around {places}{more}",)


def _open(function: SpaceFunction, origin: Ints, index: Ints, region: VoxelBox) -> Ints:
    """Return the cells, by their first voxel, (n, 3), of some bricks that stay open."""
    low, high = np.array(region.low), np.array(region.high) - 2
    side = BRICK
    while side > 1:
        side //= 2
        origin = _kept(function, halve(origin, side), side)
        outside = (origin > high) | (origin + side <= low)
        origin = origin[~outside.any(axis=1)]
    cells = origin
    lit = np.zeros(len(cells), dtype=bool)
    for step in np.ndindex(2, 2, 2):
        lit |= contains(index, region.index_of(cells + step))
    cells = cells[~lit]
    return np.asarray(cells[_stays_open(function, cells)])


def _stays_open(function: SpaceFunction, cells: Ints) -> Ints:
    """Return the positions of cells that bounds over eighths of eighths do not refute."""
    owner, side = np.arange(len(cells)), 1.0
    part: Numbers = cells + 0.5
    for _ in range(_HALVINGS):
        side /= 2
        part, owner = halve(part, side), np.repeat(owner, 8)
        bounds = bounds_over(function, part, part + side)
        kept = may_be_zero(bounds) if bounds is not None else np.ones(len(part), dtype=bool)
        part, owner = part[kept], owner[kept]
    return np.asarray(owner[np.append(True, owner[1:] != owner[:-1])]) if owner.size else owner


def _kept(function: SpaceFunction, origin: Ints, side: int) -> Ints:
    bounds = bounds_over(function, origin + 0.5, origin + (side + 0.5))
    return origin if bounds is None else np.asarray(origin[may_be_zero(bounds)])

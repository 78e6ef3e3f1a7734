"""Fitting of what a scene shows, wherever it is, to a grid: ``fit="content"``.

Must not know files.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from voxdisplay.curves import Curve
from voxdisplay.scene.placement import Placement
from voxdisplay.scene.voxelized_items import shown_voxels, voxelize_items

if TYPE_CHECKING:
    from collections.abc import Iterable

    from voxdisplay.compute.array_types import Floats
    from voxdisplay.raster.grid import Grid
    from voxdisplay.scene.item import PartSpan, SceneItem
    from voxdisplay.voxelization import Sequence, VoxelSet

_SAMPLES = 1025  # of a curve, for a first guess
_ROUNDS = 4  # each finds the extent to half a voxel of the round before
_GOOD = 1.01  # a better fit is not worth another round

Box = tuple["Floats", "Floats"]


class Content(Protocol):
    """Items that a scene shows at one time."""

    @property
    def items(self) -> tuple[SceneItem, ...]:
        """Items in drawing order."""

    @property
    def spans(self) -> tuple[PartSpan, ...]:
        """Which of them are shown in part."""

    def placed(self, placement: Placement, grid: Grid) -> Content:
        """Return it under an affine map."""


def content_placement(
    moments: Iterable[Content],
    size: Grid,
    grid: Grid,
    pitch: tuple[float, float, float] = (1.0, 1.0, 1.0),
) -> tuple[Placement | None, str | None]:
    """Return the map that makes what is there fill a grid, and a note on it.

    Parameters
    ----------
    moments : iterable of Content
        The scene at the moments at which it has to fit.
    size : Grid
        What bodies without an end are clipped to.
    grid : Grid
    pitch : (px, py, pz)
        Distances of the grid's voxels, in any unit.

    Returns
    -------
    placement : Placement or None
        Uniform in space; what is there is centred. None if there is nothing, or no voxel would
        change.
    note : str or None

    """
    scenes = list(moments)
    guess = _joined([_rough_box(item, size) for scene in scenes for item in scene.items])
    if guess is None:
        return None, "nothing to fit: the scene shows nothing"
    placement = _onto(guess, grid, margin=1, pitch=pitch)
    for _ in range(_ROUNDS):
        found = _joined([_voxel_box(scene.placed(placement, grid), grid) for scene in scenes])
        if found is None:
            return None, "nothing to fit: the scene shows nothing"
        step = _onto(found, grid)
        placement = step.after(placement)
        if step.matrix[0, 0] < _GOOD:
            break
    return placement, f"what is there is scaled by {placement.matrix[0, 0]:.3g} to fill {grid}"


def _rough_box(item: SceneItem, size: Grid) -> Box | None:
    """Return a box that holds most of an item."""
    if isinstance(item.shape, Curve):
        with np.errstate(all="ignore"):
            points = np.array(item.shape.position(np.linspace(*item.shape.t_range, _SAMPLES)))
        points = points[:, np.isfinite(points).all(axis=0)]
        return (points.min(axis=1), points.max(axis=1)) if points.size else None
    low, high = item.shape.bounds()
    if np.isfinite(low).all() and np.isfinite(high).all():
        return low, high
    (voxels,) = voxelize_items([item], size)
    return _box_of(voxels)


def _box_of(voxels: Sequence | VoxelSet) -> Box | None:
    if not len(voxels):
        return None
    low, high = voxels.voxels.min(axis=0), voxels.voxels.max(axis=0)
    return low.astype(np.float64), high + np.float64(1)


def _voxel_box(scene: Content, grid: Grid) -> Box | None:
    """Return the box of all voxels that a scene shows."""
    whole = voxelize_items(scene.items, grid)
    return _joined([_box_of(each) for each in shown_voxels(whole, scene.spans)])


def _joined(boxes: Iterable[Box | None]) -> Box | None:
    found = [box for box in boxes if box is not None]
    if not found:
        return None
    return np.min([low for low, _ in found], axis=0), np.max([high for _, high in found], axis=0)


def _onto(
    box: Box,
    grid: Grid,
    margin: int = 0,
    pitch: tuple[float, float, float] = (1.0, 1.0, 1.0),
) -> Placement:
    """Return the map of a box into the middle of a grid, uniform in space."""
    low, high = box
    room = np.array(grid, dtype=np.float64)
    extent = np.maximum(high - low, 1e-9)
    steps = np.array(pitch) / min(pitch)
    scale = float((np.maximum(room - 2 * margin, 1.0) * steps / extent).min())
    if not np.isfinite(scale) or extent.max() <= 1e-9:
        scale = 1.0
    factors = scale / steps
    return Placement(np.diag(factors), room / 2 - factors * (low + high) / 2)

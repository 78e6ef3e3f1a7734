"""Voxels of scene items, and their drawing on frames.

Curves are voxelised together; what has not changed since the last time is taken from there. Must
not know files.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from voxdisplay import voxelization
from voxdisplay.bodies import Body
from voxdisplay.errors import BodyError, CurveError
from voxdisplay.frame import Drawing, Frame
from voxdisplay.raster.display_list import Spread
from voxdisplay.scene.coloring import Colors, voxel_colors
from voxdisplay.scene.parts import shown_stretches, stretch_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from collections.abc import Sequence as Items

    from voxdisplay.raster.grid import Grid
    from voxdisplay.scene.item import PartSpan, SceneItem
    from voxdisplay.voxelization import Sequence, VoxelSet

_BATCH = 4096  # items that are drawn together

Kept = dict[int, tuple["SceneItem", "Sequence | VoxelSet", Colors | Spread]]
"""Voxels and colours of items, by the identity of the item, which is held so that it stays its."""


def voxelize_items(
    items: Items[SceneItem],
    clip: Grid | None,
    endless: Grid | None = None,
    *,
    kept: Mapping[int, tuple[Any, Any, Any]] | None = None,
    **options: Any,
) -> list[Sequence | VoxelSet]:
    """Return the voxels of items, whole.

    Parameters
    ----------
    items : sequence of SceneItem
    clip : Grid or None
        The grid to which bodies are clipped.
    endless : Grid, optional
        The grid to which bodies without an end are clipped, if ``clip`` is None.
    kept : mapping, optional
        Voxels of items that need not be voxelised again.
    **options
        Of `voxdisplay.voxelize`, for curves; ``certified`` for bodies, too.

    Raises
    ------
    SceneError
        If a curve or body cannot be evaluated or drawn; it names the object.

    """
    found: dict[int, Sequence | VoxelSet] = {}
    curves: list[int] = []
    for i, item in enumerate(items):
        if kept and id(item) in kept:
            found[i] = kept[id(item)][1]
        elif isinstance(item.shape, Body):
            grid = clip
            if grid is None and not np.isfinite(item.shape.bounds()).all():
                grid = endless
            found[i] = _voxelize_body(item, grid, options)
        else:
            curves.append(i)
    if curves:
        sequences = _voxelize_curves([items[i] for i in curves], options)
        found.update(zip(curves, sequences, strict=True))
    return [found[i] for i in range(len(items))]


def voxelized_batches(
    items: Items[SceneItem], clip: Grid
) -> Iterator[list[tuple[SceneItem, Sequence | VoxelSet]]]:
    """Yield items with their voxels, as of `voxelize_items`, some items at a time.

    Voxels of curves that are not held on to need no memory when the next ones come.
    """
    kinds = [type(item.shape) for item in items]
    are_bodies = {kind for kind in set(kinds) if issubclass(kind, Body)}
    bodies = {
        i: _voxelize_body(items[i], clip, {}) for i, kind in enumerate(kinds) if kind in are_bodies
    }
    sequences = _sequences([item for i, item in enumerate(items) if i not in bodies])
    together: list[tuple[SceneItem, Sequence | VoxelSet]] = []
    for i, item in enumerate(items):
        together.append((item, bodies.pop(i) if i in bodies else next(sequences)))
        if len(together) == _BATCH:
            yield together
            together = []
    yield together


def _sequences(items: Items[SceneItem]) -> Iterator[Sequence]:
    """Yield the voxels of items that are curves."""
    done = 0
    try:
        for batch in voxelization.voxelize_batches(item.curve for item in items):
            yield from batch
            done += len(batch)
    except CurveError:
        _name_failing(items[done:], {})
        raise


def _voxelize_body(item: SceneItem, clip: Grid | None, options: Mapping[str, Any]) -> VoxelSet:
    assert isinstance(item.shape, Body)  # noqa: S101 - see the caller
    certified = options.get("certified", False)
    try:
        return voxelization.voxelize(item.shape, certified=certified, clip=clip)
    except (CurveError, BodyError) as error:
        raise item.scene_error(error) from error


def _voxelize_curves(items: Items[SceneItem], options: Mapping[str, Any]) -> list[Sequence]:
    try:
        return voxelization.voxelize_many((item.curve for item in items), **options)
    except CurveError:
        _name_failing(items, options)
        raise


def _name_failing(items: Items[SceneItem], options: Mapping[str, Any]) -> None:
    """Raise the error of the first curve that cannot be voxelised, which names the object.

    Voxelised together, they fail together.
    """
    for item in items:
        try:
            voxelization.voxelize(item.curve, **options)
        except CurveError as error:
            raise item.scene_error(error) from error


def shown_voxels(
    whole: list[Sequence | VoxelSet], spans: Iterable[PartSpan]
) -> list[Sequence | VoxelSet]:
    """Return the parts of items that are shown."""
    stretches = shown_stretches([len(each) for each in whole], spans)
    return [stretch_of(each, *of) for each, of in zip(whole, stretches, strict=True)]


def draw_items(
    frame: Frame,
    items: Items[SceneItem],
    whole: list[Sequence | VoxelSet],
    spans: Iterable[PartSpan],
    kept: Mapping[int, tuple[Any, Any, Any]] | None = None,
) -> tuple[list[Drawing], Kept]:
    """Draw items on a frame.

    Parameters
    ----------
    frame : Frame
    items : sequence of SceneItem
    whole : list of Sequence and VoxelSet
        Their voxels, as of `voxelize_items`.
    spans : iterable of PartSpan
    kept : mapping, optional
        What the last call returned.

    Returns
    -------
    drawings : list of Drawing
    kept : dict
        Voxels and colours of the items, for the next call.

    """
    stretches = shown_stretches([len(each) for each in whole], spans)
    drawn: list[tuple[Sequence | VoxelSet, Colors | Spread]] = []
    keep: Kept = {}
    for item, voxels, (begin, end) in zip(items, whole, stretches, strict=True):
        old = kept.get(id(item)) if kept else None
        colors = old[2] if old else _colors_of(item, voxels)
        keep[id(item)] = item, voxels, colors
        if isinstance(colors, Spread):
            colors = colors.from_place(begin)
        elif len(colors) > 1:
            colors = colors[begin:end]
        drawn.append((stretch_of(voxels, begin, end), colors))
    return frame.draw_batches([drawn]), keep


def draw_still(frame: Frame, items: Items[SceneItem]) -> list[Drawing]:
    """Draw items, whole, on a frame, with no more memory than some of them need at a time."""
    return frame.draw_batches(
        [(voxels, _colors_of(item, voxels)) for item, voxels in batch]
        for batch in voxelized_batches(items, frame.grid)
    )


def _colors_of(item: SceneItem, voxels: Sequence | VoxelSet) -> Colors | Spread:
    try:
        return voxel_colors(item.color, voxels, item.columns or {}, item.fit)
    except (CurveError, BodyError) as error:
        raise item.scene_error(error) from error

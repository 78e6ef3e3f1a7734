"""Drawing of scenes into frames, with notes on fitting, clipping, colours and split curves."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final

import voxdisplay as vd
from voxdisplay.cli.output import note

if TYPE_CHECKING:
    from voxdisplay.cli.model_files import ModelFile
    from voxdisplay.frame import Fit
    from voxdisplay.scene.item import SceneItem
    from voxdisplay.view.picture import RenderOptions

_MAX_JUMPS_NAMED: Final = 3
_MAX_UNDEFINED_NAMED: Final = 8


def voxelize_scene(scene: vd.Scene, **options: Any) -> list[vd.Sequence | vd.VoxelSet]:
    """Return the voxels of a scene's objects; note the reader's choices, jumps and holes.

    Parameters
    ----------
    scene : Scene
    **options
        Of `Scene.voxelize`.

    Raises
    ------
    SceneError
        If an object cannot be drawn; it names the object.

    """
    note_choices(scene)
    found = scene.voxelize(**options)
    for item, voxels in zip(scene.items, found, strict=True):
        _note_remarks(item, _remarks(voxels))
    return found


def note_choices(scene: vd.Scene) -> None:
    """Note the reader's choices."""
    for remark in scene.notes:
        note(remark)


def _note_remarks(item: SceneItem, remarks: Iterator[str]) -> None:
    for remark in remarks:
        note(f"{item.path} ({item.type}): {remark}")


def with_object(item: SceneItem, function: Any, *arguments: Any, **named: Any) -> Any:
    """Call a function and raise its `CurveError` as a `SceneError` that names the object."""
    try:
        return function(*arguments, **named)
    except vd.CurveError as error:
        raise item.scene_error(error) from error


def _remarks(found: vd.Sequence | vd.VoxelSet | vd.Drawing) -> Iterator[str]:
    """Yield remarks on the parameters at which a curve has no value or jumps; those on a body."""
    if not isinstance(found, vd.Sequence):
        yield from found.notes
    if isinstance(found, vd.VoxelSet):
        return
    undefined = found.undefined
    yield from map(str, undefined[:_MAX_UNDEFINED_NAMED])
    if len(undefined) > _MAX_UNDEFINED_NAMED:
        yield f"and has no value at {len(undefined) - _MAX_UNDEFINED_NAMED} more parameters"
    jumps = found.jumps
    if jumps:
        named = ", ".join(f"{t:.6g}" for t in jumps[:_MAX_JUMPS_NAMED])
        more = ", ..." if len(jumps) > _MAX_JUMPS_NAMED else ""
        yield f"the curve jumps near t = {named}{more}: nothing is drawn across"


def load_fitted_scene(
    scene: vd.Scene | ModelFile, grid: vd.Grid | None, fit: Fit = "contain"
) -> tuple[vd.Scene, vd.Grid]:
    """Fit a scene to a grid.

    Parameters
    ----------
    scene : Scene or ModelFile
    grid : Grid or None
        None: the size for which the scene was composed, else 128x128x128.
    fit : {"contain", "none", "content"}

    Returns
    -------
    scene : Scene
    grid : Grid

    """
    grid = grid or scene.size or vd.Grid(128, 128, 128)
    return fit_scene(scene, grid, fit), grid


def fit_scene(
    scene: vd.Scene | ModelFile,
    grid: vd.Grid,
    fit: Fit,
    pitch: tuple[float, float, float] = (1.0, 1.0, 1.0),
) -> vd.Scene:
    """Fit a scene to a grid of voxels of a pitch, and note the change."""
    fitted, remark = scene.fitted(grid, fit, pitch)
    if remark:
        note(remark)
    return fitted


def best_seen(scene: vd.Scene, options: RenderOptions) -> RenderOptions:
    """Return the options with the point of view from which a scene is best seen."""
    if scene.view is None:
        return options
    yaw, pitch, zoom = scene.view
    return options.with_view((math.radians(yaw), math.radians(pitch)), zoom)


def draw_scene(scene: vd.Scene, frame: vd.Frame) -> None:
    """Draw a scene, and note what a display of the frame's kind cannot show."""
    note_choices(scene)
    drawings = scene.draw_each(frame)
    for item, drawing in zip(scene.items, drawings, strict=True):
        _note_remarks(item, _remarks(drawing))
    sums = vd.Drawing.sum(drawings)
    total, clipped = sums.voxels, sums.clipped
    if scene.items and not total:
        note("warning: nothing is inside the display: the picture is empty")
    elif total and clipped == total:
        note(f"warning: all {total} voxels are outside the display: the picture is empty")
    elif clipped:
        note(f"{clipped} of {total} voxels are outside the display and not shown")
    if not sums.exact_color:
        note(f"this is a {frame.format.value} display: colours are the nearest it has")

"""Drawing of scenes into frames, with notes on fitting, clipping, colours and split curves."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final, Literal

import voxdisplay as vd
from voxdisplay.cli.output import note

if TYPE_CHECKING:
    from voxdisplay.scene.model import SceneItem

_MAX_JUMPS_NAMED: Final = 3
_MAX_UNDEFINED_NAMED: Final = 8


def voxelize_scene(scene: vd.Scene, **options: Any) -> list[vd.Sequence]:
    """Return the sequences of a scene's objects; note the reader's choices, jumps and holes.

    Parameters
    ----------
    scene : Scene
    **options
        Of `voxdisplay.voxelize`.

    Raises
    ------
    SceneError
        If a curve cannot be drawn; it names the object.

    """
    for remark in scene.notes:
        note(remark)
    sequences = scene.voxelize(**options)
    for item, sequence in zip(scene.items, sequences, strict=True):
        for remark in _remarks(sequence):
            note(f"{item.path} ({item.type}): {remark}")
    return sequences


def with_object(item: SceneItem, function: Any, *arguments: Any, **named: Any) -> Any:
    """Call a function and raise its `CurveError` as a `SceneError` that names the object."""
    try:
        return function(*arguments, **named)
    except vd.CurveError as error:
        raise item.scene_error(error) from error


def _remarks(sequence: vd.Sequence) -> Iterator[str]:
    """Yield remarks on the parameters at which a curve has no value or jumps."""
    undefined = sequence.undefined
    yield from map(str, undefined[:_MAX_UNDEFINED_NAMED])
    if len(undefined) > _MAX_UNDEFINED_NAMED:
        yield f"and has no value at {len(undefined) - _MAX_UNDEFINED_NAMED} more parameters"
    jumps = sequence.jumps
    if jumps:
        named = ", ".join(f"{t:.6g}" for t in jumps[:_MAX_JUMPS_NAMED])
        more = ", ..." if len(jumps) > _MAX_JUMPS_NAMED else ""
        yield f"the curve jumps near t = {named}{more}: nothing is drawn across"


def load_fitted_scene(
    path: str, grid: vd.Grid | None, fit: Literal["contain", "none"] = "contain"
) -> tuple[vd.Scene, vd.Grid]:
    """Read a scene and fit it to a grid.

    Parameters
    ----------
    path : str
        A file, or ``-`` for stdin.
    grid : Grid or None
        None: the size for which the scene was composed, else 128x128x128.
    fit : {"contain", "none"}

    Returns
    -------
    scene : Scene
    grid : Grid

    """
    scene = vd.load_scene(path)
    grid = grid or scene.size or vd.Grid(128, 128, 128)
    return fit_scene(scene, grid, fit), grid


def fit_scene(scene: vd.Scene, grid: vd.Grid, fit: Literal["contain", "none"]) -> vd.Scene:
    """Fit a scene to a grid, and note the change."""
    fitted, remark = scene.fitted(grid, fit)
    if remark:
        note(remark)
    return fitted


def draw_scene(scene: vd.Scene, frame: vd.Frame) -> None:
    """Draw a scene, and note what a display of the frame's kind cannot show."""
    drawings = [
        frame.draw(sequence, item.color)
        for sequence, item in zip(voxelize_scene(scene), scene.items, strict=True)
    ]
    total = sum(drawing.voxels for drawing in drawings)
    clipped = sum(drawing.clipped for drawing in drawings)
    if total and clipped == total:
        note(f"warning: all {total} voxels are outside the display: the picture is empty")
    elif clipped:
        note(f"{clipped} of {total} voxels are outside the display and not shown")
    if not all(drawing.exact_color for drawing in drawings):
        note(f"this is a {frame.format.value} display: colours are the nearest it has")

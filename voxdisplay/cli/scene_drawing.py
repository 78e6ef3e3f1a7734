"""From a scene to its sequences, for the commands that draw and those that only list."""

from __future__ import annotations

from typing import Any

import voxdisplay as vd
from voxdisplay.cli.output import (
    note,
)


def voxelize_scene(scene: vd.Scene, **how: Any) -> list[vd.Sequence]:
    """Find the voxels of all objects of a scene together.

    Parameters
    ----------
    scene : Scene
    **how
        Options of `voxdisplay.voxelize`.

    Raises
    ------
    SceneError
        Naming the object whose curve cannot be drawn.

    """
    try:
        return vd.voxelize_many((item.curve for item in scene.items), **how)
    except vd.CurveError:
        # Found together, they fail together: find out which one is to blame.
        for item in scene.items:
            try:
                vd.voxelize(item.curve, **how)
            except vd.CurveError as error:
                raise vd.SceneError(str(error), path=item.path, hint=error.hint) from error
        raise


def draw(scene: vd.Scene, frame: vd.Frame) -> None:
    """Draw a scene, and say on stderr what a display of the frame's kind cannot show."""
    drawings = [
        frame.draw(sequence, item.color)
        for sequence, item in zip(voxelize_scene(scene), scene.items, strict=True)
    ]
    total = sum(drawing.voxels for drawing in drawings)
    clipped = sum(drawing.clipped for drawing in drawings)
    if total and clipped == total:
        note(f"warning: all {total} voxels are outside the display: the picture is empty")
    elif clipped:
        note(f"{clipped} of {total} voxels are outside the display, and not shown")
    if not all(drawing.exact_color for drawing in drawings):
        note(f"this is a {frame.format.value} display: colours are the nearest it has")

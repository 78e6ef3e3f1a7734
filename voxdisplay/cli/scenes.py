"""From a scene to its sequences, for the commands that draw and those that only list."""

from __future__ import annotations

from typing import Any

import voxdisplay as vd


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

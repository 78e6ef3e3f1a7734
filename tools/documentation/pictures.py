"""Pictures and films of the documentation, drawn by ``voxdisplay preview`` in this process."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import voxdisplay as vd
from voxdisplay.cli.preview import preview

# Most pictures of a film, and pictures per second; a draft has films that are quickly drawn.
_PICTURES, _FPS = 120, 12
_DRAFT_PICTURES = 8
_FILM = ["--pixels", "360x270"]
_STILL = ["--pixels", "640x480"]


def draw(scene: Path, options: Sequence[str] = (), *, draft: bool = False) -> str:
    """Draw a scene, or the film of one that moves; return the picture's path in the sources."""
    sources = scene.parent if scene.parent.name not in {"examples", "objects"} else scene.parents[1]
    loaded = vd.load_scene(scene)
    moves = bool(loaded.duration) and "--at" not in options
    folder = sources / "pictures"
    folder.mkdir(exist_ok=True)
    name = "-".join([scene.stem, *(option.strip("-") for option in options)]).replace(",", "_")
    target = folder / f"{name}.{'gif' if moves else 'png'}"
    if not target.exists():
        shape = list(_STILL)
        if moves:
            most = _DRAFT_PICTURES if draft else _PICTURES
            fps = min(_FPS, max(1, int(most / loaded.duration)))
            shape = [*_FILM, "--fps", str(fps)]
        preview.main([str(scene), "-q", "-o", str(target), *shape, *options], standalone_mode=False)
    return f"/pictures/{target.name}"

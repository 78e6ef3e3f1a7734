"""View of pages that are there: one that turns, or a film.

All of it is in the widget, and turns without a kernel where the notebook keeps widgets' state.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Final

from voxdisplay.view.camera import Camera
from voxdisplay.view.film import FilmJob
from voxdisplay.view.html_export import packed_text, page_with
from voxdisplay.view.live.snapshot_message import Snapshot
from voxdisplay.view.notebook.widget import PageWidget

_MAX_CHARACTERS: Final = 1 << 24
_LEVEL: Final = 4  # of deflate: a film is made while the user waits


def film_widget(film: FilmJob, camera: Camera | None, png: Callable[[], bytes]) -> PageWidget:
    """Return the widget of a film; of more than a notebook can take, it has the beginning.

    Parameters
    ----------
    film : FilmJob
        Its pictures are not drawn here, but in the cell.
    camera : Camera or None
        From where it is seen first.
    png : callable
        As of `PageWidget`.

    """
    frames: list[str] = []
    room = _MAX_CHARACTERS
    for number, page in enumerate(film.pages, 1):
        snapshot = Snapshot(
            page, film.grid, film.format, number, film.title, palette=film.palette, camera=camera
        )
        frame = packed_text(snapshot, _LEVEL)
        room -= len(frame)
        if frames and room < 0:
            warnings.warn(
                f"the view has the first {len(frames)} pictures: more are too large for a notebook",
                RuntimeWarning,
                stacklevel=2,
            )
            break
        frames.append(frame)
    return PageWidget(page_with({"cell": True, "fps": film.fps, "frames": frames}, film.title), png)

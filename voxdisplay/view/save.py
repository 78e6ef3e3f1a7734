"""Writing a page to a file: picture, film or HTML, by the file's suffix.

Files are replaced atomically. Knows which formats there are, not how they are encoded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.grid import Grid
from voxdisplay.raster.palette import Colors
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.raster.pixel_map import PixelMap
from voxdisplay.view.animation import Turntable, save_gif, save_mp4
from voxdisplay.view.atomic_write import atomic_write
from voxdisplay.view.film import FilmJob
from voxdisplay.view.lit_voxels import lit_voxels
from voxdisplay.view.picture import RenderOptions, render_page

Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class ExportJob:
    """A page and the options of its export.

    Attributes
    ----------
    page : ndarray or PixelMap
        Indexed [z, y, x]; or the lit pixels alone.
    grid : Grid
    format : PixelFormat
    options : Look
    title : str
    seconds, fps : float
        Of a film: duration of one turn, and pictures per second.
    palette : (256, 3) uint8 array or None
        Of an index8 page; None for the default one.

    """

    page: NDArray[np.integer] | PixelMap
    grid: Grid
    format: PixelFormat
    options: RenderOptions = field(default_factory=RenderOptions)
    title: str = "voxdisplay"
    seconds: float = 3.0
    fps: float = 20.0
    palette: Colors | None = None

    @property
    def pages(self) -> list[NDArray[np.integer] | PixelMap]:
        """The page, as the only one."""
        return [self.page]

    def pictures(self, progress: Progress | None) -> Turntable:
        """Return the pictures of one turn."""
        lit = lit_voxels(self.page, self.grid, self.format, self.palette)
        count = max(1, round(self.seconds * self.fps))
        return Turntable(lit, self.grid, self.options, count, progress)


def save(path: Path, shot: ExportJob | FilmJob, progress: Progress | None = None) -> None:
    """Write a file of the kind that its suffix names, one of `WRITERS`.

    Parameters
    ----------
    path : Path
    shot : ExportJob or FilmJob
    progress : callable, optional
        Called with (pictures rendered, pictures in all) of a film.

    Raises
    ------
    OSError
        If it cannot be written.
    MissingExtra
        If an optional library for it is not installed.

    """
    writer = WRITERS[path.suffix.lower()]
    with atomic_write(path) as unfinished:
        writer(unfinished, shot, progress)


def _png(path: Path, shot: ExportJob | FilmJob, _: Progress | None) -> None:
    drawn = render_page(shot.page, shot.grid, shot.format, shot.options, shot.palette)
    drawn.save(path, format="PNG")


def _gif(path: Path, shot: ExportJob | FilmJob, progress: Progress | None) -> None:
    save_gif(path, shot.pictures(progress), shot.fps)


def _mp4(path: Path, shot: ExportJob | FilmJob, progress: Progress | None) -> None:
    save_mp4(path, shot.pictures(progress), shot.fps)


def _html(path: Path, shot: ExportJob | FilmJob, _: Progress | None) -> None:
    from voxdisplay.view.html_export import save_html  # noqa: PLC0415 - it brings a page of its own

    save_html(
        path,
        shot.pages,
        shot.grid,
        shot.format,
        title=shot.title,
        fps=shot.fps,
        palette=shot.palette,
        camera=shot.options.camera,
    )


WRITERS: dict[str, Callable[[Path, ExportJob | FilmJob, Progress | None], None]] = {
    ".png": _png,
    ".gif": _gif,
    ".mp4": _mp4,
    ".html": _html,
}
FILM_SUFFIXES = (".gif", ".mp4")

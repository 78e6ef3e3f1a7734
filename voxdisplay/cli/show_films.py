"""Films of shows: moving scenes, and files of frames such as recordings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

import voxdisplay as vd

if TYPE_CHECKING:
    from voxdisplay.frame import Fit
    from voxdisplay.raster.pixel_map import PixelMap
    from voxdisplay.shows.show import Show
    from voxdisplay.view.film import FilmJob, LazyPages
    from voxdisplay.view.picture import RenderOptions

# Pixels of all pictures of a film: what a GIF takes in memory, in bytes.
_MAX_PIXELS: Final = 1 << 29
_MAX_PICTURES: Final = 10_000
_MIN_FPS: Final = 0.1  # of the page
MAX_FPS: Final = 60.0
"""Most pictures per second, of the kinds of film."""
FILM_SUFFIXES: Final = (".gif", ".mp4", ".html")
"""Suffixes of films of shows."""

_SHOW_SUFFIXES: Final = (".vxs", ".lcanimraw")


def is_show_file(path: str) -> bool:
    """Return whether a path is that of a file of frames, by its name."""
    return path.lower().endswith(_SHOW_SUFFIXES)


def open_show_file(path: str, size: vd.Grid | None, format_: str | None, fit: Fit) -> Show:
    """Return the show of a file of frames, on displays of a size and format: by default its own.

    Raises
    ------
    RecordingError
        If it cannot be read, or has no frame.

    """
    from voxdisplay.shows.show_files import open_show  # noqa: PLC0415 - help starts fast

    found = open_show(Path(path))
    if not found.frame_count:
        raise vd.RecordingError(f"{Path(path).name} has no whole frame")
    if size is None and format_ is None:
        return found
    own = found.frame(0)
    return found.show_on(vd.Frame(size or own.grid, format_ or own.format), fit=fit)


def frame_at(show: Show, time_s: float) -> vd.Frame:
    """Return the frame that is due at a time.

    Raises
    ------
    click.UsageError
        If the show has ended by then.

    """
    if time_s > show.duration:
        raise click.UsageError(f"--at {time_s:g}: the show lasts {show.duration:g} s")
    return show.frame(_number_at(show, time_s))


def _number_at(show: Show, time_s: float) -> int:
    return min(int(time_s * show.fps + 1e-9), show.frame_count - 1)


def color_page(frame: vd.Frame) -> PixelMap:
    """Return the lit voxels of a frame of any format as pixels of rgb888."""
    from voxdisplay.raster.pixel_map import PixelMap  # noqa: PLC0415 - help starts fast

    index, _ = frame.lit()
    return PixelMap(index, vd.PixelFormat.RGB888.nearest(frame.lit_rgb()))


def film_of(
    show: Show, options: RenderOptions, title: str, *, fps: float | None, drawn: bool
) -> FilmJob:
    """Return the film of a show.

    Parameters
    ----------
    show : Show
    options : RenderOptions
    title : str
    fps : float or None
        Pictures per second; None: those of the show.
    drawn : bool
        Whether its pictures are drawn, as for .gif and .mp4: then their size counts.

    Raises
    ------
    click.BadParameter
        If there would be too many pixels or pictures.

    """
    from voxdisplay.view.film import FilmJob, LazyPages  # noqa: PLC0415 - an extra

    rate = min(max(fps or show.fps, _MIN_FPS), MAX_FPS)
    count = max(1, round(show.duration * rate))
    check_film_size(count, options.size if drawn else (1, 1))
    pages: LazyPages = LazyPages(
        count, lambda number: color_page(show.frame(_number_at(show, number / rate)))
    )
    grid = show.frame(0).grid
    return FilmJob(pages, grid, vd.PixelFormat.RGB888, options, title, rate)


def check_film_size(pictures: float, size_px: tuple[int, int]) -> None:
    """Refuse a film of too many pixels, or of too many pictures."""
    if size_px[0] * size_px[1] * pictures > _MAX_PIXELS or pictures > _MAX_PICTURES:
        raise click.BadParameter(
            f"{pictures:.0f} pictures of {size_px[0]}x{size_px[1]} are too many: make them "
            "smaller, or fewer by --fps or --seconds",
            param_hint="--pixels",
        )

"""Rich display of pages and voxels: PNG for notebooks, files by suffix, and the picture viewer.

One implementation for frames, scenes, displays and sequences. Must not know any of these: it takes
pages, the arrays that displays hold, and lists of voxels. Imported only when a picture is asked
for; without Pillow notebooks get none.
"""

from __future__ import annotations

import io
import math
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from voxdisplay.argument_checks import wrong_kind
from voxdisplay.errors import MissingExtra, VoxDisplayError, did_you_mean
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.palette import Colors
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.raster.pixel_map import PixelMap

if TYPE_CHECKING:
    from voxdisplay.view.camera import Camera
    from voxdisplay.view.film import FilmJob
    from voxdisplay.view.pillow import Image

_MAX_SIDE = 65535  # of a grid that the camera takes


def page_png(
    page: NDArray[np.integer] | PixelMap,
    grid: Grid,
    format: PixelFormat,  # noqa: A002 - the word of the command line
    palette: Colors | None = None,
) -> bytes | None:
    """Return the picture of a page as a PNG file; None if Pillow is not installed.

    Parameters
    ----------
    page : ndarray or PixelMap
        As `Frame.array` returns it, indexed [z, y, x]; or the lit pixels alone.
    grid : Grid
    format : PixelFormat
    palette : (256, 3) uint8 array, optional
        Of an index8 page; the default palette if left out.

    """
    try:
        from voxdisplay.view.picture import render_page  # noqa: PLC0415 - needs an extra
    except MissingExtra:
        return None
    return png_file(render_page(page, grid, format, palette=palette))


def voxels_png(voxels: NDArray[np.integer]) -> bytes | None:
    """Return the picture of white voxels in their bounding box as a PNG file.

    Parameters
    ----------
    voxels : (n, 3) integer array
        Columns x, y, z, anywhere.

    Returns
    -------
    bytes or None
        None if Pillow is not installed, or there is nothing that a picture could show.

    """
    try:
        from voxdisplay.view.lit_voxels import LitVoxels  # noqa: PLC0415
        from voxdisplay.view.picture import RenderOptions, render_voxels  # noqa: PLC0415
    except MissingExtra:
        return None
    if not len(voxels):
        return None
    low = voxels.min(axis=0).astype(np.int64)
    sides = (voxels.max(axis=0) - low + 1).tolist()
    if max(sides) > _MAX_SIDE:
        return None
    positions = np.unique(voxels - low, axis=0).astype(np.uint16)
    lit = LitVoxels(positions, np.full(positions.shape, 255, dtype=np.uint8))
    return png_file(render_voxels(lit, Grid(*sides), RenderOptions()))


def save_page(
    path: str | os.PathLike[str],
    page: NDArray[np.integer] | PixelMap,
    grid: Grid,
    format: PixelFormat,  # noqa: A002
    palette: Colors | None = None,
) -> None:
    """Write a page to a picture, a film of one turn, or a page for a browser.

    Parameters
    ----------
    path : str or path
        Its suffix says which: one of `view.save.WRITERS`.
    page, grid, format, palette
        As of `page_png`.

    Raises
    ------
    ValueError
        If nothing is written with this suffix.
    MissingExtra
        If a library is not installed.
    OSError
        If the file cannot be written.

    """
    from voxdisplay.view.save import WRITERS, ExportJob, save  # noqa: PLC0415 - needs an extra

    if not isinstance(path, str | os.PathLike):
        raise wrong_kind("path", "a str or path", path)
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in WRITERS:
        near = did_you_mean(suffix, WRITERS)
        raise ValueError(
            f"no picture is written to {path.name!r}: its suffix must be one of "
            f"{', '.join(WRITERS)}" + (f"; {near}" if near else "")
        )
    save(path, ExportJob(page, grid, format, palette=palette))


def show_page(
    page: NDArray[np.integer] | PixelMap,
    grid: Grid,
    format: PixelFormat,  # noqa: A002
    palette: Colors | None = None,
) -> None:
    """Show a page: in the output of a notebook, else in the system's picture viewer.

    Parameters
    ----------
    page, grid, format, palette
        As of `page_png`.

    Raises
    ------
    MissingExtra
        If Pillow is not installed.
    VoxDisplayError
        If there is no screen, or no picture viewer.

    """
    show_film([page], grid, format, palette)


def show_film(
    pages: Sequence[NDArray[np.integer] | PixelMap],
    grid: Grid,
    format: PixelFormat,  # noqa: A002
    palette: Colors | None = None,
    *,
    fps: float = 30.0,
    view: tuple[float, float, float] | None = None,
) -> None:
    """Show pages that follow each other; outside a notebook, the first.

    In a notebook that is a view that turns and plays, with the extra ``notebook``; without it, the
    picture of the first page.

    Parameters
    ----------
    pages : sequence of ndarray or PixelMap
        At least one; each as of `page_png`.
    grid, format, palette
        As of `page_png`.
    fps : float
        Pages per second.
    view : (yaw, pitch, zoom), optional
        From where they are seen first: angles in degrees, as of `RenderOptions.with_view`.

    Raises
    ------
    MissingExtra, VoxDisplayError
        As of `show_page`.

    """
    from voxdisplay.view.film import FilmJob  # noqa: PLC0415
    from voxdisplay.view.picture import RenderOptions, render_page  # noqa: PLC0415 - an extra
    from voxdisplay.view.pillow import ImageShow  # noqa: PLC0415

    options = RenderOptions()
    if view:
        yaw, pitch, zoom = view
        options = options.with_view((math.radians(yaw), math.radians(pitch)), zoom)
    image = render_page(pages[0], grid, format, options, palette)
    if in_notebook():
        film = FilmJob(pages, grid, format, options, "voxdisplay", fps, palette)
        _show_in_cell(image, film, options.camera if view else None)
        return
    hint = "save it: frame.save('picture.png')"
    if not _has_screen():
        raise VoxDisplayError("there is no screen to show a picture on", hint=hint)
    if not ImageShow.show(image):
        raise VoxDisplayError("this system has no picture viewer", hint=hint)


def _show_in_cell(image: Image.Image, film: FilmJob, camera: Camera | None) -> None:
    from IPython.display import display  # noqa: PLC0415 - loaded already

    try:
        from voxdisplay.view.notebook.film_view import film_widget  # noqa: PLC0415 - an extra
    except MissingExtra:
        display(image)
        return
    display(film_widget(film, camera, lambda: png_file(image)))


def png_file(image: Image.Image) -> bytes:
    """Return an image as a PNG file."""
    file = io.BytesIO()
    image.save(file, format="PNG")
    return file.getvalue()


def in_notebook() -> bool:
    """Return whether code runs in a kernel of Jupyter, whose output takes pictures."""
    ipython = sys.modules.get("IPython")
    shell = ipython and ipython.get_ipython()
    return shell is not None and hasattr(shell, "kernel")


def _has_screen() -> bool:
    if sys.platform in {"win32", "darwin"}:
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))

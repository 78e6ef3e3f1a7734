"""Image files written by commands. No picture code is imported until a picture is drawn."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from voxdisplay.cli.output import note, plural

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from voxdisplay.display.device_info import DeviceInfo
    from voxdisplay.raster.pixel_format import Pixels
    from voxdisplay.view.film import FilmJob
    from voxdisplay.view.save import ExportJob


def save_image(
    path: Path, job: ExportJob | FilmJob, progress: Callable[[int, int], None] | None = None
) -> None:
    """Write an image file.

    Raises
    ------
    click.ClickException
        If the file cannot be written; it names the file.

    """
    from voxdisplay.view.save import save  # noqa: PLC0415 - an extra

    try:
        save(path, job, progress)
    except OSError as error:
        raise cannot_write(path, error) from error


def cannot_write(path: Path, error: OSError) -> click.ClickException:
    """Return the error of an output file that cannot be written."""
    return click.ClickException(f"{path} cannot be written: {error.strerror or error}")


def save_page_image(
    path: Path, page: Pixels, info: DeviceInfo, palette: NDArray[np.uint8] | None
) -> None:
    """Write an image of a page that was read back from a display.

    Parameters
    ----------
    path : Path
    page : ndarray
        Pixels, indexed [z, y, x].
    info : DeviceInfo
    palette : (256, 3) uint8 array or None
        Palette of the frame that was sent. A palette cannot be read back; the display's digest has
        proved both.

    """
    from voxdisplay.view.save import ExportJob  # noqa: PLC0415 - an extra

    title = f"{info.name or 'voxdisplay'} {info.serial}".strip()
    save_image(path, ExportJob(page, info.grid, info.format, title=title, palette=palette))
    lit = int(page.any(axis=-1).sum() if page.ndim == 4 else (page != 0).sum())
    note(f"{path}: {plural(lit, 'voxel')} read back from the display")

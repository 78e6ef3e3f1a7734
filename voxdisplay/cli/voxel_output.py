"""Files of lit voxels that commands write, replaced atomically."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from voxdisplay.cli.image_output import cannot_write
from voxdisplay.cli.output import note
from voxdisplay.files.writing import WRITERS, LitPage, write_voxels
from voxdisplay.view.atomic_write import atomic_write

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from voxdisplay.raster.pixel_format import PixelFormat


def check_suffix(output: Path) -> None:
    """Raise if an output file is of no kind that is written."""
    if output.suffix.lower() not in WRITERS:
        raise click.BadParameter(
            f"{output} should end in {', '.join(WRITERS)}", param_hint="--output"
        )


def save_voxels(output: Path, pixels: NDArray[Any], format_: PixelFormat) -> int:
    """Write what a display shows, and return how many voxels are lit.

    Parameters
    ----------
    output : Path
        Its suffix is one of `WRITERS`.
    pixels : ndarray
        Indexed [z, y, x].
    format_ : PixelFormat
        Theirs; colours of index8 are those of the default palette.

    Raises
    ------
    click.ClickException
        If the file cannot be written; it names the file.

    """
    lit = pixels.any(axis=-1) if pixels.ndim == 4 else pixels != 0
    places = np.argwhere(lit)[:, ::-1]
    colors = format_.rgb(format_.values(pixels[lit]))
    try:
        with atomic_write(output) as unfinished:
            remark = write_voxels(
                unfinished, output.suffix.lower(), LitPage(pixels, places, colors)
            )
    except OSError as failure:
        raise cannot_write(output, failure) from failure
    if remark:
        note(f"{output}: {remark}")
    return len(places)

"""What the commands that draw share: options of a picture, and its file.

Imports no picture code until a picture is drawn: pushing must start fast.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import voxdisplay as vd
from voxdisplay.cli.output import (
    note,
    plural,
)
from voxdisplay.raster.pixel_format import Pixels

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from voxdisplay.view.save import ExportJob

# The keys of voxdisplay.view.save.WRITERS, which is not imported for them.
SUFFIXES = (".png", ".gif", ".mp4", ".html")
_LEAST_PX, _MOST_PX = 16, 4096


class PictureFileType(click.ParamType[Path]):
    """A file whose suffix says what kind of picture it is to be."""

    name = "file"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Check the suffix and the folder, before any work is done for nothing."""
        path = Path(value)
        if path.suffix.lower() not in SUFFIXES:
            self.fail(f"{path} should end in {', '.join(SUFFIXES)}", param, ctx)
        try:
            why = "it is a folder" if path.is_dir() else ""
            why = why or ("" if path.parent.is_dir() else f"there is no folder {path.parent}")
        except OSError as error:
            why = error.strerror or "it cannot be looked up"
        if why:
            self.fail(f"{path} cannot be written: {why}", param, ctx)
        return path


class PictureSizeType(click.ParamType[tuple[int, int]]):
    """A picture's size in pixels, such as 800x600."""

    name = "size"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, int]:
        """Read it, or fail with a message."""
        if isinstance(value, tuple):
            return value
        match = re.fullmatch(r"(\d{1,5})[x,](\d{1,5})", str(value).strip().lower())
        sides = tuple(map(int, match.groups())) if match else ()
        if not sides or not all(_LEAST_PX <= side <= _MOST_PX for side in sides):
            self.fail(
                f"{value!r} is not a size in pixels: write it like 800x600, each side "
                f"{_LEAST_PX} to {_MOST_PX}",
                param,
                ctx,
            )
        return sides[0], sides[1]


class AngleType(click.ParamType[tuple[float, float]]):
    """From where to look, such as -34,24: yaw and pitch in degrees; given in radians."""

    name = "angle"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float]:
        """Read it, or fail with a message."""
        if isinstance(value, tuple):
            return value
        try:
            yaw, pitch = map(float, str(value).split(","))
        except ValueError:
            yaw = pitch = math.nan
        if not (abs(yaw) <= 360 and abs(pitch) <= 90):
            self.fail(
                f"{value!r} is not a view: write yaw,pitch in degrees, like -34,24; "
                "the pitch is -90 to 90",
                param,
                ctx,
            )
        return math.radians(yaw), math.radians(pitch)


view_angle_option = click.option(
    "--view-angle",
    type=AngleType(),
    metavar="YAW,PITCH",
    help="From where to look, in degrees: 0,0 is from the front, x to the right and z up; a "
    "greater pitch looks from above.  [default: -34,24]",
)


def save_picture(
    path: Path, shot: ExportJob, progress: Callable[[int, int], None] | None = None
) -> None:
    """Write a picture; a file that cannot be written is a usage error that names it."""
    from voxdisplay.view.save import save  # noqa: PLC0415 - an extra

    try:
        save(path, shot, progress)
    except OSError as error:
        raise click.ClickException(f"{path} cannot be written: {error.strerror}") from error


def save_page(
    path: Path, page: Pixels, info: vd.DeviceInfo, palette: NDArray[np.uint8] | None
) -> None:
    """Write a picture of what was read back from a display.

    The palette, which cannot be read back, is the frame's: the display's digest has proved both.
    """
    from voxdisplay.view.save import ExportJob  # noqa: PLC0415

    title = f"{info.name or 'voxdisplay'} {info.serial}".strip()
    save_picture(path, ExportJob(page, info.grid, info.format, title=title, palette=palette))
    lit = int(page.any(axis=-1).sum() if page.ndim == 4 else (page != 0).sum())
    note(f"{path}: {plural(lit, 'voxel')} read back from the display")

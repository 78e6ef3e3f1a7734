"""Animations of MagicaVoxel files (.vox) as shows. Must not know displays."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from voxdisplay.errors import BodyError, RecordingError
from voxdisplay.files.contents import MAX_BYTES
from voxdisplay.files.vox_frames import VoxFrames, write_vox_frames
from voxdisplay.frame import Frame
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.shows.fixed_format_show import FixedFormatShow
from voxdisplay.shows.show import Show

_DEFAULT_FPS = 30.0


class VoxAnimation(FixedFormatShow):
    """An animation in a file: a show of rgb888, on a grid of the size of its models.

    Parameters
    ----------
    path : path
    fps : float, optional
        The file does not say.

    Raises
    ------
    RecordingError
        If the file cannot be used.
    OSError
        If it cannot be read.

    """

    pixel_format = PixelFormat.RGB888

    def __init__(self, path: Path, fps: float | None = None) -> None:
        self._path = path
        self.fps = fps or _DEFAULT_FPS
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
        if len(data) > MAX_BYTES:
            raise RecordingError(f"{path.name} is larger than {MAX_BYTES >> 20} MiB")
        try:
            self._frames = VoxFrames(path.name, data)
            self.grid = Grid.of(self._frames.sides)
        except BodyError as error:
            raise RecordingError(str(error)) from error
        except (TypeError, ValueError) as error:
            raise RecordingError(f"{path.name}: {error}") from error
        self.frame_count = self._frames.frame_count

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self._path, self.fps)

    def frame(self, number: int) -> Frame:
        """Return a frame: see `Show.frame`."""
        if not 0 <= number < self.frame_count:
            raise IndexError(f"number is {number}: there are frames 0 to {self.frame_count - 1}")
        try:
            voxels, colors = self._frames.frame(number)
        except BodyError as error:
            raise RecordingError(str(error)) from error
        frame = Frame(self.grid, self.pixel_format)
        values = self.pixel_format.nearest(colors)
        # Black voxels are dark on a display, and models may overlap: the last one counts.
        frame.set_voxels(self.grid.index_of(voxels.astype(np.int64)), values)
        return frame


def write_vox_animation(show: Show, path: Path) -> str | None:
    """Write all frames of a show; return what the file cannot hold, for people.

    Raises
    ------
    RecordingError
        If the grid is too large.
    OSError
        If it cannot be written.

    """
    grid = show.frame(0).grid

    def voxels_of(number: int) -> tuple[Any, Any]:
        frame = show.frame(number)
        return grid.voxels_at(frame.lit()[0]), frame.lit_rgb()

    try:
        return write_vox_frames(path, (grid.nx, grid.ny, grid.nz), show.frame_count, voxels_of)
    except BodyError as error:
        raise RecordingError(
            str(error), hint="record the scene with a smaller --size, or write .npz"
        ) from error

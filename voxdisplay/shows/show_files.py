"""Files that hold moving pictures, by their suffixes.

Must not know displays, nor how a kind of file is read.
"""

from __future__ import annotations

from pathlib import Path

from voxdisplay.errors import RecordingError
from voxdisplay.shows.fixed_format_show import FixedFormatShow
from voxdisplay.shows.recording import Recording

SHOW_SUFFIXES = (".vxs", ".npz", ".vox", ".lcanimraw")
"""Suffixes that `open_show` reads."""


def open_show(path: Path, fps: float | None = None) -> Recording | FixedFormatShow:
    """Open a file of frames.

    Parameters
    ----------
    path : path
    fps : float, optional
        Frames per second, of kinds that do not say (.vox), or may not (.npz).

    Raises
    ------
    RecordingError
        If it is of another kind, or cannot be read.

    """
    suffix = path.suffix.lower()
    try:
        if suffix == ".vxs":
            return Recording(path)
        if suffix == ".npz":
            from voxdisplay.shows.frame_arrays import FrameArrays  # noqa: PLC0415 - each its own

            return FrameArrays(path, fps)
        if suffix == ".vox":
            from voxdisplay.shows.vox_animation import VoxAnimation  # noqa: PLC0415

            return VoxAnimation(path, fps)
        if suffix == ".lcanimraw":
            from voxdisplay.shows.ledcube_animation import LedCubeAnimation  # noqa: PLC0415

            return LedCubeAnimation(path)
    except OSError as error:
        raise RecordingError(f"cannot read {path}: {error.strerror}") from error
    raise RecordingError(f"{path.name} cannot be read: take {' or '.join(SHOW_SUFFIXES)}")

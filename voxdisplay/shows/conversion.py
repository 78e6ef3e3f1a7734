"""Conversion of shows between kinds of files. Must not know displays."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from voxdisplay.errors import RecordingError
from voxdisplay.shows.frame_arrays import write_frames
from voxdisplay.shows.recording_writer import (
    RecordingFormat,
    RecordingWriter,
    drawing_features,
)
from voxdisplay.shows.show import EncodedFrame, Show
from voxdisplay.shows.show_files import open_show

WRITTEN_SUFFIXES = (".npz", ".vxs", ".vox")
"""Suffixes that `write_show` writes."""


def convert_show(source: Path, target: Path, fps: float | None = None) -> int:
    """Convert a file.

    Parameters
    ----------
    source, target : path
        Their suffixes say what they are.
    fps : float, optional
        Frames per second, where the source does not say.

    Returns
    -------
    int
        Number of frames.

    Raises
    ------
    RecordingError
        If a file is of another kind, or cannot be read or written.

    """
    show = open_show(source, fps)
    write_show(show, target)
    return show.frame_count


def write_show(show: Show, target: Path) -> str | None:
    """Write a show of one grid and pixel format; return what the file cannot hold, for people.

    Raises
    ------
    RecordingError
        If the file is of another kind, or cannot be read or written.

    """
    suffix = target.suffix.lower()
    if suffix not in WRITTEN_SUFFIXES:
        raise RecordingError(
            f"{target.name} cannot be written: take {' or '.join(WRITTEN_SUFFIXES)}"
        )
    if not show.frame_count:
        raise RecordingError("there is no whole frame to write")
    try:
        if suffix == ".vox":
            from voxdisplay.shows.vox_animation import write_vox_animation  # noqa: PLC0415 - rare

            return write_vox_animation(show, target)
        if suffix == ".npz":
            write_frames(show, target)
        else:
            _write_recording(show, target)
    except OSError as error:
        raise RecordingError(f"cannot write {target}: {error.strerror}") from error
    return None


def _write_recording(show: Show, target: Path) -> None:
    first = show.frame(0)
    wanted = RecordingFormat(
        first.grid,
        first.format,
        round(show.fps * 1000),
        drawing_features(first.format),
        loop=show.loop,
    )
    with RecordingWriter(target, wanted) as writer:
        for frame in _encoded(show, wanted):
            writer.append(frame)


def _encoded(show: Show, wanted: RecordingFormat) -> Iterator[EncodedFrame]:
    for number in range(show.frame_count):
        frame = show.frame(number)
        payloads = frame.payloads(wanted.max_payload, wanted.features)
        yield EncodedFrame(tuple(payloads), frame.digest())

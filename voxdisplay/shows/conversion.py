"""Conversion of shows between kinds of files. Must not know displays."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

from voxdisplay.errors import RecordingError
from voxdisplay.shows.frame_arrays import FrameArrays, write_frames
from voxdisplay.shows.recording import Recording
from voxdisplay.shows.recording_writer import (
    RecordingFormat,
    RecordingWriter,
    drawing_features,
)
from voxdisplay.shows.show import EncodedFrame

_READ = (".vxs", ".npz")
_WRITTEN = (".npz", ".vxs")


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
    kinds = source.suffix.lower(), target.suffix.lower()
    if kinds[0] not in _READ:
        raise RecordingError(f"{source.name} cannot be read: take {_either(_READ)}")
    if kinds[1] not in _WRITTEN:
        raise RecordingError(f"{target.name} cannot be written: take {_either(_WRITTEN)}")
    if kinds[0] == kinds[1]:
        raise RecordingError(f"{source.name} is a file {kinds[1]} already")
    try:
        if kinds[0] == ".vxs":
            return write_frames(Recording(source), target)
        return _record_arrays(FrameArrays(source, fps), target)
    except OSError as error:
        raise RecordingError(f"cannot read {source}: {error.strerror}") from error


def _either(suffixes: Collection[str]) -> str:
    return " or ".join(suffixes)


def _record_arrays(arrays: FrameArrays, target: Path) -> int:
    features = drawing_features(arrays.format)
    wanted = RecordingFormat(arrays.grid, arrays.format, round(arrays.fps * 1000), features)
    with RecordingWriter(target, wanted) as writer:
        for frame in _encoded(arrays, wanted):
            writer.append(frame)
    return writer.frame_count


def _encoded(arrays: FrameArrays, wanted: RecordingFormat) -> Iterator[EncodedFrame]:
    for frame in arrays.frames():
        payloads = frame.payloads(wanted.max_payload, wanted.features)
        yield EncodedFrame(tuple(payloads), frame.digest())

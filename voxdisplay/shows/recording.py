"""Recordings: shows that are encoded already, read from a file (recording.md).

The index is read at once, frames when they are asked for. Must not know displays or clocks.
"""

from __future__ import annotations

import json
import os
from bisect import bisect
from collections.abc import Collection
from itertools import accumulate
from pathlib import Path
from typing import Any, BinaryIO, Literal

import numpy as np

from voxdisplay.errors import RecordingError, RemoteProtocolError
from voxdisplay.frame import Frame
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.palette import DEFAULT
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.shows import recording_spec
from voxdisplay.shows.recording_conversion import ConvertedShow
from voxdisplay.shows.recording_packets import (
    TIME_UNITS,
    End,
    Segment,
    decode_segment,
    segments,
)
from voxdisplay.shows.recording_scan import RecordedFrame, scan_file, scan_frames
from voxdisplay.shows.recording_writer import RecordingFormat
from voxdisplay.shows.show import EncodedFrame, Show
from voxdisplay.wire import packet, spec
from voxdisplay.wire.op_decoder import decode_ops

# HELLO, INFO and META are within so many bytes of the beginning, END and the last INDEX of the end.
_HEAD_BYTES = 1 << 18
_END_BYTES = 64
_MAX_GAP = 100_000  # missing frames between two that are whole


class Recording:
    """A recording in a file: a show (`shows.show.EncodedShow`) of the device it was made for.

    Parameters
    ----------
    path : path
        Of the file.

    Attributes
    ----------
    format : RecordingFormat
        The device that it was encoded for, rate, and META.
    whole : bool
        False if the file was cut off or its index is damaged: then the frames that are whole have
        been looked for.

    Raises
    ------
    RecordingError
        If the file is no recording, or one of a later version.
    OSError
        If it cannot be read.

    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        with self.path.open("rb") as file:
            self._bytes = os.fstat(file.fileno()).st_size
            self.format, self._first = _read_head(file, self.path)
            end = _read_end(file, self._bytes)
            index = _read_index(file, self._first, end, self._bytes) if end else None
            self.whole = index is not None
            # Numbers of the frames that are there; where one is missing, that before it stays.
            self._numbers: list[int] | None = None
            if index is None:
                index, self._numbers = self._recover(file)
        self._places: list[tuple[int, int]] = index

    def __repr__(self) -> str:
        cut = "" if self.whole else ", cut off"
        return (
            f"<Recording {self.format.grid} {self.format.format.value}, {self.frame_count} frames, "
            f"{self.fps:g} fps{cut}>"
        )

    def __eq__(self, other: object) -> bool:
        """Return whether another recording is of the same file, as far as it has been read."""
        if not isinstance(other, Recording):
            return NotImplemented
        mine, others = (
            (each.path, each.format, each._places, each._numbers)  # noqa: SLF001 - of its kind
            for each in (self, other)
        )
        return mine == others

    def __hash__(self) -> int:
        return hash(self.path)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.path,)

    def _recover(self, file: BinaryIO) -> tuple[list[tuple[int, int]], list[int]]:
        """Return place and number of each frame that is whole."""
        places: list[tuple[int, int]] = []
        numbers: list[int] = []
        for frame in scan_file(file, self._first):
            number = self.format.number_at(frame.header.time)
            before = numbers[-1] if numbers else -1
            # Frames that go back in time, or far ahead of the one before, are no part of the show.
            if before < number <= before + _MAX_GAP:
                places.append((frame.offset, frame.size))
                numbers.append(number)
        return places, numbers

    @property
    def frame_count(self) -> int:
        """Number of frames, those included that are missing between others."""
        if self._numbers is None:
            return len(self._places)
        return self._numbers[-1] + 1 if self._numbers else 0

    @property
    def whole_frames(self) -> int:
        """Number of frames that are whole."""
        return len(self._places)

    @property
    def grid(self) -> Grid:
        """Grid of the displays that it was made for."""
        return self.format.grid

    @property
    def pixel_format(self) -> PixelFormat:
        """Their pixel format."""
        return self.format.format

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self.format.millihertz / 1000

    @property
    def duration(self) -> float:
        """Seconds."""
        return self.format.time_of(self.frame_count) / TIME_UNITS

    @property
    def loop(self) -> bool:
        """True if it is meant to start again at its end."""
        return self.format.loop

    @property
    def bytes(self) -> int:
        """Size of the file."""
        return self._bytes

    def recorded_frame(self, number: int) -> RecordedFrame:
        """Return a frame as it is in the file.

        Raises
        ------
        RecordingError
            If it is damaged.
        OSError
            If the file cannot be read.

        """
        if not 0 <= number < self.frame_count:
            raise IndexError(f"number is {number}: there are frames 0 to {self.frame_count - 1}")
        at = number if self._numbers is None else bisect(self._numbers, number) - 1
        offset, size = self._places[max(at, 0)]
        with self.path.open("rb") as file:  # each time: nothing is left open, nor shared
            file.seek(offset)
            data = file.read(size)
        found = next(scan_frames(segments(data, offset)), None)
        if found is None or (self.whole and found.header.number_mod_256 != number % 256):
            raise RecordingError(
                f"{self.path.name}: frame {number} is damaged",
                hint=f"voxdisplay show repair {self.path.name} keeps the frames that are whole",
            )
        return found

    def frame(self, number: int) -> Frame:
        """Return a frame, decoded; as `Show.frame`.

        Raises
        ------
        RecordingError
            If it is damaged, or draws something else than its digest says.

        """
        found = self.recorded_frame(number)
        grid, format_ = self.format.grid, self.format.format
        try:
            drawn = decode_ops(found.payloads, grid, format_)
        except RemoteProtocolError as error:
            raise RecordingError(f"{self.path.name}: frame {number}: {error}") from error
        palette = None
        if drawn.colors and format_ is PixelFormat.INDEX8:
            palette = DEFAULT.copy()
            palette[list(drawn.colors)] = np.array(list(drawn.colors.values()), dtype=np.uint8)
        frame = Frame(grid, format_, palette=palette)
        frame.set_voxels(drawn.index, drawn.values)
        if frame.digest() != found.header.digest:
            raise RecordingError(
                f"{self.path.name}: frame {number} draws something else than its digest says"
            )
        return frame

    def show_on(
        self, blank: Frame, *, fit: Literal["contain", "none", "content"] = "contain"
    ) -> Show:
        """Return the show for a display: this one, if it is of the same grid and format.

        Parameters
        ----------
        blank, fit
            As of `shows.recording_conversion.ConvertedShow`, which it is else.

        """
        if (blank.grid, blank.format) == (self.format.grid, self.format.format):
            return self
        return ConvertedShow(self, blank, fit)

    def encoded_frame(
        self, number: int, max_payload: int, features: Collection[str]
    ) -> EncodedFrame | None:
        """Return a frame as it is in the file, if a device takes it: as `EncodedShow`."""
        if not set(self.format.features) <= set(features):
            return None
        found = self.recorded_frame(number)
        if max(map(len, found.payloads), default=0) > max_payload:
            return None
        return EncodedFrame(found.payloads, found.header.digest)


def _read_head(file: BinaryIO, path: Path) -> tuple[RecordingFormat, int]:
    """Return the format of a file, and the offset behind its META."""
    data = file.read(_HEAD_BYTES)
    info: packet.Info | None = None
    for segment in segments(data):
        if segment.kind == spec.TYPE_INFO and info is None:
            info = _decode_info(segment, path)
        elif segment.kind == recording_spec.RECORDING_TYPE_META and info is not None:
            return _format(info, segment.payload, path), segment.offset + segment.size
        elif segment.kind in {spec.TYPE_DATA, recording_spec.RECORDING_TYPE_FRAME}:
            break
    raise RecordingError(
        f"{path.name} is no recording: it does not begin with INFO and META",
        hint="recordings are made by: voxdisplay record SCENE -o FILE.vxs",
    )


def _decode_info(segment: Segment, path: Path) -> packet.Info:
    header = bytes((segment.kind << 4, 0, 0))
    try:
        info = packet.decode(header + segment.payload + bytes(4))
    except RemoteProtocolError as error:
        raise RecordingError(f"{path.name}: {error}") from error
    assert isinstance(info, packet.Info)  # noqa: S101 - by its type
    return info


def _format(info: packet.Info, meta: bytes, path: Path) -> RecordingFormat:
    try:
        keys = json.loads(meta)
    except (ValueError, RecursionError) as error:
        raise RecordingError(f"{path.name}: its META is no JSON: {error}") from error
    if not isinstance(keys, dict) or "version" not in keys:
        raise RecordingError(f"{path.name}: its META names no version")
    version = keys.pop("version")
    if version != recording_spec.RECORDING_VERSION:
        raise RecordingError(
            f"{path.name} is a recording of version {version!r}, this program reads version "
            f"{recording_spec.RECORDING_VERSION}",
            hint="update voxdisplay",
        )
    format_ = PixelFormat.from_wire(info.format)
    if info.major != spec.VERSION_MAJOR or format_ is None or not info.refresh:
        raise RecordingError(f"{path.name}: its INFO is of a display that this program lacks")
    if info.has(spec.FEATURE_HOLD):
        raise RecordingError(
            f"{path.name}: its INFO has the feature HOLD, but its FRAMEs say when frames are due",
            hint="record it again without HOLD",
        )
    try:
        grid = Grid.of((info.nx, info.ny, info.nz))
    except (TypeError, ValueError) as error:
        raise RecordingError(f"{path.name}: {error}") from error
    features = tuple(
        name.removeprefix("FEATURE_").lower()
        for name, bit in vars(spec).items()
        if name.startswith("FEATURE_") and info.has(bit)
    )
    loop = keys.pop("loop", False) is True
    max_payload = min(max(info.max_payload, spec.LIMIT_MIN_PAYLOAD), spec.LIMIT_MAX_PAYLOAD)
    return RecordingFormat(grid, format_, info.refresh, features, max_payload, loop, keys)


def _read_end(file: BinaryIO, size: int) -> End | None:
    """Return END, if the file ends with it."""
    begin = max(size - _END_BYTES, 0)
    file.seek(begin)
    tail = file.read(_END_BYTES)
    at = tail.rfind(0, 0, len(tail) - 1) + 1
    if not tail.endswith(b"\0"):
        return None
    last = decode_segment(tail[at:-1], begin + at)
    end = last.end() if last else None
    return end if end and end.index < size else None


def _read_index(file: BinaryIO, first: int, end: End, size: int) -> list[tuple[int, int]] | None:
    """Return place and bytes of all frames; None if the index does not agree with the file."""
    file.seek(end.index)
    sizes: list[int] = []
    begin = first
    for segment in segments(file.read(size - end.index), end.index):
        part = segment.index()
        if not sizes and segment.offset != end.index:
            return None  # bytes were inserted or lost
        if part is None:
            continue
        number, start, counts = part
        if number != len(sizes) or (sizes and start != begin + sum(sizes)):
            return None
        if not sizes:
            begin = start
        sizes += counts
    edges = list(accumulate(sizes, initial=begin))
    if len(sizes) != end.frames or begin < first or edges[-1] != end.index or 0 in sizes:
        return None
    return list(zip(edges, sizes, strict=False))  # the last edge is the end of the last frame

"""Capture files, read back as the segments of both directions. Knows no packet.

The format is that of `voxdisplay.transport.capture`, which writes them.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from voxdisplay.transport.capture import VERSION

HOST: Final = "host"
DEVICE: Final = "device"
_MAX_LINE: Final = 1 << 24  # characters; a longer line is not JSON any more


class CaptureError(ValueError):
    """A file is not a capture; the message names the file and the line."""


@dataclass
class Portion:
    """Bytes as they were written or read at once.

    Attributes
    ----------
    seconds : float
        Time since the capture began.
    to : str
        Receiver of the bytes: `HOST` or `DEVICE`.
    data : bytes

    """

    seconds: float
    to: str
    data: bytes


@dataclass
class Segment:
    """Bytes between two 00 of one direction.

    Attributes
    ----------
    seconds : float
        When its last byte passed; infinite if the capture ends within it.
    to : str
    offset : int
        Position of its first byte in the stream of its direction.
    data : bytes
        Without the 00.

    """

    seconds: float
    to: str
    offset: int
    data: bytes

    @property
    def is_terminated(self) -> bool:
        """True if a 00 ended it."""
        return self.seconds != float("inf")


def read_portions(path: Path) -> Iterator[Portion]:
    """Yield the portions of a capture file.

    Raises
    ------
    CaptureError
        If a line is not one of a capture.
    OSError
        If the file cannot be read.

    """
    with path.open(encoding="utf-8") as file:
        number = 0
        try:
            for number, line in enumerate(iter(lambda: file.readline(_MAX_LINE), ""), 1):
                entry = json.loads(line)
                if number == 1 or "voxdisplay_capture" in entry:
                    _check_version(path, entry["voxdisplay_capture"])
                    continue
                to = {HOST: HOST, DEVICE: DEVICE}[entry["to"]]
                yield Portion(float(entry["s"]), to, bytes.fromhex(entry["hex"]))
        except CaptureError:
            raise
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            place = f"{path}, line {number or 1}"
            raise CaptureError(
                f"{place}: not a line of a capture, which push --capture writes: {error}"
            ) from error
        if not number:
            raise CaptureError(f"{path}: the file is empty")


def _check_version(path: Path, version: object) -> None:
    if version != VERSION:
        raise CaptureError(f"{path}: a capture of version {version!r}; this reads {VERSION}")


@dataclass
class _Stream:
    """Bytes of one direction, split at 00."""

    offset: int = 0
    held: bytearray = field(default_factory=bytearray)

    def feed(self, portion: Portion) -> Iterator[Segment]:
        self.held += portion.data
        *ended, rest = bytes(self.held).split(b"\0")
        for data in ended:
            yield Segment(portion.seconds, portion.to, self.offset, data)
            self.offset += len(data) + 1
        self.held = bytearray(rest)


def split_segments(portions: Iterable[Portion]) -> Iterator[Segment]:
    """Split both directions into segments, in the order in which they ended."""
    streams = {HOST: _Stream(), DEVICE: _Stream()}
    for portion in portions:
        yield from streams[portion.to].feed(portion)
    for to, stream in streams.items():
        if stream.held:
            yield Segment(float("inf"), to, stream.offset, bytes(stream.held))

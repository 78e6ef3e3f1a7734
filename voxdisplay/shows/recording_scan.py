"""Scanner for whole frames in a recording, whatever is between them (recording.md, section 5).

Must not know displays, nor what frames draw.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import BinaryIO, Final

from voxdisplay.shows import recording_spec
from voxdisplay.shows.recording_packets import FrameHeader, Segment, segments
from voxdisplay.wire import spec

_CHUNK_BYTES: Final = 1 << 22  # read at once: longer than any packet


@dataclass(frozen=True, slots=True)
class RecordedFrame:
    """A whole frame of a file.

    Attributes
    ----------
    offset, size : int
        Its place in the file and its bytes there, with packets of other types behind it.
    header : FrameHeader
    payloads : tuple of bytes
    others : tuple of Segment
        Packets of other types among its own and behind them.

    """

    offset: int
    size: int
    header: FrameHeader
    payloads: tuple[bytes, ...]
    others: tuple[Segment, ...]


def scan_file(file: BinaryIO, first: int) -> Iterator[RecordedFrame]:
    """Yield the whole frames of a file from an offset on."""
    return scan_frames(_file_segments(file, first))


def scan_frames(found: Iterable[Segment]) -> Iterator[RecordedFrame]:
    """Yield the frames of which all DATA packets are among packets of a file."""
    parts: _Parts | None = None
    for segment in found:
        header = segment.frame_header()
        if header or segment.kind == recording_spec.RECORDING_TYPE_INDEX:
            if parts and parts.whole:
                yield parts.frame()
            parts = _Parts(header, segment) if header else None
        elif parts:
            parts.take(segment)
    if parts and parts.whole:
        yield parts.frame()


def _file_segments(file: BinaryIO, first: int) -> Iterator[Segment]:
    file.seek(first)
    rest, offset = b"", first
    while data := file.read(_CHUNK_BYTES):
        rest += data
        end = rest.rfind(0) + 1
        yield from segments(rest[:end], offset)
        rest, offset = rest[end:], offset + end
        if len(rest) > _CHUNK_BYTES:
            rest, offset = b"", offset + len(rest)


class _Parts:
    """Packets of a frame so far.

    Attributes
    ----------
    whole : bool
        True if no more packets are missing.

    """

    def __init__(self, header: FrameHeader, segment: Segment) -> None:
        self.whole = False
        self._header = header
        self._offset = segment.offset
        self._end = segment.offset + segment.size
        self._left = header.size
        self._damaged = False
        self._next_seq: int | None = None
        self._payloads: list[bytes] = []
        self._others: list[Segment] = []

    def take(self, segment: Segment) -> None:
        """Take the next packet of the file."""
        self._end = segment.offset + segment.size
        if segment.kind != spec.TYPE_DATA:
            self._others.append(segment)
            return
        self._left -= len(segment.payload)
        self._damaged |= (
            self.whole
            or self._left < 0
            or segment.frame != self._header.number_mod_256
            or self._next_seq not in {None, segment.seq}
            or not segment.flags & spec.DATA_FLAG_CLEAR
        )
        self._next_seq = (segment.seq + 1) % 256
        self._payloads.append(segment.payload)
        committed = bool(segment.flags & spec.DATA_FLAG_COMMIT)
        self.whole = committed and not self._left and not self._damaged
        self._damaged |= committed and not self.whole

    def frame(self) -> RecordedFrame:
        """Return the frame, which must be whole."""
        size = self._end - self._offset
        return RecordedFrame(
            self._offset, size, self._header, tuple(self._payloads), tuple(self._others)
        )

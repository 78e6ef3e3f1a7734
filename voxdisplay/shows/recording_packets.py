"""Packets of a recording: serialisation, and segments of a file (recording.md, sections 1 to 5).

Must not know files as a whole, nor what ops draw.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from cobs import cobs

from voxdisplay.shows import recording_spec
from voxdisplay.wire import spec
from voxdisplay.wire.packet import has_valid_crc

TIME_UNITS: Final = 10_000
"""Units of time in a second."""

_HEADER: Final = 3
_CODES = {1: "B", 2: "H", 4: "I", 8: "Q"}
_CRC = struct.Struct("<I")


def _body(layout: spec.Layout) -> struct.Struct:
    return struct.Struct("<" + "".join(_CODES[size] for _, _, size in layout))


_FRAME = _body(recording_spec.LAYOUT_FRAME)
_INDEX = _body(recording_spec.LAYOUT_INDEX)
_END = _body(recording_spec.LAYOUT_END)
_SIZE = struct.Struct("<I")
_MAX_U32 = 0xFFFF_FFFF


def encode_segment(kind: int, flags: int, seq: int, frame: int, payload: bytes) -> bytes:
    """Return the bytes of a packet in a file: COBS-encoded, with the 00 behind it."""
    data = bytes((kind << 4 | flags, seq, frame)) + payload
    return bytes(cobs.encode(data + _CRC.pack(zlib.crc32(data)))) + b"\0"


@dataclass(frozen=True, slots=True)
class FrameHeader:
    """FRAME: when a frame is due, and how to check it.

    Attributes
    ----------
    number_mod_256 : int
        Its number, modulo 256.
    time : int
        When it is due, in units of 0.1 ms.
    digest : int
        Digest of the page that shows it.
    size : int
        Bytes of its payloads together.
    key : bool
        True if it does not depend on frames before.

    """

    number_mod_256: int
    time: int
    digest: int
    size: int
    key: bool = True

    def encode(self) -> bytes:
        """Return its bytes in the file."""
        flags = recording_spec.RECORDING_FLAG_KEY if self.key else 0
        body = _FRAME.pack(self.time, self.digest, self.size, 0)
        return encode_segment(
            recording_spec.RECORDING_TYPE_FRAME, flags, 0, self.number_mod_256, body
        )


@dataclass(frozen=True, slots=True)
class End:
    """END: where the index is, and what there is.

    Attributes
    ----------
    index : int
        Offset of the first INDEX in the file; of END if there is none.
    frames : int
        Number of frames.
    duration : int
        In units of 0.1 ms.

    """

    index: int
    frames: int
    duration: int

    def encode(self) -> bytes:
        """Return its bytes in the file."""
        return encode_segment(
            recording_spec.RECORDING_TYPE_END,
            recording_spec.RECORDING_FLAG_LAST,
            0,
            0,
            _END.pack(self.index, self.frames, self.duration),
        )


@dataclass(frozen=True, slots=True)
class Segment:
    """A packet of a file.

    Attributes
    ----------
    offset, size : int
        Its place in the file and its bytes there, with the 00.
    kind, flags, seq, frame : int
        Its header.
    payload : bytes

    """

    offset: int
    size: int
    kind: int
    flags: int
    seq: int
    frame: int
    payload: bytes

    def frame_header(self) -> FrameHeader | None:
        """Return the FRAME that it is, or None."""
        if self.kind != recording_spec.RECORDING_TYPE_FRAME or len(self.payload) < _FRAME.size:
            return None
        time, digest, size, _ = _FRAME.unpack_from(self.payload)
        key = bool(self.flags & recording_spec.RECORDING_FLAG_KEY)
        return FrameHeader(self.frame, time, digest, size, key)

    def end(self) -> End | None:
        """Return the END that it is, or None."""
        last = self.flags & recording_spec.RECORDING_FLAG_LAST
        if self.kind != recording_spec.RECORDING_TYPE_END or not last:
            return None
        return End(*_END.unpack_from(self.payload)) if len(self.payload) >= _END.size else None

    def index(self) -> tuple[int, int, list[int]] | None:
        """Return number and offset of the first frame, and the bytes of each, of an INDEX."""
        if self.kind != recording_spec.RECORDING_TYPE_INDEX or self.end() is not None:
            return None
        if len(self.payload) < _INDEX.size:
            return None
        first, start = _INDEX.unpack_from(self.payload)
        whole = (len(self.payload) - _INDEX.size) // _SIZE.size
        sizes = struct.unpack_from(f"<{whole}I", self.payload, _INDEX.size)
        return first, start, [size >> 1 for size in sizes]


def encode_index(start: int, sizes: list[int], max_payload: int) -> list[bytes]:
    """Return the INDEX packets of frames.

    Parameters
    ----------
    start : int
        Offset of the first frame in the file.
    sizes : list of int
        Bytes of each frame in the file. All are KEY frames.
    max_payload : int
        Longest payload.

    Raises
    ------
    ValueError
        If a frame is too large for an INDEX.

    """
    each = (max_payload - _INDEX.size) // _SIZE.size
    packets = []
    for first in range(0, len(sizes), each):
        part = sizes[first : first + each]
        words = [size << 1 | 1 for size in part]
        if max(words) > _MAX_U32:
            raise ValueError("a frame has more than 2 GB: take a smaller picture")
        body = _INDEX.pack(first, start) + struct.pack(f"<{len(words)}I", *words)
        packets.append(encode_segment(recording_spec.RECORDING_TYPE_INDEX, 0, 0, 0, body))
        start += sum(part)
    return packets


def decode_segment(data: bytes, offset: int) -> Segment | None:
    """Return the packet of a segment without its 00; None if it is none or is damaged.

    Parameters
    ----------
    data : bytes
        From behind a 00 to before the next.
    offset : int
        Of its first byte in the file.

    """
    if len(data) < spec.LIMIT_MIN_SEGMENT:
        return None
    try:
        raw = bytes(cobs.decode(data))
    except cobs.DecodeError:
        return None
    if len(raw) > spec.LIMIT_MAX_PAYLOAD + spec.LIMIT_OVERHEAD or not has_valid_crc(raw):
        return None
    payload = raw[_HEADER : -_CRC.size]
    return Segment(offset, len(data) + 1, raw[0] >> 4, raw[0] & 15, raw[1], raw[2], payload)


def segments(data: bytes, offset: int = 0) -> Iterator[Segment]:
    """Yield the packets in bytes of a file, without what is none or damaged.

    Parameters
    ----------
    data : bytes
        Bytes of a file from the beginning of a segment on.
    offset : int
        Of the first byte in the file.

    """
    at = 0
    while (end := data.find(0, at)) >= 0:
        found = decode_segment(data[at:end], offset + at)
        if found:
            yield found
        at = end + 1

"""Packet encoding and parsing, sections 3 and 4 of protocol.md, in their simplest form.

A host's packet is written as its *body*: header and payload, as in the dialogues of section 17.5.
Nothing is validated on the way out: the kit must be able to send invalid packets.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

from voxdisplay.wire import spec

CLEAR, COMMIT = spec.DATA_FLAG_CLEAR, spec.DATA_FLAG_COMMIT
BACK = spec.READ_FLAG_BACK
SHOWN, PENDING, ASKED = spec.ACK_FLAG_SHOWN, spec.ACK_FLAG_PENDING, spec.ACK_FLAG_ASKED

HEADER_BYTES = 3
CHECK_BYTES = 4
_SIZES = {1: "B", 2: "H", 4: "I"}
LAYOUTS = {
    spec.TYPE_ACK: spec.LAYOUT_ACK,
    spec.TYPE_INFO: spec.LAYOUT_INFO,
    spec.TYPE_PAGE: spec.LAYOUT_PAGE,
    spec.TYPE_ERROR: spec.LAYOUT_ERROR,
}
_STRUCTS = {
    kind: struct.Struct("<" + "".join(_SIZES[size] for _, _, size in layout))
    for kind, layout in LAYOUTS.items()
}
TYPE_NAMES = {
    value: name.removeprefix("TYPE_") for name, value in vars(spec).items() if name[:5] == "TYPE_"
}
CODE_NAMES = {
    value: name.removeprefix("CODE_") for name, value in vars(spec).items() if name[:5] == "CODE_"
}
_FLAG_NAMES = {
    spec.TYPE_DATA: {CLEAR: "CLEAR", COMMIT: "COMMIT"},
    spec.TYPE_READ: {BACK: "BACK"},
    spec.TYPE_PAGE: {BACK: "BACK"},
    spec.TYPE_ACK: {SHOWN: "SHOWN", PENDING: "PENDING", ASKED: "ASKED"},
}


# -- packets of a host


def body(kind: int, flags: int = 0, seq: int = 0, frame: int = 0, payload: bytes = b"") -> bytes:
    """Return header and payload of any packet."""
    return bytes((kind << 4 | flags, seq & 255, frame & 255)) + payload


def hello(session: int, major: int = spec.VERSION_MAJOR, more: bytes = b"\0\0") -> bytes:
    """Return a HELLO; ``more`` is all that follows its session."""
    return body(spec.TYPE_HELLO, payload=struct.pack("<BH", major, session) + more)


def data(seq: int, frame: int, ops: bytes = b"", flags: int = CLEAR) -> bytes:
    """Return a DATA packet."""
    return body(spec.TYPE_DATA, flags, seq, frame, ops)


def status(tag: int) -> bytes:
    """Return a STATUS."""
    return body(spec.TYPE_STATUS, seq=tag)


def read(start: int, count: int, tag: int = 0, flags: int = 0, reserved: int = 0) -> bytes:
    """Return a READ."""
    return body(spec.TYPE_READ, flags, tag, payload=struct.pack("<BII", reserved, start, count))


# -- the wire


def cobs_encode(packet: bytes) -> bytes:
    """COBS-encode a packet, without the 00 delimiter."""
    out, group = bytearray(), bytearray()
    for byte in packet:
        if len(group) == 254:
            out += b"\xff" + group
            group.clear()
        if byte:
            group.append(byte)
        else:
            out += bytes((len(group) + 1,)) + group
            group.clear()
    return bytes(out) + bytes((len(group) + 1,)) + group


def cobs_decode(segment: bytes) -> bytes | None:
    """COBS-decode a segment; return None if a code byte asks for more bytes than there are."""
    out, at = bytearray(), 0
    while at < len(segment):
        code = segment[at]
        if at + code > len(segment):
            return None
        out += segment[at + 1 : at + code]
        at += code
        if code < 255 and at < len(segment):
            out.append(0)
    return bytes(out)


def encode(packet: bytes) -> bytes:
    """Return the wire form of a body: with check value, COBS-encoded, and delimited by 00."""
    return cobs_encode(packet + zlib.crc32(packet).to_bytes(CHECK_BYTES, "little")) + b"\0"


def max_encoded_bytes(payload: int) -> int:
    """Return the most bytes that a packet with a payload of this size can have on the wire."""
    size = payload + spec.LIMIT_OVERHEAD
    return size + -(-size // 254) + 1


def decode_segment(segment: bytes, longest: int = spec.LIMIT_MAX_PAYLOAD) -> bytes | None:
    """Return the body in a segment of at least 8 bytes; None if it is damaged."""
    packet = cobs_decode(segment)
    if packet is None or not spec.LIMIT_OVERHEAD <= len(packet) <= longest + spec.LIMIT_OVERHEAD:
        return None
    inner = packet[:-CHECK_BYTES]
    return inner if zlib.crc32(inner) == int.from_bytes(packet[-CHECK_BYTES:], "little") else None


def count_damaged(stream: bytes, longest: int) -> int:
    """Return the number of damaged segments, section 3, of a stream that ends with 00."""
    return sum(
        len(segment) >= spec.LIMIT_MIN_SEGMENT and decode_segment(segment, longest) is None
        for segment in stream.split(b"\0")
    )


# -- packets of a device


class NoSuchFieldError(AttributeError):
    """The response is of another type, which does not have the field that was read."""


@dataclass(frozen=True, slots=True)
class Response:
    """A packet of a device. The fields of its type's layout are attributes.

    In an ACK, ``next`` is another name for ``seq``.
    """

    body: bytes

    @property
    def kind(self) -> int:
        """Packet type, section 4."""
        return self.body[0] >> 4

    @property
    def flags(self) -> int:
        """Flags of the type."""
        return self.body[0] & 15

    @property
    def seq(self) -> int:
        """Byte 1 of the header."""
        return self.body[1]

    @property
    def frame(self) -> int:
        """Byte 2 of the header."""
        return self.body[2]

    @property
    def tail(self) -> bytes:
        """Bytes behind the fields of the layout."""
        return self.body[HEADER_BYTES + _STRUCTS[self.kind].size :]

    @property
    def is_complete(self) -> bool:
        """True if it is of a device's type and long enough for that type's fields."""
        layout = _STRUCTS.get(self.kind)
        return layout is not None and len(self.body) >= HEADER_BYTES + layout.size

    def __getattr__(self, name: str) -> int:
        if name == "next":
            return self.seq
        if name == "body" or name.startswith("__"):  # looked up by pickle and copy before it is set
            raise AttributeError(name)
        layout = LAYOUTS.get(self.kind, ())
        for (field, _, _), value in zip(layout, self._values(), strict=True):
            if field == name:
                return int(value)
        raise NoSuchFieldError(f"no field {name!r} in {self}")

    def _values(self) -> tuple[int, ...]:
        layout = _STRUCTS.get(self.kind)
        return layout.unpack_from(self.body, HEADER_BYTES) if layout else ()

    def __str__(self) -> str:
        return describe(self.body)


def describe(packet: bytes) -> str:
    """Return a body in words, such as ``DATA CLEAR|COMMIT seq 3 frame 1``."""
    kind, flags = packet[0] >> 4, packet[0] & 15
    names = [name for bit, name in _FLAG_NAMES.get(kind, {}).items() if flags & bit]
    rest = flags & ~sum(bit for bit in _FLAG_NAMES.get(kind, {}) if flags & bit)
    words = [TYPE_NAMES.get(kind, f"type {kind}")]
    if names or rest:
        words.append("|".join(names + ([f"flags {rest:X}"] if rest else [])))
    words.append(f"{'next' if kind == spec.TYPE_ACK else 'seq'} {packet[1]} frame {packet[2]}")
    answer = Response(packet)
    if answer.is_complete:
        for (field, _, size), value in zip(LAYOUTS[kind], answer._values(), strict=True):  # noqa: SLF001
            if field == "code":
                words.append(f"code {CODE_NAMES.get(value, value)}")
            elif field != "reserved":
                is_hex = field in {"session", "boot", "received", "digest", "features"}
                words.append(f"{field} {value:0{2 * size}X}h" if is_hex else f"{field} {value}")
        if kind == spec.TYPE_ERROR and answer.tail:
            words.append(repr(answer.tail[:60].decode(errors="replace")))
    elif kind == spec.TYPE_HELLO and len(packet) >= HEADER_BYTES + 3:
        words.append(f"major {packet[3]} session {packet[5]:02X}{packet[4]:02X}h")
    elif kind == spec.TYPE_READ and len(packet) >= HEADER_BYTES + 9:
        words.append("start {} count {}".format(*struct.unpack_from("<II", packet, 4)))
    return " ".join(words)

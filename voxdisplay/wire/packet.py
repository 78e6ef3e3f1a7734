"""Packet types and their serialisation (protocol.md, sections 3 to 5 and 9 to 11).

Each type is a frozen dataclass whose fields have the document's names. `encode` returns the bytes
on the wire; `decode` takes a packet that `packet_stream` has delimited and checked. Must not know
packets in flight, nor what ops draw.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, fields
from typing import Any, ClassVar, TypeAlias, TypeVar

from cobs import cobs

from voxdisplay.errors import RemoteProtocolError
from voxdisplay.wire import spec

_CODES = {1: "B", 2: "H", 4: "I"}
_CRC = struct.Struct("<I")
_HEADER_BYTES = 3
# Bytes of an INFO of another major version that are defined: up to its boot id (section 15).
_FOREIGN_BYTES = 8 - _HEADER_BYTES


@dataclass(frozen=True, slots=True, kw_only=True)
class Packet:
    """Base of all packets: the header of section 4."""

    TYPE: ClassVar[int]
    SECTION: ClassVar[str]
    LAYOUT: ClassVar[spec.Layout] = ()
    BODY: ClassVar[struct.Struct] = struct.Struct("<")

    seq: int = 0
    frame: int = 0
    flags: int = 0

    def tail(self) -> bytes:
        """Return the bytes after the fields of the layout."""
        return b""

    @classmethod
    def read_tail(cls, tail: bytes, offset: int) -> dict[str, Any]:
        """Return the fields after those of the layout; their offset in the packet is given."""
        del tail, offset
        return {}


_P = TypeVar("_P", bound=Packet)


def _packet_type(kind: int, section: str, layout: spec.Layout = ()) -> Any:
    """Return a decorator that makes a dataclass a packet type: number, section and layout."""

    def finish(cls: type[_P]) -> type[_P]:
        cls.TYPE, cls.SECTION, cls.LAYOUT = kind, section, layout
        cls.BODY = struct.Struct("<" + "".join(_CODES[size] for _, _, size in layout))
        return cls

    return finish


@_packet_type(spec.TYPE_DATA, "6")
@dataclass(frozen=True, slots=True, kw_only=True)
class Data(Packet):
    """Ops for the back page."""

    ops: bytes = b""

    def tail(self) -> bytes:
        """See `Packet.tail`."""
        return self.ops

    @classmethod
    def read_tail(cls, tail: bytes, offset: int) -> dict[str, Any]:
        """See `Packet.read_tail`."""
        del offset
        return {"ops": tail}


@_packet_type(spec.TYPE_HELLO, "5", spec.LAYOUT_HELLO)
@dataclass(frozen=True, slots=True, kw_only=True)
class Hello(Packet):
    """Opening of a session, from the host."""

    session: int
    major: int = spec.VERSION_MAJOR
    minor: int = spec.VERSION_MINOR


@_packet_type(spec.TYPE_STATUS, "9")
@dataclass(frozen=True, slots=True, kw_only=True)
class Status(Packet):
    """Request for an ACK; ``seq`` is the tag."""


@_packet_type(spec.TYPE_READ, "10", spec.LAYOUT_READ)
@dataclass(frozen=True, slots=True, kw_only=True)
class Read(Packet):
    """Request for the pixels of a range of indices; ``seq`` is the tag."""

    start: int
    count: int


@_packet_type(spec.TYPE_ACK, "9", spec.LAYOUT_ACK)
@dataclass(frozen=True, slots=True, kw_only=True)
class Ack(Packet):
    """Acknowledgement: packets received, credit, and the frame shown."""

    last: int
    session: int
    boot: int
    received: int
    credit: int
    digest: int
    damaged: int

    @property
    def next(self) -> int:
        """Lowest sequence number that has not been received (cumulative ACK)."""
        return self.seq

    @property
    def shown(self) -> int | None:
        """Id of the frame on display; None if this session has shown none."""
        return self.frame if self.flags & spec.ACK_FLAG_SHOWN else None


@_packet_type(spec.TYPE_INFO, "5", spec.LAYOUT_INFO)
@dataclass(frozen=True, slots=True, kw_only=True)
class Info(Packet):
    """Answer to HELLO: grid, format, limits, features and names of the device."""

    major: int
    session: int
    boot: int
    minor: int
    format: int
    nx: int
    ny: int
    nz: int
    pages: int
    max_payload: int
    rx_buffer: int
    refresh: int
    features: int
    name: str = ""
    firmware: str = ""
    serial: str = ""

    def has(self, feature: int) -> bool:
        """Return whether the device announced a feature, ``spec.FEATURE_...``."""
        return bool(self.features >> feature & 1)

    def tail(self) -> bytes:
        """See `Packet.tail`."""
        texts = (text.encode() for text in (self.name, self.firmware, self.serial))
        return b"".join(bytes((len(text),)) + text for text in texts)

    @classmethod
    def read_tail(cls, tail: bytes, offset: int) -> dict[str, Any]:
        """See `Packet.read_tail`."""
        texts = {}
        at = 0
        for name in ("name", "firmware", "serial"):
            end = at + 1 + tail[at] if at < len(tail) else len(tail) + 1
            if end > len(tail):
                raise RemoteProtocolError(
                    f"INFO ends inside its string {name!r}", section="5", offset=offset + at
                )
            texts[name] = tail[at + 1 : end].decode(errors="replace")
            at = end
        return texts


@_packet_type(spec.TYPE_PAGE, "10", spec.LAYOUT_PAGE)
@dataclass(frozen=True, slots=True, kw_only=True)
class Page(Packet):
    """Answer to READ: pixels of a range of indices, as ops."""

    start: int
    count: int
    ops: bytes = b""

    def tail(self) -> bytes:
        """See `Packet.tail`."""
        return self.ops

    @classmethod
    def read_tail(cls, tail: bytes, offset: int) -> dict[str, Any]:
        """See `Packet.read_tail`."""
        del offset
        return {"ops": tail}


@_packet_type(spec.TYPE_ERROR, "11", spec.LAYOUT_ERROR)
@dataclass(frozen=True, slots=True, kw_only=True)
class Error(Packet):
    """Refusal of a packet: code, and offset in it."""

    code: int
    session: int
    offset: int
    text: str = ""

    def tail(self) -> bytes:
        """See `Packet.tail`."""
        return self.text.encode()

    @classmethod
    def read_tail(cls, tail: bytes, offset: int) -> dict[str, Any]:
        """See `Packet.read_tail`."""
        del offset
        return {"text": tail.decode(errors="replace")}


AnyPacket: TypeAlias = Data | Hello | Status | Read | Ack | Info | Page | Error
TYPES: dict[int, type[Packet]] = {
    cls.TYPE: cls for cls in (Data, Hello, Status, Read, Ack, Info, Page, Error)
}


def pack(packet: Packet) -> bytes:
    """Return the bytes of a packet with its CRC, before COBS."""
    body = packet.BODY.pack(*(getattr(packet, name, 0) for name, _, _ in packet.LAYOUT))
    head = bytes((packet.TYPE << 4 | packet.flags, packet.seq, packet.frame))
    data = head + body + packet.tail()
    return data + _CRC.pack(zlib.crc32(data))


def encode(packet: Packet) -> bytes:
    """Return the bytes of a packet on the wire: COBS-encoded, with the 00 delimiter (section 3)."""
    return bytes(cobs.encode(pack(packet))) + b"\0"


def max_wire_bytes(size: int) -> int:
    """Return the most bytes on the wire of a packet of ``size`` bytes, CRC included.

    That is the packet, a COBS code byte for every 254 bytes of it, and the 00.
    """
    return size + -(-size // 254) + 1


def has_valid_crc(raw: bytes) -> bool:
    """Return whether decoded bytes are a packet: long enough, with a valid CRC."""
    return (
        len(raw) >= spec.LIMIT_OVERHEAD
        and zlib.crc32(raw[: -_CRC.size]) == _CRC.unpack_from(raw, len(raw) - _CRC.size)[0]
    )


def decode(raw: bytes) -> Packet:
    """Return the packet of decoded bytes whose CRC is valid: header, payload and CRC.

    Raises
    ------
    RemoteProtocolError
        If the type is unknown, or the payload too short for it.

    """
    kind = raw[0] >> 4
    cls = TYPES.get(kind)
    if cls is None:
        raise RemoteProtocolError(f"packet of unknown type {kind}", section="4", raw=raw)
    payload = raw[_HEADER_BYTES : -_CRC.size]
    size = cls.BODY.size
    if cls is Info and len(payload) >= _FOREIGN_BYTES and payload[0] != spec.VERSION_MAJOR:
        payload = payload[:_FOREIGN_BYTES].ljust(size + 3, b"\0")  # 3: its strings, empty
    if len(payload) < size:
        raise RemoteProtocolError(
            f"{cls.__name__.upper()} has {len(payload)} bytes of payload, fewer than {size}",
            section=cls.SECTION,
            offset=_HEADER_BYTES + len(payload),
            raw=raw,
        )
    known = {field.name for field in fields(cls)}
    values = zip((name for name, _, _ in cls.LAYOUT), cls.BODY.unpack_from(payload), strict=True)
    try:
        tail = cls.read_tail(payload[size:], _HEADER_BYTES + size)
    except RemoteProtocolError as error:
        error.raw = raw
        raise
    return cls(
        seq=raw[1],
        frame=raw[2],
        flags=raw[0] & 0x0F,
        **{name: value for name, value in values if name in known},
        **tail,
    )

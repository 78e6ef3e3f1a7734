"""Packet types (protocol.md, 4, 5, 9 to 11), beyond the vectors of the document."""

import document
import pytest

from voxdisplay.errors import RemoteProtocolError
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec

INFO = packets.Info(
    major=1, session=2, boot=3, minor=4, format=2, nx=5, ny=6, nz=7, pages=2, max_payload=64,
    rx_buffer=512, refresh=9, features=1 << spec.FEATURE_READ, name="würfel", firmware="1",
    serial="",
)  # fmt: skip


def with_crc(body):
    return document.cobs_decode(document.on_wire(body)[:-1])


@pytest.mark.parametrize("cls", packets.TYPES.values(), ids=lambda cls: cls.__name__)
def test_a_payload_that_is_too_short_for_its_type(cls):
    """12: "the device broke the protocol"."""
    for size in range(cls.BODY.size):
        body = bytes((cls.TYPE << 4, 0, 0)) + bytes((1,)) * size  # an INFO of our own major
        with pytest.raises(RemoteProtocolError, match=cls.__name__.upper()) as caught:
            packets.decode(with_crc(body))
        assert caught.value.section == cls.SECTION
        assert caught.value.offset == 3 + size
        assert caught.value.raw == with_crc(body)


@pytest.mark.parametrize("kind", sorted(set(range(16)) - set(packets.TYPES)))
def test_a_type_that_is_not_known(kind):
    with pytest.raises(RemoteProtocolError, match=f"type {kind}"):
        packets.decode(with_crc(bytes((kind << 4, 0, 0, 1, 2, 3))))


def test_an_info_cut_off_in_its_strings():
    body = packets.pack(INFO)[:-4]
    assert packets.decode(with_crc(body)) == INFO
    strings = 1 + len("würfel".encode()) + 2 + 1
    for lost in range(1, strings + 1):
        with pytest.raises(RemoteProtocolError, match="ends inside its string") as caught:
            packets.decode(with_crc(body[:-lost]))
        assert caught.value.offset <= len(body) - lost
        assert caught.value.raw == with_crc(body[:-lost])


def test_bytes_behind_the_last_string_are_ignored():
    """5: "A host MUST ignore bytes after the last string"."""
    assert packets.decode(with_crc(packets.pack(INFO)[:-4] + b"more")) == INFO


@pytest.mark.parametrize("size", [8, 9, 20, 60])
def test_an_info_of_another_major_is_known_by_its_first_eight_bytes(size):
    """15: "Another major may change all else"."""
    body = (bytes.fromhex("90 00 00 02 17 5A 07 B0") + b"\xff" * 60)[:size]
    info = packets.decode(with_crc(body))
    assert (info.major, info.session, info.boot) == (2, 0x5A17, 0xB007)
    assert (info.rx_buffer, info.name) == (0, "")


def test_text_that_is_no_utf_8_is_no_error():
    error = packets.decode(with_crc(bytes.fromhex("B0 00 00 0C 00 00 00 00 61 FF")))
    assert error.text == "a\N{REPLACEMENT CHARACTER}"


def test_flags_and_features():
    ack = packets.Ack(
        seq=9, frame=7, flags=spec.ACK_FLAG_SHOWN, last=8, session=1, boot=1, received=0, credit=1,
        digest=0, damaged=0,
    )  # fmt: skip
    assert (ack.next, ack.shown) == (9, 7)
    assert packets.Ack(**{**as_dict(ack), "flags": 0}).shown is None
    assert INFO.has(spec.FEATURE_READ)
    assert not INFO.has(spec.FEATURE_DIGEST)


def as_dict(packet):
    return {name: getattr(packet, name) for name in ("seq", "frame", "flags", "last", "session",
            "boot", "received", "credit", "digest", "damaged")}  # fmt: skip


@pytest.mark.parametrize("raw", [b"", b"123456", with_crc(b"\x40\0\0")[:-1], bytes(7)])
def test_what_is_no_packet_is_not_intact(raw):
    assert not packets.has_valid_crc(raw)


@pytest.mark.parametrize("size", [1, 7, 8, 253, 254, 255, 507, 508, 509, 65542])
def test_the_most_bytes_on_the_wire(size):
    """3: a code byte for each group of at most 254 bytes, and the 00."""
    worst = max(
        len(document.cobs_encode(body)) + 1
        for body in (b"\xff" * size, bytes(size), b"\0" + b"\xff" * (size - 1))
    )
    assert packets.max_wire_bytes(size) == worst

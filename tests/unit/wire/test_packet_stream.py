"""Packet reader: delimiting, CRC and resynchronisation (protocol.md, section 3)."""

import document
import pytest

from voxdisplay.errors import RemoteProtocolError
from voxdisplay.wire import packet as packets
from voxdisplay.wire import packet_stream as streams
from voxdisplay.wire.packet_stream import PacketStream

STATUS = packets.Status(seq=119)
WIRE = packets.encode(STATUS)


def feed_all(*pieces):
    stream = PacketStream()
    found = [packet for piece in pieces for packet in stream.feed(piece)]
    return stream, found


def test_an_empty_segment_is_nothing():
    stream, found = feed_all(b"\0\0\0" + WIRE + b"\0\0" + WIRE)
    assert found == [STATUS, STATUS]
    assert (stream.counters.damaged, stream.counters.noise_bytes) == (0, 0)


@pytest.mark.parametrize("size", range(1, 8))
def test_a_segment_that_cannot_hold_a_packet_is_not_counted_as_damaged(size):
    stream, found = feed_all(b"\x11" * size + b"\0" + WIRE)
    assert found == [STATUS]
    assert (stream.counters.damaged, stream.counters.noise_bytes) == (0, size)
    assert stream.noise == b"\x11" * size


@pytest.mark.parametrize(
    "segment",
    [
        b"\x09" + b"\x11" * 7,  # its code byte asks for more than there is
        b"\x08" + b"\x11" * 7,  # the check value does not hold
        b"\x01" * 8,
    ],
)
def test_a_damaged_segment_is_counted_and_dropped(segment):
    stream, found = feed_all(segment + b"\0" + WIRE)
    assert found == [STATUS]
    assert (stream.counters.damaged, stream.counters.noise_bytes) == (1, 8)
    assert stream.counters.packets == 1


def test_an_unknown_type_is_counted_and_dropped():
    """12: unknown type: "drops and counts it"."""
    stream, found = feed_all(document.on_wire(b"\x70\0\0later") + WIRE)
    assert found == [STATUS]
    assert stream.counters.unknown == 1
    assert stream.counters.damaged == 0


def test_the_longest_packet_is_taken_and_a_longer_one_is_not():
    """4: "A host MUST take every packet of up to 65542 bytes"."""
    longest = packets.Data(ops=b"\x11" * 65535)
    stream, found = feed_all(
        packets.encode(longest), packets.encode(packets.Data(ops=b"\x11" * 65536))
    )
    assert found == [longest]
    assert stream.counters.damaged == 1


def test_what_is_behind_a_packet_that_breaks_the_protocol_is_not_lost():
    stream = PacketStream()
    short = document.on_wire(bytes.fromhex("80 00 00 01 02"))
    with pytest.raises(RemoteProtocolError, match="ACK"):
        list(stream.feed(WIRE + short + WIRE))
    assert list(stream.feed(b"")) == [STATUS]
    assert stream.counters.packets == 3


def test_memory_is_bounded_and_the_next_packet_is_received():
    stream = PacketStream()
    for _ in range(100):
        assert list(stream.feed(b"\xaa" * 40_000)) == []
        assert len(stream._segment) < 120_000
    assert list(stream.feed(b"\0" + WIRE)) == [STATUS]
    assert stream.counters.damaged == 1
    assert stream.counters.noise_bytes == 4_000_000
    assert stream.noise == b"\xaa" * 64


def test_the_end_of_an_overlong_segment_is_no_packet():
    stream, found = feed_all(b"\xaa" * 200_000, WIRE + WIRE)
    assert found == [STATUS]
    assert stream.counters.damaged == 1


def test_noise_is_told_before_it_ends():
    assert feed_all(b"boot> ")[0].noise == b"boot> "
    assert (
        feed_all(b"Hello, this is a console.\0" * 5)[0].noise
        == (b"Hello, this is a console." * 3)[:64]
    )


class Counted(bytearray):
    """Bytes that count how many of them are looked at or moved."""

    work = 0

    def find(self, byte, start=0):
        end = super().find(byte, start)
        Counted.work += (end if end >= 0 else len(self)) - start
        return end


@pytest.mark.parametrize("piece", [1, 100, 60_000])
@pytest.mark.parametrize("data", [WIRE * 6000, b"\xaa" * 60_000], ids=["packets", "noise"])
def test_the_work_grows_with_the_bytes_and_not_with_their_square(monkeypatch, piece, data):
    monkeypatch.setattr(Counted, "work", 0)
    monkeypatch.setattr(streams, "bytearray", Counted, raising=False)
    stream = PacketStream()
    for at in range(0, len(data), piece):
        for _ in stream.feed(data[at : at + piece]):
            pass
    assert isinstance(stream._segment, Counted)
    assert 0 < Counted.work <= 2 * len(data)

"""Packet receiver and sender: segments, COBS and the check value, sections 3 and 4."""

import random

import pytest
from device_packets import packet
from document import cobs_decode, cobs_encode, on_wire
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_sim.receiver import Receiver
from firmware_sim.sender import encode_packet, encode_segment, max_wire_bytes

LONGEST = 300


def segments(pieces: list[bytes], longest: int = LONGEST) -> list[bytes | None]:
    """Return the packets of a stream, None for each damaged segment."""
    receiver = Receiver(longest)
    found = []
    for piece in pieces:
        at = 0
        while at < len(piece):
            at = receiver.read(piece, at)
            if receiver.damaged:
                found.append(None)
            elif receiver.packet is not None:
                found.append(receiver.packet)
    return found


@given(st.binary(min_size=1, max_size=1200))
@settings(deadline=None)
def test_cobs_is_that_of_the_document(raw: bytes) -> None:
    wire = encode_segment(raw)
    assert wire == cobs_encode(raw) + b"\0"
    assert wire.index(0) == len(wire) - 1
    assert cobs_decode(wire[:-1]) == raw
    assert len(wire) <= max_wire_bytes(len(raw))


@pytest.mark.parametrize("size", [1, 253, 254, 255, 507, 508, 509, 1031])
def test_the_wire_size_is_that_of_bytes_without_zeros(size: int) -> None:
    assert len(encode_segment(b"\x11" * size)) == max_wire_bytes(size)


@given(st.binary(min_size=3, max_size=LONGEST - 4))
@settings(deadline=None)
def test_a_packet_comes_back(body: bytes) -> None:
    assert segments([on_wire(body)]) == [body]


@given(
    st.lists(
        st.one_of(
            st.binary(max_size=40),
            st.binary(min_size=3, max_size=LONGEST).map(on_wire),
            st.just(b"\0"),
            st.just(b"\x01" * 700),
            st.just(b"\xff" + b"\x01" * 254),
        ),
        max_size=6,
    ).map(b"".join),
    st.lists(st.integers(1, 50), min_size=1, max_size=8),
)
@settings(deadline=None)
def test_any_cutting_gives_the_same(stream: bytes, sizes: list[int]) -> None:
    """A segment is what stands between two 00, not between two reads."""
    pieces = []
    at = 0
    while at < len(stream):
        size = sizes[len(pieces) % len(sizes)]
        pieces.append(stream[at : at + size])
        at += size
    whole = segments([stream])
    assert segments(pieces) == whole
    assert segments([stream[i : i + 1] for i in range(len(stream))]) == whole


@given(st.binary(max_size=300), st.binary(min_size=3, max_size=60))
@settings(deadline=None)
def test_the_next_packet_is_read_as_if_nothing_had_been_before(noise: bytes, body: bytes) -> None:
    """A receiver MUST survive any input."""
    assert segments([noise + b"\0" + on_wire(body)])[-1] == body


@pytest.mark.parametrize("size", range(8))
def test_a_short_segment_is_nothing(size: int) -> None:
    """A segment of fewer than 8 bytes: MUST drop it without answer and without counting it."""
    assert segments([b"\x09" * size + b"\0"]) == []


def test_a_segment_of_eight_bytes_counts() -> None:
    assert segments([b"\x09" * 8 + b"\0"]) == [None]
    assert len(packet(4)) == 9
    assert segments([packet(4)]) == [b"\x40\0\0"]


def test_a_code_byte_that_asks_for_too_much_is_damage() -> None:
    good = packet(1, payload=b"\x81")
    assert segments([bytes((good[0] + 1,)) + good[1:]]) == [None]
    assert segments([good[:-2] + b"\0"]) == [None]


def test_a_packet_may_be_as_long_as_the_longest_and_no_longer() -> None:
    body = bytes(LONGEST - 4)
    assert segments([on_wire(body)]) == [body]
    assert segments([on_wire(body + b"\0")]) == [None]
    body = b"\x11" * (LONGEST - 4)
    assert segments([on_wire(body)]) == [body]
    assert segments([on_wire(body + b"\x11")]) == [None]


def test_a_group_longer_than_the_buffer_is_damage() -> None:
    assert segments([b"\xff" + b"\x11" * 254 + b"\0"], longest=71) == [None]


def test_every_inverted_bit_is_seen() -> None:
    good = packet(1, 1, 2, 3, b"\x81\x00\x82")
    for bit in range(8 * (len(good) - 1)):
        bad = bytearray(good)
        bad[bit // 8] ^= 1 << bit % 8
        if 0 not in bad[:-1]:
            assert segments([bytes(bad)]) == [None]


def test_a_long_random_stream_is_got_through() -> None:
    rng = random.Random(5)
    stream = rng.randbytes(1_000_000)
    found = segments([stream, b"\0", packet(4)], longest=1031)
    assert found[-1] == b"\x40\0\0"
    assert found.count(None) == sum(len(s) >= 8 for s in stream.split(b"\0"))


def test_send_is_a_packet() -> None:
    assert encode_packet(8, 5, 1, 2, b"\0abc") == packet(8, 5, 1, 2, b"\0abc")

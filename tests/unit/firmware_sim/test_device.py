"""Responses of the emulated device: sections 4, 5 and 10 to 13."""

import random
import struct

import pytest
from device_packets import (
    ACK,
    ASKED,
    BOOT,
    CLEAR,
    COMMIT,
    DATA,
    DOT,
    ERROR,
    FIELD,
    FRAME,
    HELLO,
    INFO,
    LENGTH,
    NO_SESSION,
    OP,
    OUTSIDE,
    OVERRUN,
    PAGE,
    READ,
    SEQUENCE,
    SESSION,
    SHOWN,
    STATUS,
    TYPE,
    DeviceUnderTest,
    block_with_pending_frame,
    data,
    data_of_wire_size,
    hello,
    packet,
    parse_responses,
    read,
    status,
)
from document import on_wire
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_sim.bench import Bench
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.memory import FORMATS

# HELLO and INFO, section 5


def test_info_says_what_the_device_is() -> None:
    """The device MUST answer with INFO."""
    rig = DeviceUnderTest(
        3, 300, 7, session=False, pixel_format="rgb565", refresh=29_970, serial="Ä1"
    )
    info = rig.request(b"\0" + hello())
    assert (info.kind, info.flags, info.seq, info.frame) == (INFO, 0, 0, 0)
    assert (info.major, info.minor, info.session, info.boot) == (1, 1, SESSION, BOOT)
    assert (info.nx, info.ny, info.nz, info.format, info.pages) == (3, 300, 7, 3, 2)
    assert (info.max_payload, info.rx_buffer, info.refresh) == (1024, 16_384, 29_970)
    assert (info.features, info.reserved) == (0b11_1111_1010_1111, 0)
    assert info.payload[29:] == b"\x13voxdisplay emulator\x031.0\x03\xc3\x841"


def test_another_major_is_answered_and_opens_nothing() -> None:
    """MUST NOT open the session; what was open stays open."""
    rig = DeviceUnderTest(session=False)
    info = rig.request(hello(session=9, major=2))
    assert (info.kind, info.session, info.major) == (INFO, 9, 1)
    assert rig.request(status()).error == (NO_SESSION, 0)
    rig.request(hello())
    rig.request(data(0, 0, DOT))
    assert rig.request(hello(session=9, major=0)).session == 9
    ack = rig.request(status())
    assert (ack.session, ack.seq) == (SESSION, 1)


def test_a_hello_of_a_later_minor_is_taken() -> None:
    """A device MUST ignore flags, seq, frame, reserved and bytes after offset 7 of a HELLO."""
    rig = DeviceUnderTest(session=False)
    payload = struct.pack("<BHBB", 1, 77, 9, 200) + b"more"
    assert rig.request(packet(HELLO, 15, 3, 4, payload)).kind == INFO
    assert rig.request(status()).session == 77


@pytest.mark.parametrize("size", range(5))
def test_a_short_hello_is_refused(size: int) -> None:
    rig = DeviceUnderTest(session=False)
    error = rig.request(packet(HELLO, 0, 3, 4, hello_payload()[:size]))
    assert error.error == (LENGTH, 0)
    assert (error.seq, error.frame, error.session) == (3, 4, 0)


def hello_payload() -> bytes:
    return struct.pack("<BHBB", 1, SESSION, 0, 0)


def test_session_zero_is_refused() -> None:
    """A session is a number of the host's choice, not 0."""
    rig = DeviceUnderTest()
    assert rig.request(hello(session=0)).error == (FIELD, 4)
    assert rig.request(status()).session == SESSION


def test_hello_begins_anew() -> None:
    """Any earlier session ends; the next number is 0; the front page stays, its id is forgotten."""
    rig = DeviceUnderTest()
    shown = rig.show_frame(0, 0, DOT)
    rig.request(data(1, 1, DOT, COMMIT))
    rig.request(hello(session=5))
    assert rig.tick() == []  # the frame that waited has been dropped
    ack = rig.request(status(8))
    assert (ack.flags, ack.seq, ack.frame) == (ASKED, 0, 0)
    assert (ack.session, ack.received, ack.digest) == (5, 0, shown.digest)
    ack = rig.request(data(0, 0, DOT))
    assert (ack.flags, ack.seq, ack.last) == (0, 1, 0)


# No session, types, lengths, fields: section 11, the first four rows


@pytest.mark.parametrize("kind", [k for k in range(16) if k != HELLO])
def test_without_a_session_everything_is_refused(kind: int) -> None:
    rig = DeviceUnderTest(session=False)
    error = rig.request(packet(kind, 15, 6, 7, b"x"))
    assert error.error == (NO_SESSION, 0)
    assert (error.seq, error.frame, error.session, error.flags) == (6, 7, 0, 0)


@pytest.mark.parametrize("kind", [0, 2, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15])
def test_types_that_are_not_a_hosts_are_refused(kind: int) -> None:
    """A refused packet of another type changes nothing."""
    rig = DeviceUnderTest()
    error = rig.request(packet(kind, 15, 6, 7, b"x"))
    assert error.error == (TYPE, 0)
    assert (error.seq, error.frame, error.session) == (6, 7, SESSION)
    assert rig.request(status()).kind == ACK


def test_read_is_refused_if_not_announced() -> None:
    rig = DeviceUnderTest(features=frozenset({"digest"}), session=False)
    assert rig.request(hello()).features == 1 << 8
    assert rig.request(read(0, 1)).error == (TYPE, 0)


def test_without_the_feature_the_digest_is_0() -> None:
    rig = DeviceUnderTest(features=frozenset())
    ack = rig.show_frame(0, 0, DOT)
    assert (ack.flags, ack.digest) == (SHOWN, 0)
    assert Bench(rig.device).snapshot().digest != 0


@pytest.mark.parametrize(
    ("wire", "error"),
    [
        (packet(STATUS, 1, 0, 9, b"x"), (LENGTH, 0)),
        (packet(STATUS, 1, 0, 9), (FIELD, 0)),
        (packet(STATUS, 0, 0, 9), (FIELD, 2)),
        (packet(READ, 2, 0, 9, struct.pack("<BII", 1, 105, 0)[:8]), (LENGTH, 0)),
        (packet(READ, 2, 0, 9, struct.pack("<BII", 1, 105, 0) + b"x"), (LENGTH, 0)),
        (packet(READ, 2, 0, 9, struct.pack("<BII", 1, 105, 0)), (FIELD, 0)),
        (packet(READ, 1, 0, 9, struct.pack("<BII", 1, 105, 0)), (FIELD, 2)),
        (packet(READ, 1, 0, 0, struct.pack("<BII", 1, 105, 0)), (FIELD, 3)),
        (packet(READ, 1, 0, 0, struct.pack("<BII", 0, 105, 0)), (FIELD, 8)),
        (read(105, 1), (OUTSIDE, 4)),
        (read(0, 106), (OUTSIDE, 4)),
        (read(2**32 - 1, 2**32 - 1), (OUTSIDE, 4)),
    ],
)
def test_status_and_read_are_checked_in_the_order_of_the_table(
    wire: bytes, error: tuple[int, int]
) -> None:
    """The device checks in the order of this table; a refused STATUS or READ changes nothing."""
    rig = DeviceUnderTest()
    assert rig.request(wire).error == error
    assert rig.request(status()).kind == ACK


@pytest.mark.parametrize("flags", [2, 8, 10, 15])
def test_reserved_flags_of_data_are_refused(flags: int) -> None:
    rig = DeviceUnderTest()
    assert rig.request(data(40, 9, b"\xff", flags)).error == (FIELD, 0)
    assert rig.request(status()).error == (NO_SESSION, 0)


def test_checks_of_data_go_in_the_order_of_the_table() -> None:
    rig = DeviceUnderTest()
    assert rig.request(data(32, 9, b"\xff", CLEAR)).error == (SEQUENCE, 1)
    rig = DeviceUnderTest()
    assert rig.request(data(0, 9, b"\xff", CLEAR)).error == (FRAME, 2)
    rig = DeviceUnderTest()
    assert rig.request(data(0, 0, b"\xff", CLEAR)).error == (OP, 3)


def test_a_refused_data_ends_the_session() -> None:
    """What is not on display is dropped; until the next HELLO all is answered with NO_SESSION."""
    rig = DeviceUnderTest()
    before = rig.show_frame(0, 0, DOT)
    rig.request(data(1, 1, DOT))
    error = rig.request(data(2, 1, b"\x80\xff"))
    assert error.error == (OP, 4)
    assert (error.seq, error.frame, error.session) == (2, 1, SESSION)
    for wire in (data(3, 1), status(), read(0, 1), packet(0)):
        assert rig.request(wire).error == (NO_SESSION, 0)
    assert rig.tick() == []
    rig.request(hello())
    assert rig.request(status()).digest == before.digest


# Damage: sections 3 and 9.4


def test_damage_is_counted_and_answered_in_a_session() -> None:
    """A damaged segment MUST NOT change anything but the count; ACK if a session is open."""
    rig = DeviceUnderTest(session=False)
    bad = b"\x02" * 8 + b"\0"
    assert rig.send(bad, bad) == []
    rig.request(hello())
    ack = rig.request(bad)
    assert (ack.kind, ack.damaged, ack.last, ack.seq) == (ACK, 3, 255, 0)
    assert rig.send(b"\x02" * 7 + b"\0") == []
    rig.device.damaged = 65_535
    assert rig.request(bad).damaged == 0


# READ and PAGE: section 10


@pytest.mark.parametrize("name", FORMATS)
def test_front_and_back_can_be_read(name: str) -> None:
    rig = DeviceUnderTest(17, 64, 40, pixel_format=name, max_payload=64, rx_buffer=512)
    size = FORMATS[name].size
    rng = random.Random(name)
    front, back = rig.device.memory.front, rig.device.memory.back
    for page in (front, back):
        for _ in range(40):
            pixels = b"\1" * size if name == "mono1" else rng.randbytes(size)
            page.put(rng.randrange(43_000), pixels * rng.choice((1, 1, 2, 300)))
    for flag, page in ((0, front), (1, back)):
        picture = read_all(rig, 43_520, flag)
        assert picture == page.pixels


def read_all(rig: DeviceUnderTest, volume: int, back: int) -> bytes:
    """Read a page and draw it on the back page of another device, piece by piece."""
    config = rig.device.config
    at = 0
    picture = b""
    while at < volume:
        page = rig.request(read(at, volume - at, tag=at % 256, back=back))
        assert (page.kind, page.flags, page.seq) == (PAGE, back, at % 256)
        assert (page.start, page.reserved) == (at, 0)
        assert 1 <= page.count <= volume - at
        other = DeviceUnderTest(page.count, 1, 1, pixel_format=config.pixel_format)
        assert other.request(data(0, 0, page.payload[9:])).kind == ACK
        picture += other.back
        at += page.count
    return picture


def test_the_frame_of_a_page_is_that_of_an_ack() -> None:
    rig = DeviceUnderTest()
    assert rig.request(read(0, 105)).frame == 0
    rig.show_frame(0, 0, DOT)
    rig.show_frame(1, 1, DOT)
    assert rig.request(read(0, 105, back=1)).frame == 1
    rig.request(hello())
    assert rig.request(read(0, 105)).frame == 0


# A device that lies


@pytest.mark.parametrize(
    ("lie", "field", "said"),
    [
        ("credit", "rx_buffer", 32_768),
        ("format", "format", 3),
        ("payload", "max_payload", 2048),
        ("boot", "boot", BOOT ^ 0xFFFF),
        ("grid", "nx", 4),
        ("grid", "ny", 6),
        ("grid", "nz", 65_534),
        ("features", "features", 0b11_1111_1111_1111),
    ],
)
def test_info_announces_what_the_device_does_not_do(lie: str, field: str, said: int) -> None:
    sides = (3, 5, 65_535 if field == "nz" else 7)
    rig = DeviceUnderTest(*sides, session=False, pixel_format="index8", lies=frozenset({lie}))
    info = rig.request(hello())
    assert getattr(info, field) == said


def test_a_lie_is_kept_or_comes_out() -> None:
    """What lies beyond the device is refused, lost or not done."""
    assert DeviceUnderTest(lies=frozenset({"grid"})).request(data(0, 0, b"\2\3\0\0\xa0")).error == (
        OUTSIDE,
        3,
    )
    rig = DeviceUnderTest(lies=frozenset({"credit"}), rx_buffer=1200)
    assert rig.request(status()).credit == 2400
    block_with_pending_frame(rig)
    assert rig.send(data_of_wire_size(2, 600), data_of_wire_size(3, 600))[0].error == (OVERRUN, 0)
    rig = DeviceUnderTest(lies=frozenset({"features"}))
    assert rig.request(read(0, 1)).error == (TYPE, 0)
    assert rig.show_frame(0, 0, DOT).digest == 0
    assert rig.request(data(1, 1, b"\x04\0\0\0")).error == (OP, 3)
    rig = DeviceUnderTest(lies=frozenset({"payload"}), max_payload=64)
    assert rig.request(data(0, 0, bytes(65))).damaged == 1
    rig = DeviceUnderTest(lies=frozenset({"boot"}))
    assert rig.request(status()).boot == BOOT
    rig = DeviceUnderTest(lies=frozenset({"format"}), pixel_format="mono1")
    assert rig.request(data(0, 0, b"\1\2")).error == (11, 3)


# The device as a whole


def test_power_cycle_and_snapshot() -> None:
    rig = DeviceUnderTest(pixel_format="rgb565")
    bench = Bench(rig.device)
    rig.show_frame(0, 0, DOT)
    picture = bench.snapshot()
    assert (picture.frame, picture.grid, picture.pixel_format) == (0, (3, 5, 7), "rgb565")
    assert picture.pixels == b"\xff\xff" + bytes(208)
    assert picture.digest == rig.device.memory.front.digest
    assert bench.counters().packets == {"DATA": 1, "HELLO": 1}
    assert bench.counters().swaps == 1
    bench.power_cycle()
    assert not any(bench.snapshot().pixels)
    assert bench.snapshot().frame is None
    assert rig.request(status()).error == (NO_SESSION, 0)
    assert rig.request(hello()).boot == BOOT + 1
    assert bench.counters().refused == {"NO_SESSION": 1}


def test_the_boot_id_is_random() -> None:
    boots = {Device(Config((1, 1, 1))).boot for _ in range(20)}
    assert len(boots) > 10


def test_disconnect_ends_the_session() -> None:
    rig = DeviceUnderTest()
    block_with_pending_frame(rig)
    rig.device.disconnect()
    assert rig.tick() == []
    assert rig.request(status()).error == (NO_SESSION, 0)


WORDS = [
    hello(),
    hello(7),
    hello(major=9),
    status(1),
    read(0, 105),
    read(3, 9, back=1),
    b"\x02" * 9 + b"\0",
    b"\0",
    *(data(n % 256, n // 2, DOT, (CLEAR if n % 4 else 0) | COMMIT * (n & 1)) for n in range(12)),
    *(data(n, 1, DOT) for n in (20, 40, 250)),
]


@given(
    st.lists(st.sampled_from(WORDS), max_size=30),
    st.lists(st.integers(1, 40), min_size=1, max_size=9),
)
@settings(deadline=None, max_examples=150)
def test_any_cutting_of_the_stream_gives_the_same_answers(
    words: list[bytes], sizes: list[int]
) -> None:
    stream = hello() + b"".join(words)
    whole, pieces, bytewise = (DeviceUnderTest(session=False) for _ in range(3))
    whole.device.receive(stream)
    at = turn = 0
    while at < len(stream):
        size = sizes[turn % len(sizes)]
        pieces.device.receive(stream[at : at + size])
        at, turn = at + size, turn + 1
    for byte in stream:
        bytewise.device.receive(bytes((byte,)))
    for _ in range(12):
        told = whole.device.transmit()
        assert pieces.device.transmit() == told
        assert bytewise.device.transmit() == told
        parse_responses(told)
        for rig in (whole, pieces, bytewise):
            rig.device.tick()


def test_random_bytes_do_no_harm() -> None:
    """A receiver MUST survive any input."""
    rig = DeviceUnderTest(17, 64, 40)
    rng = random.Random(3)
    for _ in range(1000):
        rig.send(rng.randbytes(1000))
    assert rig.send(b"\0" + hello())[-1].kind == INFO
    assert rig.request(status()).kind == ACK


def test_mutated_packets_do_no_harm() -> None:
    rig = DeviceUnderTest(17, 64, 40, refresh=1)
    rng = random.Random(4)
    bodies = [
        bytes((DATA << 4 | 5, 0, 0)) + bytes.fromhex("4A033C0704E401 31010B 82 DF8001"),
        bytes((DATA << 4 | 5, 0, 0)) + bytes.fromhex("01112233 A3 BF8001 C1010203040506 0000"),
        bytes((READ << 4, 1, 0, 0)) + struct.pack("<II", 5, 700),
        bytes((STATUS << 4, 9, 0)),
        bytes((HELLO << 4, 0, 0)) + hello_payload(),
    ]
    seen = set()
    for turn in range(10_000):
        if turn % 4 == 0:
            rig.send(b"\0" + hello())
        body = bytearray(rng.choice(bodies))
        for _ in range(rng.randrange(1, 4)):
            what = rng.randrange(3)
            at = rng.randrange(len(body))
            if what == 0:
                body[at] ^= 1 << rng.randrange(8)
            elif what == 1 and len(body) > 3:
                del body[at]
            else:
                body.insert(at, rng.randrange(256))
        for answer in rig.send(on_wire(bytes(body))) + rig.tick():
            assert answer.kind in (ACK, INFO, PAGE, ERROR)
            if answer.kind == ERROR:
                seen.add(answer.code)
    assert seen >= set(range(1, 13)) - {11}
    assert rig.request(b"\0" + hello()).kind == INFO

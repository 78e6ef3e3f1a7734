"""Faults of the line: their parsing, their positions, and their effect on the device."""

import math
import random
from itertools import pairwise

import pytest
from device_packets import (
    ACK,
    ASKED,
    BOOT,
    CLEAR,
    COMMIT,
    DOT,
    INFO,
    PENDING,
    SHOWN,
    Clock,
    data,
    hello,
    parse_responses,
    status,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.fault_types import Event
from firmware_sim.faults import DIRECTIONS, KINDS, FaultSpec, FaultyLine, parse_faults

NO_SESSION = 1
BOTH = ("down", "up")


# What a text asks for


def test_faults_are_read() -> None:
    assert parse_faults("flip=1e-5,drop:0.5") == (
        FaultSpec("flip", BOTH, 1e-5),
        FaultSpec("drop", BOTH, 0.5),
    )
    assert parse_faults("down.flip=1, up.lose:0") == (
        FaultSpec("flip", ("down",), 1.0),
        FaultSpec("lose", ("up",), 0.0),
    )
    assert parse_faults("stall=0.2@0.01,delay:1@1") == (
        FaultSpec("stall", BOTH, 0.01, 0.2),
        FaultSpec("delay", BOTH, 1.0, 1.0),
    )
    assert parse_faults("reboot@5000,unplug=0.5,up.unplug@1") == (
        FaultSpec("reboot", ("down",), after=5000),
        FaultSpec("unplug", ("down",), 0.5),
        FaultSpec("unplug", ("up",), after=1),
    )
    assert parse_faults("") == ()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("flop=1", "fault 'flop' is unknown: did you mean flip"),
        ("zzz=1", "'zzz' is unknown: there are flip, drop, double, insert, lose, delay"),
        ("a.b.flip=1", "'a.b.flip=1' is unknown: .* reorder, short, stall, reboot, unplug"),
        ("flip", "write flip=RATE"),
        ("drop=2", "from 0 to 1"),
        ("flip=-1", "from 0 to 1"),
        ("flip=x", "write flip=RATE"),
        ("flip=nan", "from 0 to 1"),
        ("flip@5", "write flip=RATE"),
        ("flip=0.1@5", "write flip=RATE"),
        ("side.flip=1", "the prefix is down. .* or up."),
        ("stall=1", "write stall=SECONDS@RATE"),
        ("delay@1", "write delay=SECONDS@RATE"),
        ("delay=-1@1", "write delay=SECONDS@RATE"),
        ("delay=inf@1", "write delay=SECONDS@RATE"),
        ("stall=1@2", "a RATE from 0 to 1"),
        ("reboot", "write reboot=RATE or reboot@BYTES"),
        ("reboot@0", "BYTES from 1 on"),
        ("unplug@x", "or unplug@BYTES"),
        ("unplug@-1", "or unplug@BYTES"),
        ("unplug=1@1", "or unplug@BYTES"),
        ("reboot=2", "write reboot=RATE"),
    ],
)
def test_unknown_faults_are_refused(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        parse_faults(text)


# Where and when they strike


def carried(line: FaultyLine) -> list[bytes | Event]:
    """Take all that comes."""
    come = []
    while line.due < math.inf:
        come.append(line.take(math.inf))
    return come


def carry(text: str, stream: bytes, seed: int = 7, direction: str = "down") -> bytes:
    line = FaultyLine(parse_faults(text), seed, direction)
    line.send(0, stream)
    return b"".join(what for what in carried(line) if isinstance(what, bytes))


STREAM = b"".join(random.Random(k).randbytes(40).replace(b"\0", b"\1") + b"\0" for k in range(120))
ONE_OF_EACH = [
    "flip=1e-3",
    "drop=1e-2",
    "double=1e-2",
    "insert=1e-2",
    "lose=0.1",
    "reorder=0.2",
    "short=0.1",
    "delay=0.5@0.1",
    "stall=0.2@0.01",
    "down.reboot=0.01",
    "down.unplug=0.01",
    "reboot@777",
    "unplug@1",
]
ALL = ",".join(ONE_OF_EACH)


def test_every_kind_is_tried_here() -> None:
    assert {spec.kind for spec in parse_faults(ALL)} == KINDS.keys()


def cut(line: FaultyLine, stream: bytes, sizes: list[int]) -> None:
    at = turn = 0
    while at < len(stream):
        size = sizes[turn % len(sizes)]
        line.send(0, stream[at : at + size])
        at, turn = at + size, turn + 1


def history(line: FaultyLine) -> list[tuple[float, bytes | Event]]:
    """All that comes, with its time; bytes that come together are one."""
    told = []
    while line.due < math.inf:
        at = line.due
        told.append((at, line.take(at)))
    return told


@pytest.mark.parametrize("text", [*ONE_OF_EACH, ALL, "drop=0.1,flip=0.01", "flip=1", "reorder=1"])
def test_faults_do_not_depend_on_the_cutting(text: str) -> None:
    whole, pieces, bytewise = (FaultyLine(parse_faults(text), 7, "down") for _ in range(3))
    whole.send(0, STREAM)
    cut(pieces, STREAM, [13, 1, 200, 41, 6])
    cut(bytewise, STREAM, [1])
    told = history(whole)
    assert told != [(0, STREAM)]
    assert history(pieces) == told
    assert history(bytewise) == told
    assert whole.backlog == pieces.backlog == 0


@given(
    st.lists(st.sampled_from(ONE_OF_EACH), min_size=1, max_size=5).map(",".join),
    st.lists(st.sampled_from((b"\0", b"\0\0", b"a\0", b"abc", b"\1" * 30, b"xyz\0")), max_size=30),
    st.lists(st.integers(1, 9), min_size=1, max_size=5),
    st.integers(0, 5),
)
@settings(deadline=None, max_examples=200)
def test_no_combination_depends_on_the_cutting(
    text: str, words: list[bytes], sizes: list[int], seed: int
) -> None:
    stream = b"".join(words)
    whole, pieces = (FaultyLine(parse_faults(text), seed, "down") for _ in range(2))
    if stream:
        whole.send(0, stream)
    cut(pieces, stream, sizes)
    assert history(whole) == history(pieces)


def test_the_seed_and_the_direction_and_the_place_decide() -> None:
    for text in ("flip=1e-2", "drop=1e-2", "double=1e-2", "insert=1e-2", "lose=0.2", "reorder=0.2"):
        here = carry(text, STREAM)
        assert carry(text, STREAM) == here
        assert carry(text, STREAM, seed=8) != here
        assert carry(text, STREAM, direction="up") != here
        assert carry("flip=0," + text, STREAM) != here


def test_a_direction_has_its_own_faults() -> None:
    assert carry("up.drop=1", STREAM) == STREAM
    assert carry("up.drop=1", STREAM, direction="up") == b""
    assert carry("down.drop=1", STREAM) == b""
    assert carry("reboot=1", STREAM, direction="up") == STREAM
    assert DIRECTIONS == BOTH


def test_faults_strike_at_their_rate() -> None:
    stream = bytes(100_000)
    flipped = carry("flip=1e-2", stream)
    assert math.isclose(int.from_bytes(flipped, "big").bit_count(), 8000, rel_tol=0.1)
    assert math.isclose(len(carry("drop=1e-1", stream)), 90_000, rel_tol=0.02)
    assert math.isclose(len(carry("double=1e-1", stream)), 110_000, rel_tol=0.02)
    assert math.isclose(len(carry("insert=1e-1", stream)), 110_000, rel_tol=0.02)
    assert math.isclose(len(carry("lose=1e-1", stream)), 90_000, rel_tol=0.02)
    assert carry("flip=1", b"\x0f") == b"\xf0"
    assert carry("drop=1", stream) == carry("lose=1", stream) == b""
    assert carry("double=1", b"abc") == b"aabbcc"
    noise = carry("insert=1", bytes(1000))
    assert (len(noise), noise[1::2]) == (2000, bytes(1000))
    assert len(set(noise[::2])) > 200
    nothing = ",".join(f"{kind}=0" for kind in KINDS if kind not in ("delay", "stall"))
    assert carry(nothing + ",delay=1@0,stall=1@0", stream) == stream
    assert carry("flip=5e-324", stream) == stream


def test_whole_packets_are_lost() -> None:
    packets = STREAM.split(b"\0")[:-1]
    left = carry("lose=0.3", STREAM).split(b"\0")
    assert left.pop() == b""
    assert [p for p in packets if p in left] == left
    assert 60 < len(left) < 100


def test_a_packet_is_exchanged_with_the_next() -> None:
    assert carry("reorder=1", b"a\0b\0c\0d\0e\0") == b"b\0a\0d\0c\0"  # e is held back
    packets = STREAM.split(b"\0")[:-1]
    here = carry("reorder=0.3", STREAM).split(b"\0")[:-1]
    places = [packets.index(p) for p in here]
    assert places != sorted(places)
    assert all(abs(place - k) <= 1 for k, place in enumerate(places))


def test_what_is_held_back_is_bounded() -> None:
    line = FaultyLine(parse_faults("reorder=1"), 1, "down")
    sent = 0
    for _ in range(100):
        line.send(0, b"x" * 1000)
        sent += 1000
    assert line.backlog == sent
    line.send(0, b"\0a\0b\0")
    assert line.take(0).endswith(b"x\0b\0a\0")


def test_a_line_stands_still() -> None:
    line = FaultyLine(parse_faults("stall=0.5@1"), 1, "down")
    line.send(10, b"ab")
    line.send(10.25, b"c")
    assert [line.take(at) for at in (10, 10.25)] == [b"", b""]
    assert history(line) == [(10.5, b"a"), (11.0, b"b"), (11.5, b"c")]
    line.send(20, b"d")
    assert line.due == 20.5


def test_packets_are_late_and_keep_their_order() -> None:
    line = FaultyLine(parse_faults("delay=0.5@1"), 1, "down")
    line.send(10, b"ab")
    line.send(10.25, b"c\0d")
    line.send(12, b"e\0")
    assert history(line) == [(10.5, b"abc\0"), (10.75, b"d"), (12, b"e\0")]


def test_what_happens_keeps_its_place_between_late_bytes() -> None:
    line = FaultyLine(parse_faults("reboot@3,delay=5@1"), 1, "down")
    line.send(0, b"abcd")
    assert history(line) == [(5, b"abc"), (5, Event.REBOOT), (5, b"d")]


def test_short_pieces_come_one_by_one() -> None:
    line = FaultyLine(parse_faults("short=0.2"), 1, "down")
    line.send(0, STREAM)
    told = carried(line)
    pieces = [what for what in told if isinstance(what, bytes)]
    assert b"".join(pieces) == STREAM
    assert len(STREAM) / 8 < len(pieces) < len(STREAM) / 3
    assert all(Event.CUT in pair for pair in pairwise(told))


def test_something_happens_behind_a_byte_once_or_at_a_rate() -> None:
    line = FaultyLine(parse_faults("reboot@3"), 1, "down")
    line.send(0, b"ab")
    line.send(0, b"cdefghi")
    assert carried(line) == [b"abc", Event.REBOOT, b"defghi"]
    line = FaultyLine(parse_faults("reboot=1"), 1, "down")
    line.send(0, b"ab")
    assert carried(line) == [b"a", Event.REBOOT, b"b", Event.REBOOT]


def test_a_new_connection_has_nothing_of_the_old_one() -> None:
    text = "reorder=1,lose=0.5,delay=9@0.5,stall=9@0.5"
    line = FaultyLine(parse_faults(text), 1, "down")
    line.send(0, b"abc\0def")
    line.connect()
    assert (line.backlog, line.due) == (0, math.inf)
    line = FaultyLine(parse_faults("reorder=1"), 1, "down")
    line.send(0, b"abc\0de")
    line.connect()
    line.send(0, b"f\0g\0")
    assert line.take(0) == b"g\0f\0"


# What a device makes of them


def wire_of(text: str, **settings: object) -> tuple[DeviceOnLine, Clock]:
    clock = Clock()
    config = Config((3, 5, 7), **{"refresh": 10_000, "boot": BOOT, **settings})
    return DeviceOnLine(Device(config), parse_faults(text), 3, clock), clock


def test_a_device_that_starts_again() -> None:
    """Another boot id, no session, dark pages; what it had sent is still on its way."""
    first = hello() + data(0, 0, DOT, CLEAR | COMMIT)
    wire, _ = wire_of(f"reboot@{len(first) + 4}", refresh=0)
    wire.receive(first)
    assert any(wire.device.memory.front.pixels)
    wire.receive(status() + status(2) + hello())
    info, ack, error, again = parse_responses(wire.transmit())
    assert (info.kind, info.boot) == (INFO, BOOT)
    assert ack.flags == SHOWN
    assert error.error == (NO_SESSION, 0)
    assert (again.kind, again.boot) == (INFO, BOOT + 1)
    assert not any(wire.device.memory.front.pixels)


def test_a_device_may_start_again_while_a_frame_waits() -> None:
    first = hello() + data(0, 0, DOT, CLEAR | COMMIT)
    wire, _ = wire_of(f"reboot@{len(first)}")
    wire.receive(first)
    assert wire.next_event_s() is None
    assert wire.device.boot == BOOT + 1


def test_an_unplugged_device_says_nothing_more() -> None:
    wire, _ = wire_of("unplug@20")
    wire.receive(hello())
    with pytest.raises(ConnectionError, match="unplugged"):
        wire.receive(hello())
    for call in (wire.transmit, wire.advance, wire.accepts_data, wire.next_event_s):
        with pytest.raises(ConnectionError, match="unplugged"):
            call()
    wire.disconnect()
    wire.receive(hello())
    assert parse_responses(wire.transmit())[0].kind == INFO


def test_what_comes_from_the_device_may_end() -> None:
    wire, _ = wire_of("up.unplug@5")
    wire.receive(hello())
    assert len(wire.transmit()) == 5
    with pytest.raises(ConnectionError, match="unplugged"):
        wire.transmit()


def test_short_reads() -> None:
    wire, _ = wire_of("up.short=0.2")
    wire.receive(hello())
    pieces = []
    while piece := wire.transmit():
        pieces.append(piece)
        assert wire.next_event_s() is None
    assert parse_responses(b"".join(pieces))[0].kind == INFO
    assert len(pieces) > 5


def test_what_is_late_comes_in_the_order_of_its_time() -> None:
    """A tick between two packets that are held back swaps between them, whenever one looks."""
    wire, clock = wire_of("down.delay=0.25@1")
    for number, packet in enumerate((hello(), data(0, 0, DOT, CLEAR | COMMIT), status(9))):
        clock.now = 1000 + 0.1 * number
        wire.receive(packet)
    assert wire.transmit() == b""
    assert wire.next_event_s() == pytest.approx(0.05)
    clock.now = 1009
    told = parse_responses(wire.transmit())
    assert [a.kind for a in told] == [INFO, ACK, ACK, ACK]
    # At 0.35 the frame, at 0.4 the tick, at 0.45 the question.
    assert [a.flags for a in told[1:]] == [PENDING, SHOWN, SHOWN | ASKED]


def test_answers_may_be_late() -> None:
    wire, clock = wire_of("up.delay=0.25@1")
    wire.receive(hello())
    assert wire.transmit() == b""
    assert wire.next_event_s() == pytest.approx(0.25)
    clock.now += 0.25
    assert parse_responses(wire.transmit())[0].kind == INFO
    assert wire.next_event_s() is None


def test_a_line_that_stands_still_takes_no_more_when_it_is_full() -> None:
    wire, clock = wire_of("down.delay=2@1")
    wire.receive(bytes(65_535))
    assert wire.accepts_data()
    wire.receive(b"\0")
    assert not wire.accepts_data()
    clock.now += 2
    assert wire.accepts_data()


def test_a_host_that_does_not_read_makes_the_device_stop() -> None:
    wire, _ = wire_of("")
    wire.receive(hello())
    for tag in range(10_000):
        wire.receive(status(tag % 256))
    wire.device.receive(b"")
    told = b""
    while piece := wire.transmit():
        told += piece
    assert parse_responses(told)[-1].kind == ACK
    assert len(told) < 65_536 * 3


@pytest.mark.parametrize("text", [ALL, "flip=1e-3,insert=1e-3,double=1e-3,short=0.3"])
def test_a_device_gets_through_all_of_them(text: str) -> None:
    def talk() -> bytes:
        wire, clock = wire_of(text.replace("unplug@1", "unplug@200"))
        told = b""
        for turn in range(400):
            clock.now += 0.01
            try:
                wire.receive(b"\0" + hello() + data(0, 0, DOT, CLEAR | COMMIT) + status(turn % 256))
                told += wire.transmit()
            except ConnectionError:
                wire.disconnect()
        return told

    told = talk()
    assert told == talk()
    assert told

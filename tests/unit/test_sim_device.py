"""What the device answers: sections 4 to 6 and 9 to 13."""

import random
import struct

import pytest
from document import on_wire
from hypothesis import given, settings
from hypothesis import strategies as st
from simwire import (
    ACK,
    ASKED,
    BOOT,
    CLEAR,
    COMMIT,
    DATA,
    ERROR,
    HELLO,
    INFO,
    PAGE,
    PENDING,
    READ,
    SESSION,
    SHOWN,
    STATUS,
    Rig,
    answers,
    data,
    hello,
    packet,
    read,
    status,
)

from firmware_sim.bench import Bench
from firmware_sim.config import Config
from firmware_sim.device import TX_BUFFER, Device
from firmware_sim.memory import FORMATS

DOT = b"\xa0"  # RUN 1: lights voxel 0 with the full pixel
NO_SESSION, TYPE, LENGTH, FIELD, SEQUENCE, FRAME, OP = range(1, 8)
PADDING, OUTSIDE, OVERRUN = 10, 12, 13


# HELLO and INFO, section 5


def test_info_says_what_the_device_is() -> None:
    """The device MUST answer with INFO."""
    rig = Rig(3, 300, 7, session=False, pixel_format="rgb565", refresh=29_970, serial="Ä1")
    info = rig.ask(b"\0" + hello())
    assert (info.kind, info.flags, info.seq, info.frame) == (INFO, 0, 0, 0)
    assert (info.major, info.minor, info.session, info.boot) == (1, 0, SESSION, BOOT)
    assert (info.nx, info.ny, info.nz, info.format, info.pages) == (3, 300, 7, 3, 2)
    assert (info.max_payload, info.rx_buffer, info.refresh) == (1024, 16_384, 29_970)
    assert (info.features, info.reserved) == (0b1_1010_1111, 0)
    assert info.payload[29:] == b"\x13voxdisplay emulator\x031.0\x03\xc3\x841"


def test_another_major_is_answered_and_opens_nothing() -> None:
    """MUST NOT open the session; what was open stays open."""
    rig = Rig(session=False)
    info = rig.ask(hello(session=9, major=2))
    assert (info.kind, info.session, info.major) == (INFO, 9, 1)
    assert rig.ask(status()).error == (NO_SESSION, 0)
    rig.ask(hello())
    rig.ask(data(0, 0, DOT))
    assert rig.ask(hello(session=9, major=0)).session == 9
    ack = rig.ask(status())
    assert (ack.session, ack.seq) == (SESSION, 1)


def test_a_hello_of_a_later_minor_is_taken() -> None:
    """A device MUST ignore flags, seq, frame, reserved and bytes after offset 7 of a HELLO."""
    rig = Rig(session=False)
    payload = struct.pack("<BHBB", 1, 77, 9, 200) + b"more"
    assert rig.ask(packet(HELLO, 15, 3, 4, payload)).kind == INFO
    assert rig.ask(status()).session == 77


@pytest.mark.parametrize("size", range(5))
def test_a_short_hello_is_refused(size: int) -> None:
    rig = Rig(session=False)
    error = rig.ask(packet(HELLO, 0, 3, 4, hello_payload()[:size]))
    assert error.error == (LENGTH, 0)
    assert (error.seq, error.frame, error.session) == (3, 4, 0)


def hello_payload() -> bytes:
    return struct.pack("<BHBB", 1, SESSION, 0, 0)


def test_session_zero_is_refused() -> None:
    """A session is a number of the host's choice, not 0."""
    rig = Rig()
    assert rig.ask(hello(session=0)).error == (FIELD, 4)
    assert rig.ask(status()).session == SESSION


def test_hello_begins_anew() -> None:
    """Any earlier session ends; the next number is 0; the front page stays, its id is forgotten."""
    rig = Rig()
    shown = rig.show(0, 0, DOT)
    rig.ask(data(1, 1, DOT, COMMIT))
    rig.ask(hello(session=5))
    assert rig.tick() == []  # the frame that waited has been dropped
    ack = rig.ask(status(8))
    assert (ack.flags, ack.seq, ack.frame) == (ASKED, 0, 0)
    assert (ack.session, ack.received, ack.digest) == (5, 0, shown.digest)
    ack = rig.ask(data(0, 0, DOT))
    assert (ack.flags, ack.seq, ack.last) == (0, 1, 0)


# No session, types, lengths, fields: section 11, the first four rows


@pytest.mark.parametrize("kind", [k for k in range(16) if k != HELLO])
def test_without_a_session_everything_is_refused(kind: int) -> None:
    rig = Rig(session=False)
    error = rig.ask(packet(kind, 15, 6, 7, b"x"))
    assert error.error == (NO_SESSION, 0)
    assert (error.seq, error.frame, error.session, error.flags) == (6, 7, 0, 0)


@pytest.mark.parametrize("kind", [0, 2, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15])
def test_types_that_are_not_a_hosts_are_refused(kind: int) -> None:
    """A refused packet of another type changes nothing."""
    rig = Rig()
    error = rig.ask(packet(kind, 15, 6, 7, b"x"))
    assert error.error == (TYPE, 0)
    assert (error.seq, error.frame, error.session) == (6, 7, SESSION)
    assert rig.ask(status()).kind == ACK


def test_read_is_refused_if_not_announced() -> None:
    rig = Rig(features=frozenset({"digest"}), session=False)
    assert rig.ask(hello()).features == 1 << 8
    assert rig.ask(read(0, 1)).error == (TYPE, 0)


def test_without_the_feature_the_digest_is_0() -> None:
    rig = Rig(features=frozenset())
    ack = rig.show(0, 0, DOT)
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
    rig = Rig()
    assert rig.ask(wire).error == error
    assert rig.ask(status()).kind == ACK


@pytest.mark.parametrize("flags", [2, 8, 10, 15])
def test_reserved_flags_of_data_are_refused(flags: int) -> None:
    rig = Rig()
    assert rig.ask(data(40, 9, b"\xff", flags)).error == (FIELD, 0)
    assert rig.ask(status()).error == (NO_SESSION, 0)


def test_checks_of_data_go_in_the_order_of_the_table() -> None:
    rig = Rig()
    assert rig.ask(data(32, 9, b"\xff", CLEAR)).error == (SEQUENCE, 1)
    rig = Rig()
    assert rig.ask(data(0, 9, b"\xff", CLEAR)).error == (FRAME, 2)
    rig = Rig()
    assert rig.ask(data(0, 0, b"\xff", CLEAR)).error == (OP, 3)


def test_a_refused_data_ends_the_session() -> None:
    """What is not on display is dropped; until the next HELLO all is answered with NO_SESSION."""
    rig = Rig()
    before = rig.show(0, 0, DOT)
    rig.ask(data(1, 1, DOT))
    error = rig.ask(data(2, 1, b"\x80\xff"))
    assert error.error == (OP, 4)
    assert (error.seq, error.frame, error.session) == (2, 1, SESSION)
    for wire in (data(3, 1), status(), read(0, 1), packet(0)):
        assert rig.ask(wire).error == (NO_SESSION, 0)
    assert rig.tick() == []
    rig.ask(hello())
    assert rig.ask(status()).digest == before.digest


# Damage: sections 3 and 9.4


def test_damage_is_counted_and_answered_in_a_session() -> None:
    """A damaged segment MUST NOT change anything but the count; ACK if a session is open."""
    rig = Rig(session=False)
    bad = b"\x02" * 8 + b"\0"
    assert rig.say(bad, bad) == []
    rig.ask(hello())
    ack = rig.ask(bad)
    assert (ack.kind, ack.damaged, ack.last, ack.seq) == (ACK, 3, 255, 0)
    assert rig.say(b"\x02" * 7 + b"\0") == []
    rig.device.damaged = 65_535
    assert rig.ask(bad).damaged == 0


# ACK and the window: section 9


def test_an_ack_says_everything() -> None:
    rig = Rig(rx_buffer=4096)
    rig.show(0, 0, DOT)
    rig.ask(data(3, 1, DOT))
    ack = rig.ask(data(5, 1, DOT))
    assert (ack.kind, ack.flags, ack.seq, ack.frame, ack.last) == (ACK, SHOWN, 1, 0, 5)
    assert (ack.session, ack.boot, ack.received, ack.credit) == (SESSION, BOOT, 0b1010, 4096)
    assert ack.digest == rig.device.memory.front.digest
    assert len(ack.payload) == 19


def test_a_status_asks_for_an_ack_and_its_tag_is_not_kept() -> None:
    """ASKED answers a STATUS, whose tag is in `last`; else the last DATA, 255 before the first."""
    rig = Rig()
    ack = rig.ask(status(99))
    assert (ack.flags, ack.last) == (ASKED, 99)
    assert rig.ask(b"\x02" * 8 + b"\0").last == 255
    rig.ask(data(0, 0))
    rig.ask(status(98))
    assert rig.ask(b"\x02" * 8 + b"\0").last == 0


def test_packets_may_come_in_any_order() -> None:
    rig = Rig()
    order = [4, 1, 0, 31, 2, 3]
    nexts = [0, 0, 2, 2, 3, 5]
    for seq, following in zip(order, nexts, strict=True):
        place = bytes((0x80 | seq - 1,)) if seq else b""
        ack = rig.ask(data(seq, 0, place + DOT))
        assert (ack.seq, ack.last) == (following, seq)
    assert ack.received == 1 << 31 - 5 - 1
    assert [i for i, value in enumerate(rig.back[::3]) if value] == [0, 1, 2, 3, 4, 31]


def test_a_duplicate_is_answered_and_not_applied() -> None:
    """The device MUST NOT apply it again, and answers with ACK."""
    rig = Rig()
    for seq in (0, 2):
        rig.ask(data(seq, 0))
    for seq in (0, 2, 255, 225):
        ack = rig.ask(data(seq, 77, b"\xff", CLEAR))
        assert (ack.kind, ack.seq, ack.last, ack.received) == (ACK, 1, seq, 1)


@pytest.mark.parametrize("seq", [32, 100, 223])
def test_what_is_outside_the_window_is_refused(seq: int) -> None:
    assert Rig().ask(data(seq, 0)).error == (SEQUENCE, 1)


@pytest.mark.parametrize("seq", [224, 255])
def test_what_is_behind_the_window_is_a_duplicate(seq: int) -> None:
    assert Rig().ask(data(seq, 0)).last == seq


def test_numbers_go_round() -> None:
    rig = Rig()
    for number in range(600):
        ack = rig.ask(data(number % 256, 0))
        assert ack.seq == (number + 1) % 256
    ack = rig.ask(data((600 + 31) % 256, 0))
    assert ack.received == 1 << 30


def test_acks_may_be_left_out_while_more_can_be_taken() -> None:
    """MAY leave out this ACK, but not for more than 8 packets in a row."""
    rig = Rig(silent=8)
    acks = rig.say(*(data(seq, 0) for seq in range(20)))
    assert [ack.last for ack in acks] == [8, 17, 19]
    assert rig.ask(data(20, 0)).last == 20
    asked, done = rig.say(data(21, 0), status(7), data(22, 0))
    assert (asked.flags, asked.last, asked.seq) == (ASKED, 7, 22)
    assert done.last == 22
    assert rig.ask(data(23, 0) + hello(5)).kind == INFO


# Frames: section 6


def test_a_frame_starts_dark_or_as_a_copy() -> None:
    """The back page becomes dark (CLEAR) or a copy of the front page."""
    rig = Rig(pixel_format="index8")
    assert rig.show(0, 0, DOT).frame == 0
    rig.show(1, 1, b"\x80\xa0", flags=0)
    assert rig.front[:3] == b"\xff\xff\0"
    rig.show(2, 2, b"\x81\xa0")
    assert rig.front[:3] == b"\0\0\xff"
    rig.show(3, 3, b"", flags=0)
    assert rig.front[:3] == b"\0\0\xff"


@pytest.mark.parametrize("name", FORMATS)
def test_a_swap_happens_at_the_tick_and_is_told(name: str) -> None:
    """At the next refresh tick the device MUST exchange the pages and send an ACK."""
    rig = Rig(pixel_format=name)
    assert rig.tick() == []
    ack = rig.ask(data(0, 0, DOT, CLEAR | COMMIT))
    assert (ack.flags, ack.digest) == (PENDING, 0)
    assert not any(rig.front)
    (ack,) = rig.tick()
    assert (ack.flags, ack.frame, ack.last, ack.seq) == (SHOWN, 0, 0, 1)
    assert ack.digest == rig.device.memory.front.digest != 0
    assert rig.front[: FORMATS[name].size] == FORMATS[name].full
    assert rig.tick() == []


def test_without_ticks_a_swap_happens_at_once() -> None:
    """If `refresh` is 0, that is at once, and one ACK serves packet and swap."""
    rig = Rig(refresh=0)
    ack = rig.ask(data(0, 0, DOT, CLEAR | COMMIT))
    assert (ack.flags, ack.frame) == (SHOWN, 0)
    assert rig.tick() == []
    ack = rig.ask(data(1, 1, b"", COMMIT))
    assert (ack.flags, ack.frame) == (SHOWN, 1)


def test_a_frame_is_whole_when_all_before_its_commit_is_there() -> None:
    """A frame that is not whole MUST NOT be shown."""
    rig = Rig()
    for seq, flags in ((2, CLEAR | COMMIT), (0, CLEAR)):
        assert not rig.ask(data(seq, 0, DOT, flags)).flags & PENDING
        assert rig.tick() == []
    assert rig.ask(data(1, 0, DOT)).flags == PENDING
    assert [ack.frame for ack in rig.tick()] == [0]


def test_a_frame_may_begin_with_any_of_its_packets() -> None:
    """Packets with lower sequence numbers that are missing can only be its own."""
    rig = Rig()
    rig.show(0, 0, DOT)
    assert rig.ask(data(3, 1, b"\x83\xa0")).received == 0b10
    rig.ask(data(2, 1, b"\x82\xa0", CLEAR | COMMIT))
    assert rig.ask(data(1, 1, b"\x81\xa0")).flags & PENDING
    assert [i for i, value in enumerate(rig.back[::3]) if value] == [2, 3, 4]


def test_the_next_frame_is_dropped_while_packets_are_missing() -> None:
    """MUST drop this packet without marking it as received, and answer with ACK."""
    rig = Rig()
    rig.ask(data(0, 0))
    for frame in (1, 2, 200):
        ack = rig.ask(data(3, frame, b"\xff"))
        assert (ack.kind, ack.seq, ack.received, ack.last) == (ACK, 1, 0, 3)


def test_after_a_shown_frame_a_later_one_is_dropped_while_packets_are_missing() -> None:
    rig = Rig()
    rig.show(0, 0, DOT)
    ack = rig.ask(data(2, 2, DOT, CLEAR | COMMIT))
    assert (ack.kind, ack.flags, ack.received) == (ACK, SHOWN, 0)
    rig.ask(data(1, 1, DOT, CLEAR | COMMIT))
    rig.tick()
    assert rig.show(2, 2, DOT).frame == 2


def test_a_frame_may_be_given_up() -> None:
    """If f is not whole and none is missing: f is dropped, and f + 1 begins."""
    rig = Rig(pixel_format="index8")
    rig.ask(data(0, 0, DOT))
    rig.ask(data(1, 1, b"\x80\xa0"))
    assert rig.back[:2] == b"\0\xff"
    ack = rig.show(2, 2, b"\x81\xa0")
    assert (ack.frame, rig.front[:3]) == (2, b"\0\0\xff")


@pytest.mark.parametrize("frame", [0, 1, 3, 255])
def test_another_frame_is_refused_if_nothing_is_missing(frame: int) -> None:
    """Otherwise it is refused (FRAME)."""
    rig = Rig()
    rig.show(0, 0, DOT)
    rig.ask(data(1, 1))
    if frame == 1:
        rig = Rig()
    assert rig.ask(data(2 if frame != 1 else 0, frame)).error == (FRAME, 2)


@pytest.mark.parametrize("seq", [0, 3])
def test_frame_255_is_not_a_first_frame(seq: int) -> None:
    assert Rig().ask(data(seq, 255)).error == (FRAME, 2)


def test_a_frame_that_is_whole_takes_no_more() -> None:
    """Refused (FRAME) if f is pending or on display."""
    rig = Rig()
    rig.ask(data(0, 0, DOT, CLEAR | COMMIT))
    assert rig.ask(data(1, 0)).error == (FRAME, 2)
    assert rig.tick() == []  # the session has ended, and what waited is dropped
    rig = Rig()
    rig.show(0, 0, DOT)
    assert rig.ask(data(2, 0)).error == (FRAME, 2)


def test_a_frame_ends_at_its_commit() -> None:
    """Refused if a COMMIT of f with a lower sequence number has been received."""
    rig = Rig()
    rig.ask(data(2, 0, b"", CLEAR | COMMIT))
    rig.ask(data(1, 0))
    assert rig.ask(data(3, 0)).error == (FRAME, 2)


def test_the_lowest_commit_counts() -> None:
    rig = Rig()
    rig.ask(data(3, 0, b"", CLEAR | COMMIT))
    rig.ask(data(1, 0, b"", CLEAR | COMMIT))
    assert rig.ask(data(0, 0)).flags & PENDING


def test_the_later_commit_does_not_count() -> None:
    rig = Rig()
    rig.ask(data(2, 0, b"", CLEAR | COMMIT))
    rig.ask(data(1, 0, b"", CLEAR | COMMIT))
    rig.ask(data(0, 0, b"", CLEAR | COMMIT))
    assert [ack.seq for ack in rig.tick()] == [3]


def test_all_packets_of_a_frame_have_the_same_clear_flag() -> None:
    rig = Rig()
    rig.ask(data(0, 0, DOT, CLEAR))
    assert rig.ask(data(1, 0, DOT, COMMIT)).error == (FRAME, 0)
    rig = Rig()
    rig.ask(data(0, 0, DOT, 0))
    assert rig.ask(data(1, 0, DOT, CLEAR)).error == (FRAME, 0)


def test_frames_go_round() -> None:
    rig = Rig()
    for number in range(300):
        ack = rig.show(number % 256, number % 256, DOT)
        assert (ack.frame, ack.flags) == (number % 256, SHOWN)


# Waiting: section 6, points 6 and 7


def test_the_next_frame_waits_for_the_tick_and_all_behind_it() -> None:
    """MUST NOT take the packet, nor anything that came after it, before the tick."""
    rig = Rig()
    rig.ask(data(0, 0, DOT, CLEAR | COMMIT))
    assert rig.ask(status(1)).flags == PENDING | ASKED
    assert rig.ask(data(0, 0, DOT, CLEAR | COMMIT)).flags == PENDING  # a duplicate does not wait
    assert rig.ask(read(0, 1)).kind == PAGE
    assert rig.say(data(1, 1, b"\x80\xa0"), status(2), read(0, 3), b"\x02" * 8 + b"\0") == []
    swap, applied, asked, page, damage = rig.tick()
    assert (swap.flags, swap.seq, swap.frame) == (SHOWN, 1, 0)
    assert (applied.last, applied.seq) == (1, 2)
    assert (asked.flags, asked.last) == (SHOWN | ASKED, 2)
    assert page.kind == PAGE
    assert damage.damaged == 1


def test_frame_after_frame_waits() -> None:
    rig = Rig()
    wire = b"".join(data(n, n, DOT, CLEAR | COMMIT) for n in range(5))
    (first,) = rig.say(wire)
    assert first.flags == PENDING
    for frame in range(4):
        swap, applied = rig.tick()
        assert (swap.frame, swap.seq) == (frame, frame + 1)
        assert (applied.last, applied.flags) == (frame + 1, SHOWN | PENDING)
    assert [ack.frame for ack in rig.tick()] == [4]
    assert rig.tick() == []


@pytest.mark.parametrize(
    ("wire", "error"),
    [
        (data(1, 2), (FRAME, 2)),
        (data(100, 1), (SEQUENCE, 1)),
        (data(1, 1, DOT, 2), (FIELD, 0)),
        (data(1, 1, b"\xff"), (OP, 3)),
    ],
)
def test_what_will_be_refused_waits_too(wire: bytes, error: tuple[int, int]) -> None:
    rig = Rig()
    rig.ask(data(0, 0, DOT, CLEAR | COMMIT))
    assert rig.say(wire) == []
    swap, refused = rig.tick()
    assert swap.frame == 0
    assert refused.error == error


def test_a_hello_does_not_wait_but_behind_a_packet_that_waits() -> None:
    rig = Rig()
    rig.ask(data(0, 0, DOT, CLEAR | COMMIT))
    assert rig.ask(hello(5)).kind == INFO
    rig.ask(data(0, 0, DOT, CLEAR | COMMIT))
    assert rig.say(data(1, 1), hello(6)) == []
    swap, ack, info = rig.tick()
    assert (swap.kind, ack.kind, info.session) == (ACK, ACK, 6)


# Credit and the receive ring: section 9.2


def block(rig: Rig) -> int:
    """Let a packet wait; return how much of the credit it takes."""
    rig.ask(data(0, 0, DOT, CLEAR | COMMIT))
    wire = data(1, 1, DOT)
    assert rig.say(wire) == []
    return len(wire)


def filling(seq: int, size: int) -> bytes:
    """Return a DATA packet of so many bytes on the wire."""
    wire = data(seq, 1, bytes(size - 9))  # END and what pads it
    assert len(wire) == size
    return wire


def test_the_credit_can_be_used_to_the_last_byte() -> None:
    """`credit`: bytes that the device has room for behind the packet named by `last`."""
    rig = Rig(rx_buffer=1200)
    used = block(rig)
    last = filling(3, 1200 - used - 600)
    wire = b"\0\0" + filling(2, 600) + b"\0\0\0" + last + b"\0"  # 00 is outside the credit
    for k in range(0, len(wire), 7):
        assert rig.say(wire[k : k + 7]) == []
    assert rig.say(b"\0\0\0", b"\0") == []
    assert [ack.last for ack in rig.tick()] == [0, 1, 2, 3]


def test_one_byte_more_is_an_overrun() -> None:
    """OVERRUN is sent once for each time that bytes were lost, with seq and frame 0."""
    rig = Rig(rx_buffer=1200)
    used = block(rig)
    assert rig.say(filling(2, 600), filling(3, 1200 - used - 600)) == []
    error, ack = rig.say(status(1))
    assert error.error == (OVERRUN, 0)
    assert (error.seq, error.frame, error.session) == (0, 0, SESSION)
    assert (ack.damaged, ack.seq) == (1, 1)
    assert rig.say(status(2)) == rig.say(b"") == rig.say(status(3)[:4]) == []
    assert [ack.last for ack in rig.tick()] == [0, 1, 2, 3]
    # What was cut goes on to the next 00.
    assert rig.say(status(3)[4:-1]) == []
    assert [a.last for a in rig.say(b"\0", status(4))] == [4]
    assert Bench(rig.device).counters().overruns == 1


def test_a_packet_that_is_cut_by_an_overrun_is_damaged() -> None:
    rig = Rig(rx_buffer=1200)
    block(rig)
    error, ack = rig.say(filling(2, 600), filling(3, 600), filling(4, 600))
    assert error.error == (OVERRUN, 0)
    assert ack.damaged == 1
    assert [ack.last for ack in rig.tick()] == [0, 1, 2]
    (ack,) = rig.say(filling(3, 600))  # the loss ended with a 00
    assert (ack.last, ack.seq, ack.damaged) == (3, 4, 1)


def test_bytes_may_be_lost_again_and_again() -> None:
    rig = Rig(rx_buffer=1200)
    block(rig)
    assert rig.say(filling(2, 600), filling(3, 600))[0].error == (OVERRUN, 0)
    rig.tick()
    rig.ask(data(3, 1, DOT, CLEAR | COMMIT))
    assert rig.say(data(4, 2), filling(5, 1100)) == []
    assert rig.say(filling(6, 600))[0].error == (OVERRUN, 0)
    assert Bench(rig.device).counters().overruns == 2


def test_a_stream_without_end_is_bounded() -> None:
    rig = Rig(rx_buffer=1200)
    block(rig)
    sent = [answer.kind for _ in range(50) for answer in rig.say(b"\x33" * 1000)]
    assert sent == [ERROR, ACK]
    assert len(rig.device._ring) <= 1200


def test_a_host_that_does_not_read_is_not_read_either() -> None:
    rig = Rig(rx_buffer=1200)
    longest = 0
    for tag in range(4000):
        rig.device.receive(status(tag % 256))
        longest = max(longest, len(rig.device._out))
    assert longest < TX_BUFFER + 100
    first = answers(rig.device.transmit())
    assert rig.device.pending is False
    assert first[-2].error == (OVERRUN, 0)
    rest = answers(rig.device.transmit())
    assert [ack.flags for ack in rest] == [ASKED] * (1200 // 9)
    assert rig.ask(status(5)).last == 5


def test_a_clogged_device_that_lost_everything_goes_on() -> None:
    rig = Rig(rx_buffer=1200)
    while len(rig.device._out) < TX_BUFFER:
        rig.device.receive(status(1))
    rig.device.receive(b"\x33" * 2000)
    rig.device.transmit()
    assert [a.last for a in rig.say(b"\0", status(5))] == [5]


# READ and PAGE: section 10


@pytest.mark.parametrize("name", FORMATS)
def test_front_and_back_can_be_read(name: str) -> None:
    rig = Rig(17, 64, 40, pixel_format=name, max_payload=64, rx_buffer=512)
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


def read_all(rig: Rig, volume: int, back: int) -> bytes:
    """Read a page and draw it on the back page of another device, piece by piece."""
    config = rig.device.config
    at = 0
    picture = b""
    while at < volume:
        page = rig.ask(read(at, volume - at, tag=at % 256, back=back))
        assert (page.kind, page.flags, page.seq) == (PAGE, back, at % 256)
        assert (page.start, page.reserved) == (at, 0)
        assert 1 <= page.count <= volume - at
        other = Rig(page.count, 1, 1, pixel_format=config.pixel_format)
        assert other.ask(data(0, 0, page.payload[9:])).kind == ACK
        picture += other.back
        at += page.count
    return picture


def test_the_frame_of_a_page_is_that_of_an_ack() -> None:
    rig = Rig()
    assert rig.ask(read(0, 105)).frame == 0
    rig.show(0, 0, DOT)
    rig.show(1, 1, DOT)
    assert rig.ask(read(0, 105, back=1)).frame == 1
    rig.ask(hello())
    assert rig.ask(read(0, 105)).frame == 0


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
        ("features", "features", 0b1_1111_1111),
    ],
)
def test_info_announces_what_the_device_does_not_do(lie: str, field: str, said: int) -> None:
    sides = (3, 5, 65_535 if field == "nz" else 7)
    rig = Rig(*sides, session=False, pixel_format="index8", lies=frozenset({lie}))
    info = rig.ask(hello())
    assert getattr(info, field) == said


def test_a_lie_is_kept_or_comes_out() -> None:
    """What lies beyond the device is refused, lost or not done."""
    assert Rig(lies=frozenset({"grid"})).ask(data(0, 0, b"\2\3\0\0\xa0")).error == (OUTSIDE, 3)
    rig = Rig(lies=frozenset({"credit"}), rx_buffer=1200)
    assert rig.ask(status()).credit == 2400
    block(rig)
    assert rig.say(filling(2, 600), filling(3, 600))[0].error == (OVERRUN, 0)
    rig = Rig(lies=frozenset({"features"}))
    assert rig.ask(read(0, 1)).error == (TYPE, 0)
    assert rig.show(0, 0, DOT).digest == 0
    assert rig.ask(data(1, 1, b"\x04\0\0\0")).error == (OP, 3)
    rig = Rig(lies=frozenset({"payload"}), max_payload=64)
    assert rig.ask(data(0, 0, bytes(65))).damaged == 1
    rig = Rig(lies=frozenset({"boot"}))
    assert rig.ask(status()).boot == BOOT
    rig = Rig(lies=frozenset({"format"}), pixel_format="mono1")
    assert rig.ask(data(0, 0, b"\1\2")).error == (11, 3)


# The palette


def test_a_palette_belongs_to_its_page() -> None:
    """Each page has a palette of its own, which is shown with it."""
    rig = Rig(pixel_format="index8")
    bench = Bench(rig.device)
    default = bench.snapshot().palette
    assert default[:6] == b"\0\0\0\0\0\x55"
    assert len(default) == 768
    rig.ask(data(0, 0, b"\6\1\0abc", CLEAR | COMMIT))
    assert bench.snapshot().palette == default
    (ack,) = rig.tick()
    assert bench.snapshot().palette == default[:3] + b"abc" + default[6:]
    assert bench.snapshot().digest == ack.digest != 0
    rig.show(1, 1, b"\6\2\0def", flags=0)
    assert bench.snapshot().palette == default[:3] + b"abcdef" + default[9:]
    assert rig.show(2, 2, b"").digest == 0
    assert bench.snapshot().palette == default
    rig.show(3, 3, b"\6\1\0abc")
    rig.ask(hello())
    rig.show(0, 0, b"", flags=0)  # the front page stays as it is, with its palette
    assert bench.snapshot().palette == default[:3] + b"abc" + default[6:]
    bench.power_cycle()
    assert bench.snapshot().palette == default
    assert Bench(Rig().device).snapshot().palette == b""


# The device as a whole


def test_power_cycle_and_snapshot() -> None:
    rig = Rig(pixel_format="rgb565")
    bench = Bench(rig.device)
    rig.show(0, 0, DOT)
    picture = bench.snapshot()
    assert (picture.frame, picture.grid, picture.pixel_format) == (0, (3, 5, 7), "rgb565")
    assert picture.pixels == b"\xff\xff" + bytes(208)
    assert picture.digest == rig.device.memory.front.digest
    assert bench.counters().packets == {"DATA": 1, "HELLO": 1}
    assert bench.counters().swaps == 1
    bench.power_cycle()
    assert not any(bench.snapshot().pixels)
    assert bench.snapshot().frame is None
    assert rig.ask(status()).error == (NO_SESSION, 0)
    assert rig.ask(hello()).boot == BOOT + 1
    assert bench.counters().refused == {"NO_SESSION": 1}


def test_the_boot_id_is_random() -> None:
    boots = {Device(Config((1, 1, 1))).boot for _ in range(20)}
    assert len(boots) > 10


def test_disconnect_ends_the_session() -> None:
    rig = Rig()
    block(rig)
    rig.device.disconnect()
    assert rig.tick() == []
    assert rig.ask(status()).error == (NO_SESSION, 0)


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
    whole, pieces, bytewise = (Rig(session=False) for _ in range(3))
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
        answers(told)
        for rig in (whole, pieces, bytewise):
            rig.device.tick()


def test_random_bytes_do_no_harm() -> None:
    """A receiver MUST get through any bytes whatever."""
    rig = Rig(17, 64, 40)
    rng = random.Random(3)
    for _ in range(1000):
        rig.say(rng.randbytes(1000))
    assert rig.say(b"\0" + hello())[-1].kind == INFO
    assert rig.ask(status()).kind == ACK


def test_mutated_packets_do_no_harm() -> None:
    rig = Rig(17, 64, 40, refresh=1)
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
            rig.say(b"\0" + hello())
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
        for answer in rig.say(on_wire(bytes(body))) + rig.tick():
            assert answer.kind in (ACK, INFO, PAGE, ERROR)
            if answer.kind == ERROR:
                seen.add(answer.code)
    assert seen >= set(range(1, 13)) - {11}
    assert rig.ask(b"\0" + hello()).kind == INFO

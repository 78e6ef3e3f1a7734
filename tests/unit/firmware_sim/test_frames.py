"""Frames, pages and swaps of the emulator: section 6."""

import pytest
from device_packets import (
    ACK,
    ASKED,
    CLEAR,
    COMMIT,
    DOT,
    FIELD,
    FRAME,
    INFO,
    OP,
    PAGE,
    PENDING,
    SEQUENCE,
    SHOWN,
    DeviceUnderTest,
    data,
    hello,
    read,
    status,
)

from firmware_sim.bench import Bench
from firmware_sim.memory import FORMATS

# Frames: section 6


def test_a_frame_starts_dark_or_as_a_copy() -> None:
    """The back page becomes dark (CLEAR) or a copy of the front page."""
    rig = DeviceUnderTest(pixel_format="index8")
    assert rig.show_frame(0, 0, DOT).frame == 0
    rig.show_frame(1, 1, b"\x80\xa0", flags=0)
    assert rig.front[:3] == b"\xff\xff\0"
    rig.show_frame(2, 2, b"\x81\xa0")
    assert rig.front[:3] == b"\0\0\xff"
    rig.show_frame(3, 3, b"", flags=0)
    assert rig.front[:3] == b"\0\0\xff"


@pytest.mark.parametrize("name", FORMATS)
def test_a_swap_happens_at_the_tick_and_is_told(name: str) -> None:
    """At the next refresh tick the device MUST exchange the pages and send an ACK."""
    rig = DeviceUnderTest(pixel_format=name)
    assert rig.tick() == []
    ack = rig.request(data(0, 0, DOT, CLEAR | COMMIT))
    assert (ack.flags, ack.digest) == (PENDING, 0)
    assert not any(rig.front)
    (ack,) = rig.tick()
    assert (ack.flags, ack.frame, ack.last, ack.seq) == (SHOWN, 0, 0, 1)
    assert ack.digest == rig.device.memory.front.digest != 0
    assert rig.front[: FORMATS[name].size] == FORMATS[name].full
    assert rig.tick() == []


def test_without_ticks_a_swap_happens_at_once() -> None:
    """If `refresh` is 0, that is at once, and one ACK serves packet and swap."""
    rig = DeviceUnderTest(refresh=0)
    ack = rig.request(data(0, 0, DOT, CLEAR | COMMIT))
    assert (ack.flags, ack.frame) == (SHOWN, 0)
    assert rig.tick() == []
    ack = rig.request(data(1, 1, b"", COMMIT))
    assert (ack.flags, ack.frame) == (SHOWN, 1)


def test_a_frame_is_whole_when_all_before_its_commit_is_there() -> None:
    """A frame that is not whole MUST NOT be shown."""
    rig = DeviceUnderTest()
    for seq, flags in ((2, CLEAR | COMMIT), (0, CLEAR)):
        assert not rig.request(data(seq, 0, DOT, flags)).flags & PENDING
        assert rig.tick() == []
    assert rig.request(data(1, 0, DOT)).flags == PENDING
    assert [ack.frame for ack in rig.tick()] == [0]


def test_a_frame_may_begin_with_any_of_its_packets() -> None:
    """Packets with lower sequence numbers that are missing can only be its own."""
    rig = DeviceUnderTest()
    rig.show_frame(0, 0, DOT)
    assert rig.request(data(3, 1, b"\x83\xa0")).received == 0b10
    rig.request(data(2, 1, b"\x82\xa0", CLEAR | COMMIT))
    assert rig.request(data(1, 1, b"\x81\xa0")).flags & PENDING
    assert [i for i, value in enumerate(rig.back[::3]) if value] == [2, 3, 4]


def test_the_next_frame_is_dropped_while_packets_are_missing() -> None:
    """MUST drop this packet without marking it as received, and answer with ACK."""
    rig = DeviceUnderTest()
    rig.request(data(0, 0))
    for frame in (1, 2, 200):
        ack = rig.request(data(3, frame, b"\xff"))
        assert (ack.kind, ack.seq, ack.received, ack.last) == (ACK, 1, 0, 3)


def test_after_a_shown_frame_a_later_one_is_dropped_while_packets_are_missing() -> None:
    rig = DeviceUnderTest()
    rig.show_frame(0, 0, DOT)
    ack = rig.request(data(2, 2, DOT, CLEAR | COMMIT))
    assert (ack.kind, ack.flags, ack.received) == (ACK, SHOWN, 0)
    rig.request(data(1, 1, DOT, CLEAR | COMMIT))
    rig.tick()
    assert rig.show_frame(2, 2, DOT).frame == 2


def test_a_frame_may_be_given_up() -> None:
    """If f is not whole and none is missing: f is dropped, and f + 1 begins."""
    rig = DeviceUnderTest(pixel_format="index8")
    rig.request(data(0, 0, DOT))
    rig.request(data(1, 1, b"\x80\xa0"))
    assert rig.back[:2] == b"\0\xff"
    ack = rig.show_frame(2, 2, b"\x81\xa0")
    assert (ack.frame, rig.front[:3]) == (2, b"\0\0\xff")


@pytest.mark.parametrize("frame", [0, 1, 3, 255])
def test_another_frame_is_refused_if_nothing_is_missing(frame: int) -> None:
    """Otherwise it is refused (FRAME)."""
    rig = DeviceUnderTest()
    rig.show_frame(0, 0, DOT)
    rig.request(data(1, 1))
    if frame == 1:
        rig = DeviceUnderTest()
    assert rig.request(data(2 if frame != 1 else 0, frame)).error == (FRAME, 2)


@pytest.mark.parametrize("seq", [0, 3])
def test_frame_255_is_not_a_first_frame(seq: int) -> None:
    assert DeviceUnderTest().request(data(seq, 255)).error == (FRAME, 2)


def test_a_frame_that_is_whole_takes_no_more() -> None:
    """Refused (FRAME) if f is pending or on display."""
    rig = DeviceUnderTest()
    rig.request(data(0, 0, DOT, CLEAR | COMMIT))
    assert rig.request(data(1, 0)).error == (FRAME, 2)
    assert rig.tick() == []  # the session has ended, and what waited is dropped
    rig = DeviceUnderTest()
    rig.show_frame(0, 0, DOT)
    assert rig.request(data(2, 0)).error == (FRAME, 2)


def test_a_frame_ends_at_its_commit() -> None:
    """Refused if a COMMIT of f with a lower sequence number has been received."""
    rig = DeviceUnderTest()
    rig.request(data(2, 0, b"", CLEAR | COMMIT))
    rig.request(data(1, 0))
    assert rig.request(data(3, 0)).error == (FRAME, 2)


def test_the_lowest_commit_counts() -> None:
    rig = DeviceUnderTest()
    rig.request(data(3, 0, b"", CLEAR | COMMIT))
    rig.request(data(1, 0, b"", CLEAR | COMMIT))
    assert rig.request(data(0, 0)).flags & PENDING


def test_the_later_commit_does_not_count() -> None:
    rig = DeviceUnderTest()
    rig.request(data(2, 0, b"", CLEAR | COMMIT))
    rig.request(data(1, 0, b"", CLEAR | COMMIT))
    rig.request(data(0, 0, b"", CLEAR | COMMIT))
    assert [ack.seq for ack in rig.tick()] == [3]


def test_all_packets_of_a_frame_have_the_same_clear_flag() -> None:
    rig = DeviceUnderTest()
    rig.request(data(0, 0, DOT, CLEAR))
    assert rig.request(data(1, 0, DOT, COMMIT)).error == (FRAME, 0)
    rig = DeviceUnderTest()
    rig.request(data(0, 0, DOT, 0))
    assert rig.request(data(1, 0, DOT, CLEAR)).error == (FRAME, 0)


def test_frames_go_round() -> None:
    rig = DeviceUnderTest()
    for number in range(300):
        ack = rig.show_frame(number % 256, number % 256, DOT)
        assert (ack.frame, ack.flags) == (number % 256, SHOWN)


# Waiting: section 6, points 6 and 7


def test_the_next_frame_waits_for_the_tick_and_all_behind_it() -> None:
    """MUST NOT take the packet, nor anything that came after it, before the tick."""
    rig = DeviceUnderTest()
    rig.request(data(0, 0, DOT, CLEAR | COMMIT))
    assert rig.request(status(1)).flags == PENDING | ASKED
    assert (
        rig.request(data(0, 0, DOT, CLEAR | COMMIT)).flags == PENDING
    )  # a duplicate does not wait
    assert rig.request(read(0, 1)).kind == PAGE
    assert rig.send(data(1, 1, b"\x80\xa0"), status(2), read(0, 3), b"\x02" * 8 + b"\0") == []
    swap, applied, asked, page, damage = rig.tick()
    assert (swap.flags, swap.seq, swap.frame) == (SHOWN, 1, 0)
    assert (applied.last, applied.seq) == (1, 2)
    assert (asked.flags, asked.last) == (SHOWN | ASKED, 2)
    assert page.kind == PAGE
    assert damage.damaged == 1


def test_frame_after_frame_waits() -> None:
    rig = DeviceUnderTest()
    wire = b"".join(data(n, n, DOT, CLEAR | COMMIT) for n in range(5))
    (first,) = rig.send(wire)
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
    rig = DeviceUnderTest()
    rig.request(data(0, 0, DOT, CLEAR | COMMIT))
    assert rig.send(wire) == []
    swap, refused = rig.tick()
    assert swap.frame == 0
    assert refused.error == error


def test_a_hello_does_not_wait_but_behind_a_packet_that_waits() -> None:
    rig = DeviceUnderTest()
    rig.request(data(0, 0, DOT, CLEAR | COMMIT))
    assert rig.request(hello(5)).kind == INFO
    rig.request(data(0, 0, DOT, CLEAR | COMMIT))
    assert rig.send(data(1, 1), hello(6)) == []
    swap, ack, info = rig.tick()
    assert (swap.kind, ack.kind, info.session) == (ACK, ACK, 6)


# The palette


def test_a_palette_belongs_to_its_page() -> None:
    """Each page has a palette of its own, which is shown with it."""
    rig = DeviceUnderTest(pixel_format="index8")
    bench = Bench(rig.device)
    default = bench.snapshot().palette
    assert default[:6] == b"\0\0\0\0\0\x55"
    assert len(default) == 768
    rig.request(data(0, 0, b"\6\1\0abc", CLEAR | COMMIT))
    assert bench.snapshot().palette == default
    (ack,) = rig.tick()
    assert bench.snapshot().palette == default[:3] + b"abc" + default[6:]
    assert bench.snapshot().digest == ack.digest != 0
    rig.show_frame(1, 1, b"\6\2\0def", flags=0)
    assert bench.snapshot().palette == default[:3] + b"abcdef" + default[9:]
    assert rig.show_frame(2, 2, b"").digest == 0
    assert bench.snapshot().palette == default
    rig.show_frame(3, 3, b"\6\1\0abc")
    rig.request(hello())
    rig.show_frame(0, 0, b"", flags=0)  # the front page stays as it is, with its palette
    assert bench.snapshot().palette == default[:3] + b"abc" + default[6:]
    bench.power_cycle()
    assert bench.snapshot().palette == default
    assert Bench(DeviceUnderTest().device).snapshot().palette == b""

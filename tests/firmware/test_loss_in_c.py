"""Losses and waiting in the receive ring of the reference device (sections 6, 9.2 and 11)."""

from __future__ import annotations

from collections.abc import Iterator

import c_device
import pytest
from c_device import HELLO, ScriptedDevice, all_features, build
from document import on_wire

pytestmark = pytest.mark.skipif(c_device.COMPILER is None, reason="no C compiler (cc)")

RING = 2000
WHOLE = on_wire(bytes((0x15, 0, 0)))
WAITING = on_wire(bytes((0x15, 1, 1)))
STATUS = on_wire(b"\x40\x09\0")
ACK, ERROR = 0x8, 0xB
OVERRUN = 13


@pytest.fixture
def device() -> Iterator[ScriptedDevice]:
    """A device that has a whole frame, and a packet of the next one that waits for the tick."""
    program = build((3, 5, 7), "index8", all_features("index8"), ring=RING)
    with ScriptedDevice(program, refresh=1) as device:
        device.send(HELLO)
        device.send_raw(WHOLE)
        assert device.send_raw(WAITING) == []
        yield device


def in_short(answers: list[bytes]) -> list[str]:
    """Answers as words: ACK with its last and the count of damage, ERROR with its code."""
    return [
        f"ACK {packet[3]} {packet[20]}" if packet[0] >> 4 == ACK else f"ERROR {packet[3]}"
        for packet in answers
    ]


def test_what_comes_behind_waits_too(device: ScriptedDevice) -> None:
    assert device.send_raw(STATUS + on_wire(HELLO)) == []
    answers = device.tick()
    assert in_short(answers[:3]) == ["ACK 0 0", "ACK 1 0", "ACK 9 0"]
    assert answers[3][0] >> 4 == 9


def test_exactly_the_credit_fits(device: ScriptedDevice) -> None:
    rest = RING - len(WAITING) - len(STATUS)
    assert device.send_raw(b"\1" * (rest - 1) + b"\0" + STATUS) == []
    assert in_short(device.tick()) == ["ACK 0 0", "ACK 1 0", "ACK 1 1", "ACK 9 1"]


def test_a_00_that_ends_nothing_takes_no_room(device: ScriptedDevice) -> None:
    rest = RING - len(WAITING) - len(STATUS)
    junk = b"\1" * (rest - 1) + b"\0"
    assert device.send_raw(b"\0" * 50 + junk + b"\0" * 3000 + STATUS + b"\0" * 10) == []
    assert in_short(device.tick()) == ["ACK 0 0", "ACK 1 0", "ACK 1 1", "ACK 9 1"]


@pytest.mark.parametrize("tail", [b"\2" * 20, b"\2" * 5, b""], ids=["long", "short", "none"])
def test_a_segment_cut_by_a_loss_counts_once(device: ScriptedDevice, tail: bytes) -> None:
    # All that is lost is reported once; the segment goes on to its 00, wherever that comes.
    assert in_short(device.send_raw(b"\1" * 3000)) == [f"ERROR {OVERRUN}", "ACK 0 1"]
    assert device.send_raw(b"\1" * 3000) == []
    assert in_short(device.tick()) == ["ACK 0 1", "ACK 1 1"]
    assert in_short(device.send_raw(tail + b"\0" + STATUS)) == ["ACK 9 1"]


def test_whole_packets_before_and_behind_a_loss_are_taken(device: ScriptedDevice) -> None:
    many = STATUS * (RING // len(STATUS) + 5)
    assert in_short(device.send_raw(many)) == [f"ERROR {OVERRUN}", "ACK 0 1"]
    fits = (RING - len(WAITING)) // len(STATUS)
    assert in_short(device.tick()) == ["ACK 0 1", "ACK 1 1", *["ACK 9 1"] * fits]
    assert in_short(device.send_raw(STATUS)) == ["ACK 9 1"]


def test_an_endless_segment_counts_once_and_loses_nothing_behind_it(device: ScriptedDevice) -> None:
    device.tick()
    assert device.send_raw(b"\1" * 9000) == []
    assert in_short(device.send_raw(b"\0" + STATUS)) == ["ACK 1 1", "ACK 9 1"]


def test_the_end_of_a_connection_ends_the_session_and_drops_what_waits(
    device: ScriptedDevice,
) -> None:
    device.disconnect()
    assert device.tick() == []
    (answer,) = device.send_raw(STATUS)
    assert answer[0] >> 4 == ERROR
    assert answer[3] == 1

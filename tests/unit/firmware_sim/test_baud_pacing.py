"""Baud-rate pacing of the emulator's line, in virtual time."""

import contextlib
import os
import socket
import threading
import time

import pytest
from device_packets import (
    ACK,
    CLEAR,
    COMMIT,
    INFO,
    PENDING,
    SHOWN,
    data,
    hello,
    parse_responses,
    status,
)

from firmware_sim import serve
from firmware_sim.baud_pacing import PacedDevice, PacedDirection, with_baud
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.in_process import open_in_process
from firmware_sim.readiness import wait_ready
from firmware_sim.serve import serve_wire

WAIT = 20


class Clock:
    def __init__(self):
        self.now = 1000.0

    def __call__(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


@pytest.fixture
def clock():
    return Clock()


@pytest.mark.parametrize("baud", [50, 9600, 115_200, 1_000_000, 12_000_000])
def test_ten_bits_a_byte(clock, baud):
    """Looked at in any rhythm, bytes come at a tenth of the rate, in order, the last in time."""
    pace = PacedDirection(baud, clock)
    sent = bytes(range(256)) * 8
    got, looks = b"", 0
    pace.put(sent)
    while (pause := pace.next_event_s()) is not None:
        clock.sleep(pause + (0.0003 if looks % 3 else 0))
        looks += 1
        got += pace.get()
        passed = (clock.now - 1000) * baud / 10
        assert abs(len(got) - min(len(sent), passed)) <= 1
    assert got == sent
    assert clock.now - 1000 == pytest.approx(len(sent) * 10 / baud, abs=0.0004)
    assert looks <= max(len(sent), 11), "and who waits need not look without end"


def test_no_byte_comes_early(clock):
    pace = PacedDirection(1000, clock)
    pace.put(b"ab")
    clock.sleep(0.0099)
    assert pace.get() == b""
    clock.sleep(0.0001)
    assert pace.get() == b"a"
    clock.sleep(0.009)
    assert pace.get() == b""
    assert pace.next_event_s() == pytest.approx(0.001)


def test_a_line_that_was_idle_begins_anew(clock):
    pace = PacedDirection(1000, clock)
    pace.put(b"a")
    clock.sleep(5)
    assert pace.get() == b"a"
    assert pace.next_event_s() is None
    pace.put(b"bc")
    assert pace.get() == b""
    clock.sleep(0.010)
    assert pace.get() == b"b"


def test_what_is_handed_over_meanwhile_follows_at_once(clock):
    pace = PacedDirection(1000, clock)
    pace.put(b"ab")
    clock.sleep(0.015)
    pace.put(b"cd")
    clock.sleep(0.025)
    assert pace.get() == b"abcd"


def test_so_much_waits_and_no_more(clock):
    pace = PacedDirection(115_200, clock)
    pace.put(bytes(4095))
    assert not pace.is_full
    pace.put(b"\0")
    assert pace.is_full
    pace.clear()
    assert not pace.is_full
    assert pace.next_event_s() is None
    fast = PacedDirection(12_000_000, clock)
    fast.put(bytes(59_999))
    assert not fast.is_full


def test_without_a_rate_a_wire_stays_as_it_is(clock):
    wire = DeviceOnLine(Device(Config((3, 5, 7))), clock=clock)
    assert with_baud(wire, 0) is wire
    assert with_baud(wire, 50).device is wire.device


def wire_on(clock, **settings):
    settings = {"refresh": 0, **settings}
    return PacedDevice(
        DeviceOnLine(Device(Config((3, 5, 7), **settings)), clock=clock), 1000, clock
    )


def test_an_answer_takes_the_line_both_ways(clock):
    wire = wire_on(clock)
    wire.receive(hello())
    got = b""
    while not got.endswith(b"\0"):
        clock.sleep(wire.next_event_s())
        got += wire.transmit()
    assert parse_responses(got)[0].kind == INFO
    assert clock.now - 1000 == pytest.approx((len(hello()) + len(got)) * 0.01, abs=0.001)
    assert wire.next_event_s() is None


def test_a_tick_and_the_line_go_on_side_by_side(clock):
    wire = wire_on(clock, refresh=2000)
    wire.receive(hello() + data(0, 0, b"\xa0", CLEAR | COMMIT))
    got = b""
    while (pause := wire.next_event_s()) is not None:
        clock.sleep(pause)
        got += wire.transmit()
    assert [(a.kind, a.flags) for a in parse_responses(got)] == [
        (INFO, 0),
        (ACK, PENDING),
        (ACK, SHOWN),
    ]
    assert wire.device.swaps == 1


def test_a_line_that_is_full_takes_nothing_from_the_device(clock):
    device = Device(Config((3, 5, 7), refresh=0))
    wire = PacedDevice(DeviceOnLine(device, clock=clock), 50_000, clock)
    asked, got = 2000, b""
    for _ in range(asked):
        wire.receive(status())
    while (pause := wire.next_event_s()) is not None:
        clock.sleep(pause)
        got += wire.transmit()
    assert len(parse_responses(got)) == asked


def test_a_line_that_is_cut_forgets_what_was_on_its_way(clock):
    wire = wire_on(clock)
    wire.receive(hello())
    clock.sleep(1)
    assert wire.next_event_s() is not None
    wire.disconnect()
    assert wire.next_event_s() is None
    assert wire.transmit() == b""


@contextlib.contextmanager
def served_until_full(wire, theirs, ours, data):
    """Serve a line on a socket, and write data to its other end until it takes no more."""
    theirs.setblocking(False)
    ours.settimeout(0.5)
    stop, stopper = os.pipe()
    pump = threading.Thread(target=serve_wire, args=(wire, theirs.fileno(), stop))
    pump.start()
    sent = 0
    with contextlib.suppress(TimeoutError):
        while sent < 50_000_000:
            sent += ours.send(data)
    try:
        yield
    finally:
        os.write(stopper, b"\0")
        pump.join(WAIT)
        for descriptor in (stop, stopper):
            os.close(descriptor)
        ours.close()
        theirs.close()
    assert not pump.is_alive()
    assert sent < 50_000_000


def test_a_host_that_reads_nothing_stops_the_device_and_not_the_pump(monkeypatch):
    """The answers wait before the line, then in the pump; then nothing is taken any more."""
    ours, theirs = socket.socketpair()
    for end in (ours, theirs):
        end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
    wire = with_baud(DeviceOnLine(Device(Config((3, 5, 7), refresh=0))), 100_000_000)
    looks = []

    def look(*arguments):
        looks.append(arguments[-1])
        return wait_ready(*arguments)

    monkeypatch.setattr(serve, "wait_ready", look)
    with served_until_full(wire, theirs, ours, status(1) * 100):
        before = len(looks)
        time.sleep(0.1)
        assert len(looks) - before < 20, "and who waits does not look without end"


def test_a_line_that_is_full_takes_nothing_from_the_host():
    ours, theirs = socket.socketpair()
    wire = with_baud(DeviceOnLine(Device(Config((3, 5, 7), refresh=0))), 50)
    with served_until_full(wire, theirs, ours, bytes(1000)):
        assert len(wire._down._queue) <= 2 * 4096


def test_in_process_a_full_line_makes_the_writer_wait():
    port = open_in_process("sim:?size=3x5x7&refresh=0&baud=230400")
    port.write(bytes(6000), 0)
    with pytest.raises(TimeoutError, match="full"):
        port.write(b"", 0)
    port.write(hello(), WAIT)
    got = b""
    while not got.endswith(b"\0"):
        got += port.read(WAIT)
    assert parse_responses(got)[0].kind == INFO
    port.write(data(0, 0, b"\xa0", CLEAR | COMMIT), WAIT)
    got = b""
    while not got.endswith(b"\0"):
        got += port.read(WAIT)
    assert (parse_responses(got)[0].kind, parse_responses(got)[0].flags) == (ACK, SHOWN)


def test_in_process_a_writer_that_waits_learns_of_the_end():
    port = open_in_process("sim:?size=3x5x7&baud=50")
    port.write(bytes(5000), 0)
    closer = threading.Timer(0.05, port.close)
    closer.start()
    with pytest.raises(ConnectionError):
        port.write(b"x", WAIT)
    closer.join()

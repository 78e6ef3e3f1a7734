"""Refresh ticks by a clock, and ports in the host's own process."""

import threading

import pytest
from device_packets import (
    ACK,
    CLEAR,
    COMMIT,
    DOT,
    INFO,
    PENDING,
    SHOWN,
    Clock,
    Response,
    data,
    hello,
    parse_responses,
    status,
)

from firmware_sim import in_process, serve
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.serve import (
    InProcessPort,
    open_in_process,
)

WAIT = 20  # seconds after which a test has failed; none takes so long


def test_ticks_do_not_drift() -> None:
    clock = Clock()
    wire = DeviceOnLine(Device(Config((3, 5, 7), refresh=30_000)), clock=clock)
    wire.receive(hello())
    assert wire.next_event_s() is None
    for number in range(90):
        clock.now = 1000 + number / 30 + 0.001 * (number % 30)
        wire.receive(data(number, number, DOT, CLEAR | COMMIT))
        assert wire.next_event_s() == pytest.approx(1000 + (number + 1) / 30 - clock.now)
    clock.now = 1003.1
    assert wire.next_event_s() is None
    shown = [
        a.frame for a in parse_responses(wire.transmit()) if a.kind == ACK and not a.flags & PENDING
    ]
    assert shown == list(range(90))


def test_a_tick_that_comes_while_it_is_asked_for_is_not_slept_through() -> None:
    clock = Clock()
    wire = DeviceOnLine(Device(Config((3, 5, 7), refresh=1_000_000)), clock=clock)
    wire.receive(hello() + data(0, 0, DOT, CLEAR | COMMIT))
    assert parse_responses(wire.transmit())[-1].flags & PENDING
    clock.now += 0.002
    assert wire.next_event_s() == 0
    assert wire.next_event_s() is None, "who does not carry it need not be told again"
    (ack,) = parse_responses(wire.transmit())
    assert not ack.flags & PENDING


def test_several_ticks_pass_at_once() -> None:
    clock = Clock()
    wire = DeviceOnLine(Device(Config((3, 5, 7), refresh=10_000)), clock=clock)
    wire.receive(hello() + b"".join(data(n, n, DOT, CLEAR | COMMIT) for n in range(4)))
    clock.now += 0.25
    wire.advance()
    assert wire.device.session.shown == 1
    clock.now += 10
    wire.advance()
    assert wire.device.session.shown == 3
    wire.receive(data(4, 4, DOT, CLEAR | COMMIT))
    wire.disconnect()
    assert wire.next_event_s() is None


def exchange(port: InProcessPort, wire: bytes) -> list[Response]:
    port.write(wire, 1)
    return parse_responses(port.read(1))


def test_a_port_in_process() -> None:
    port = open_in_process("sim:?size=3x5x7&format=MONO1&refresh=1000&boot=7&name=a%20cube")
    (info,) = exchange(port, b"\0" + hello())
    assert (info.nx, info.format, info.boot, info.refresh) == (3, 1, 7, 1_000_000)
    assert info.payload[29:36] == b"\x06a cube"
    *_, ack = exchange(port, data(0, 0, DOT, CLEAR | COMMIT))
    if ack.flags == PENDING:
        (ack,) = parse_responses(port.read(WAIT))
    assert ack.flags == SHOWN
    assert port.read(0) == b""
    assert port.read(0.001) == b""
    assert port.bench.snapshot().frame == 0
    port.close()
    port.close()
    with pytest.raises(ConnectionError):
        port.read(0)
    with pytest.raises(ConnectionError):
        port.write(b"", 0)


def test_a_swap_at_once_needs_no_waiting() -> None:
    port = open_in_process("sim:?refresh=0&rx_buffer=0x2000&max_payload=64&silent=3&serial=9")
    (info,) = exchange(port, hello())
    assert (info.rx_buffer, info.max_payload, info.nx) == (8192, 64, 128)
    (ack,) = exchange(port, data(0, 0, DOT, CLEAR | COMMIT))
    assert ack.flags == SHOWN


def test_who_reads_is_woken_by_who_writes() -> None:
    port = open_in_process("sim:?size=3x5x7")
    got = []
    reader = threading.Thread(target=lambda: got.append(port.read(WAIT)))
    reader.start()
    port.write(hello(), 1)
    reader.join(WAIT)
    assert parse_responses(got[0])[0].kind == INFO


def test_who_reads_is_woken_by_close() -> None:
    port = open_in_process("sim:?size=3x5x7")
    waiting = threading.Event()
    wait, seen = port._changed.wait, []

    def wait_and_tell(left: float) -> bool:
        waiting.set()
        return wait(left)

    port._changed.wait = wait_and_tell

    def read() -> None:
        try:
            port.read(WAIT)
        except ConnectionError:
            seen.append(True)

    reader = threading.Thread(target=read)
    reader.start()
    assert waiting.wait(WAIT)
    port.close()
    reader.join(WAIT)
    assert seen == [True]


def test_a_bad_line_in_process() -> None:
    port = open_in_process("sim:?size=3x5x7&fault=flip:1e-3,drop:1e-3&seed=3&features=")
    exchange(port, hello())
    for _ in range(300):
        exchange_badly(port, b"\0" + hello() + status())
    assert port.bench.counters().damaged > 0


def exchange_badly(port: InProcessPort, wire: bytes) -> None:
    port.write(wire, 1)
    port.read(0)


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("sim", "write sim:"),
        ("sim:x", "write sim:"),
        ("sim:?", "write sim:"),
        ("tcp:?size=1x1x1", "write sim:"),
        ("sim:?sise=1x1x1", "'sise' .* did you mean size"),
        ("sim:?qqqq=1", "there are size, format"),
        ("sim:?size=1x1x1&size=1x1x1", "'size' .* twice"),
        ("sim:?size=1", "size in .* three numbers"),
        ("sim:?size", "size in .* three numbers"),
        ("sim:?rx_buffer=many", "rx_buffer in .* whole number"),
        ("sim:?rx_buffer=9", "rx_buffer is 9"),
        ("sim:?format=rgb", "take one of"),
        ("sim:?fault=flap:1", "did you mean flip"),
        ("sim:?baud=9", "baud in .* 50 to"),
        ("sim:?seed=x", "seed in .* whole number"),
        ("sim:?features=palette", "'palette': take of line, box"),
        ("sim:?lie=all", "lie 'all': take of grid"),
    ],
)
def test_a_bad_url_is_refused_with_the_remedy(url: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        open_in_process(url)


def test_the_entry_point() -> None:
    assert serve.open_in_process is in_process.open_in_process


def test_a_line_that_stands_still_and_is_full_takes_nothing() -> None:
    port = open_in_process("sim:?size=3x5x7&fault=down.stall:1e99@1")
    for _ in range(7):
        port.write(bytes(10_000), 0)
    with pytest.raises(TimeoutError, match="full"):
        port.write(hello(), 0)


def test_who_waits_for_a_line_goes_on_when_it_moves() -> None:
    port = open_in_process("sim:?size=3x5x7&refresh=0&fault=down.delay:0.05@1")
    port.write(bytes(70_000), 0)
    port.write(hello(), WAIT)
    assert parse_responses(port.read(WAIT))[0].kind == INFO


def test_who_waits_for_a_line_is_woken_by_close() -> None:
    port = open_in_process("sim:?size=3x5x7&fault=down.stall:1e99@1")
    port.write(bytes(70_000), 0)
    port._changed.wait = lambda _: port.close()
    with pytest.raises(ConnectionError, match="closed"):
        port.write(hello(), WAIT)


def test_an_unplugged_device_is_gone() -> None:
    port = open_in_process("sim:?size=3x5x7&fault=unplug@20")
    port.write(hello(), 0)
    assert parse_responses(port.read(0))[0].kind == INFO
    with pytest.raises(ConnectionError, match="unplugged"):
        port.write(hello(), 0)
    with pytest.raises(ConnectionError, match="unplugged"):
        port.read(0)
    port.close()

"""Ports: in the host's process, pseudo-terminals, TCP, and the program."""

import contextlib
import json
import os
import runpy
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from simwire import (
    ACK,
    CLEAR,
    COMMIT,
    DOT,
    INFO,
    PENDING,
    SHOWN,
    Answer,
    answers,
    data,
    hello,
    status,
)

from firmware_sim import __main__ as program
from firmware_sim import in_process, serve
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.faults import parse_faults
from firmware_sim.serve import (
    InProcessPort,
    linked,
    listen,
    open_in_process,
    open_pty,
    serve_tcp,
    serve_wire,
)
from firmware_sim.wire import Wire

WAIT = 20  # seconds after which a test has failed; none takes so long
ROOT = Path(__file__).parents[2]


class Clock:
    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


def test_ticks_do_not_drift() -> None:
    clock = Clock()
    wire = Wire(Device(Config((3, 5, 7), refresh=30_000)), clock=clock)
    wire.receive(hello())
    assert wire.until_tick() is None
    for number in range(90):
        clock.now = 1000 + number / 30 + 0.001 * (number % 30)
        wire.receive(data(number, number, DOT, CLEAR | COMMIT))
        assert wire.until_tick() == pytest.approx(1000 + (number + 1) / 30 - clock.now)
    clock.now = 1003.1
    assert wire.until_tick() is None
    shown = [a.frame for a in answers(wire.transmit()) if a.kind == ACK and not a.flags & PENDING]
    assert shown == list(range(90))


def test_a_tick_that_comes_while_it_is_asked_for_is_not_slept_through() -> None:
    clock = Clock()
    wire = Wire(Device(Config((3, 5, 7), refresh=1_000_000)), clock=clock)
    wire.receive(hello() + data(0, 0, DOT, CLEAR | COMMIT))
    assert answers(wire.transmit())[-1].flags & PENDING
    clock.now += 0.002
    assert wire.until_tick() == 0
    assert wire.until_tick() is None, "who does not carry it need not be told again"
    (ack,) = answers(wire.transmit())
    assert not ack.flags & PENDING


def test_several_ticks_pass_at_once() -> None:
    clock = Clock()
    wire = Wire(Device(Config((3, 5, 7), refresh=10_000)), clock=clock)
    wire.receive(hello() + b"".join(data(n, n, DOT, CLEAR | COMMIT) for n in range(4)))
    clock.now += 0.25
    wire.advance()
    assert wire.device.session.shown == 1
    clock.now += 10
    wire.advance()
    assert wire.device.session.shown == 3
    wire.receive(data(4, 4, DOT, CLEAR | COMMIT))
    wire.disconnect()
    assert wire.until_tick() is None


# In the host's process


def exchange(port: InProcessPort, wire: bytes) -> list[Answer]:
    port.write(wire, 1)
    return answers(port.read(1))


def test_a_port_in_process() -> None:
    port = open_in_process("sim:?size=3x5x7&format=MONO1&refresh=1000&boot=7&name=a%20cube")
    (info,) = exchange(port, b"\0" + hello())
    assert (info.nx, info.format, info.boot, info.refresh) == (3, 1, 7, 1_000_000)
    assert info.payload[29:36] == b"\x06a cube"
    *_, ack = exchange(port, data(0, 0, DOT, CLEAR | COMMIT))
    if ack.flags == PENDING:
        (ack,) = answers(port.read(WAIT))
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
    assert answers(got[0])[0].kind == INFO


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
        ("sim:?sise=1x1x1", "'sise' .* did you mean 'size'"),
        ("sim:?qqqq=1", "did you mean"),
        ("sim:?size=1x1x1&size=1x1x1", "'size' .* twice"),
        ("sim:?size=1", "size in .* three numbers"),
        ("sim:?size", "size in .* three numbers"),
        ("sim:?rx_buffer=many", "rx_buffer in .* whole number"),
        ("sim:?rx_buffer=9", "rx_buffer is 9"),
        ("sim:?format=rgb", "take one of"),
        ("sim:?fault=flap:1", "did you mean flip"),
        ("sim:?baud=9", "baud in .* 50 to"),
        ("sim:?seed=x", "seed in .* whole number"),
        ("sim:?features=palette", "palette: take of line, box"),
        ("sim:?lie=all", "lie all: take of grid"),
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
    assert answers(port.read(WAIT))[0].kind == INFO


def test_who_waits_for_a_line_is_woken_by_close() -> None:
    port = open_in_process("sim:?size=3x5x7&fault=down.stall:1e99@1")
    port.write(bytes(70_000), 0)
    port._changed.wait = lambda _: port.close()
    with pytest.raises(ConnectionError, match="closed"):
        port.write(hello(), WAIT)


def test_an_unplugged_device_is_gone() -> None:
    port = open_in_process("sim:?size=3x5x7&fault=unplug@20")
    port.write(hello(), 0)
    assert answers(port.read(0))[0].kind == INFO
    with pytest.raises(ConnectionError, match="unplugged"):
        port.write(hello(), 0)
    with pytest.raises(ConnectionError, match="unplugged"):
        port.read(0)
    port.close()


# Pumps


@contextlib.contextmanager
def running(target: Callable[..., object], *args: object) -> Iterator[Callable[[], object]]:
    """Run a pump in a thread; yield a function that stops it and returns what it returned."""
    stop, stopper = os.pipe()
    result = []
    thread = threading.Thread(target=lambda: result.append(target(*args, stop)))
    thread.start()

    def finish() -> object:
        os.write(stopper, b"\0")
        thread.join(WAIT)
        assert not thread.is_alive()
        return result[0]

    try:
        yield finish
    finally:
        finish()
        os.close(stop)
        os.close(stopper)


def small(**settings: object) -> Wire:
    return Wire(Device(Config((3, 5, 7), **{"refresh": 1_000_000, **settings})))


def receive(connection: socket.socket, count: int) -> list[Answer]:
    got = b""
    while got.count(b"\0") < count:
        piece = connection.recv(65_536)
        assert piece
        got += piece
    return answers(got)


@pytest.fixture
def pair() -> Iterator[tuple[socket.socket, socket.socket]]:
    ours, theirs = socket.socketpair()
    ours.settimeout(WAIT)
    theirs.setblocking(False)
    with ours, theirs:
        yield ours, theirs


def test_a_pump_pumps(pair: tuple[socket.socket, socket.socket]) -> None:
    ours, theirs = pair
    with running(serve_wire, small(), theirs.fileno()) as finish:
        ours.sendall(b"\0" + hello())
        assert receive(ours, 1)[0].kind == INFO
        ours.sendall(data(0, 0, DOT, CLEAR | COMMIT))
        assert receive(ours, 2)[1].flags == SHOWN
        assert finish() is True


def test_a_pump_ends_with_its_line(pair: tuple[socket.socket, socket.socket]) -> None:
    ours, theirs = pair
    with running(serve_wire, small(), theirs.fileno()) as finish:
        ours.close()
        finish()


def test_a_line_that_has_ended_ends_the_pump(pair: tuple[socket.socket, socket.socket]) -> None:
    ours, theirs = pair
    stop, stopper = os.pipe()
    ours.sendall(hello())
    ours.shutdown(socket.SHUT_WR)
    assert serve_wire(small(), theirs.fileno(), stop) is False
    os.close(stop)
    os.close(stopper)


def test_a_line_that_breaks_ends_the_pump(
    pair: tuple[socket.socket, socket.socket], monkeypatch: pytest.MonkeyPatch
) -> None:
    ours, theirs = pair
    ours.sendall(hello())
    faults = [BlockingIOError(), BrokenPipeError()]

    def write(_line: int, _data: bytes) -> int:
        raise faults.pop(0)

    monkeypatch.setattr(serve.os, "write", write)
    stop, stopper = os.pipe()
    assert serve_wire(small(), theirs.fileno(), stop) is False
    assert faults == []
    os.close(stop)
    os.close(stopper)


def test_a_pump_ends_when_the_device_is_unplugged(
    pair: tuple[socket.socket, socket.socket],
) -> None:
    ours, theirs = pair
    wire = small()
    wire = Wire(wire.device, parse_faults("unplug@3"))
    stop, stopper = os.pipe()
    ours.sendall(hello())
    assert serve_wire(wire, theirs.fileno(), stop) is False
    os.close(stop)
    os.close(stopper)


def test_a_pump_takes_nothing_from_a_line_that_stands_still(
    pair: tuple[socket.socket, socket.socket],
) -> None:
    ours, theirs = pair
    wire = Wire(small().device, parse_faults("down.delay=1e99@1"))
    sent = 0
    ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
    with running(serve_wire, wire, theirs.fileno()) as finish:
        ours.settimeout(0.01)
        for _ in range(2000):  # until it is full, and what stands in front of it too
            try:
                sent += ours.send(b"\x55" * 1000)
            except TimeoutError:
                if wire._down.backlog >= 65_536:
                    break
        assert finish() is True
    assert 65_536 <= wire._down.backlog < 65_536 + 4096
    assert wire._down.backlog < sent < 1_000_000


def test_tcp_serves_again_after_an_unplug() -> None:
    with listen("127.0.0.1", 0) as listener:
        wire = Wire(small().device, parse_faults("unplug@20"))
        with running(serve_tcp, wire, listener):
            for _ in range(2):
                with connect(listener) as host:
                    host.sendall(hello())
                    assert receive(host, 1)[0].kind == INFO
                    host.sendall(hello())
                    if wire.device.taken[3] < 2:
                        assert host.recv(100) == b""


def test_a_host_that_never_reads_is_not_read(pair: tuple[socket.socket, socket.socket]) -> None:
    """What the host does not read must not make the output grow, nor stop the pump."""
    ours, theirs = pair
    ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
    theirs.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
    wire = small()
    sent = 0
    with running(serve_wire, wire, theirs.fileno()) as finish:
        ours.sendall(hello())
        ours.settimeout(0.3)
        with contextlib.suppress(TimeoutError):
            while sent < 10_000_000:
                sent += ours.send(status(1) * 100)
        assert finish() is True
    assert 0 < sent < 1_000_000
    assert len(wire.device._out) < 200_000


def test_hosts_may_come_and_go_on_a_pty() -> None:
    with open_pty() as (line, name), running(serve_wire, small(), line):
        for session in (1, 2):
            host = os.open(name, os.O_RDWR | os.O_NOCTTY)
            everything = hello(session, more=bytes(range(1, 256)) + b"\r\n\x03\x04\x11\x13\x7f")
            os.write(host, b"\0" + everything)
            got = b""
            while not got.endswith(b"\0"):
                got += os.read(host, 4096)
            (info,) = answers(got)
            assert info.session == session
            os.close(host)


def test_a_link_is_replaced_and_removed(tmp_path: Path) -> None:
    link = tmp_path / "port"
    link.symlink_to("/nowhere")
    with linked(link, "/dev/null"):
        assert link.readlink() == Path("/dev/null")
    assert list(tmp_path.iterdir()) == []
    with linked(link, "/dev/null"):
        link.unlink()
        link.symlink_to("/another")
    assert link.readlink() == Path("/another")
    link.unlink()
    link.write_text("a file")
    with pytest.raises(FileExistsError, match="no link"), linked(link, "/dev/null"):
        pass
    assert link.read_text() == "a file"


def connect(listener: socket.socket) -> socket.socket:
    return socket.create_connection(listener.getsockname()[:2], WAIT)


def test_tcp_serves_one_connection_at_a_time() -> None:
    """One connection at a time; what was not taken is dropped with it, and the session ends."""
    with listen("127.0.0.1", 0) as listener:
        wire = small(refresh=1)
        with running(serve_tcp, wire, listener) as finish:
            with connect(listener) as first:
                first.sendall(hello() + data(0, 0, DOT, CLEAR | COMMIT) + data(1, 1, DOT))
                assert [a.kind for a in receive(first, 2)] == [INFO, ACK]
                second = connect(listener)
                second.sendall(status())
            with second:
                (error,) = receive(second, 1)
                assert error.error == (1, 0)
                second.sendall(hello())
                assert receive(second, 1)[0].kind == INFO
                finish()
        assert wire.device.swaps == 0


def test_nobody_else_may_listen_unasked() -> None:
    with pytest.raises(PermissionError, match="--allow-remote"):
        listen("0.0.0.0", 0)  # noqa: S104
    with listen("0.0.0.0", 0, remote=True):  # noqa: S104
        pass


# The program


@contextlib.contextmanager
def started(*arguments: str, end: int = signal.SIGTERM) -> Iterator[dict[str, str]]:
    process = subprocess.Popen(
        [sys.executable, "-m", "firmware_sim", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=ROOT,
    )
    try:
        yield json.loads(process.stdout.readline())
        process.send_signal(end)
        out, err = process.communicate(timeout=WAIT)
        assert (process.returncode, out, err) == (0, b"", b"")
    finally:
        process.kill()
        process.communicate()


def test_the_program_on_a_pty(tmp_path: Path) -> None:
    link, picture = tmp_path / "port", tmp_path / "front.npy"
    with started(
        "--link", str(link), "--size", "3x5x7", "--refresh", "1000", "--dump", str(picture)
    ) as place:
        assert place == {"port": str(link.readlink()), "size": "3x5x7", "format": "rgb888"}
        assert not np.load(picture).any()
        host = os.open(link, os.O_RDWR | os.O_NOCTTY)
        os.write(host, b"\0" + hello() + data(0, 0, DOT, CLEAR | COMMIT))
        got = b""
        while not got or answers(got)[-1].flags != SHOWN:
            got += os.read(host, 1)
            while not got.endswith(b"\0"):
                got += os.read(host, 1)
        os.close(host)
        assert np.load(picture).sum() == 3 * 255
    assert not link.is_symlink()


def test_the_program_on_tcp() -> None:
    with started(
        "--tcp", "127.0.0.1:0", "--format", "mono1", "--refresh", "0", end=signal.SIGINT
    ) as place:
        port = place["port"].removeprefix("tcp://127.0.0.1:")
        with socket.create_connection(("127.0.0.1", int(port)), WAIT) as connection:
            connection.sendall(hello() + data(0, 0, DOT, CLEAR | COMMIT))
            info, ack = receive(connection, 2)
            assert (info.nx, info.format, info.refresh) == (128, 1, 0)
            assert ack.flags == SHOWN


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--size", "3x5"], "three numbers of voxels like 128x128x128"),
        (["--size", "0x5x5"], "take sides from 1 to 65535"),
        (["--format", "rgb"], "choose from"),
        (["--refresh", "fast"], "number of hertz"),
        (["--baud", "fast"], "whole number"),
        (["--baud", "49"], "take a number from 50"),
        (["--rx-buffer", "9"], "take a number from 1101"),
        (["--fault", "flop=1"], "did you mean flip"),
        (["--features", "palette"], "palette: take of line, box"),
        (["--lie", "all"], "lie all: take of grid"),
        (["--seed", "x"], "whole number"),
        (["--tcp", "5000"], "HOST:PORT like 127.0.0.1:5000"),
        (["--tcp", "localhost:99999"], "HOST:PORT like 127.0.0.1:5000"),
        (["--tcp", "0.0.0.0:0"], "--allow-remote"),
        (["--tcp", "127.0.0.1:0", "--pty"], "not allowed with"),
        (["--tcp", "127.0.0.1:0", "--link", "x"], "leave out --tcp"),
        (["--usbip", "127.0.0.1:0", "--link", "x"], "leave out --tcp and --usbip"),
        (["--usbip", "here"], "HOST:PORT like 127.0.0.1:5000"),
        (["--usbip", "0.0.0.0:0"], "--allow-remote"),
        (["--usb-class", "vendor"], "--usb-class is for --usbip"),
        (["--dump", "/nowhere/at/all.npy"], "/nowhere"),
        (["--link", "/nowhere/at/all"], "/nowhere"),
    ],
)
def test_bad_arguments_are_refused_with_the_remedy(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as end:
        program.main(arguments)
    assert end.value.code == 2
    assert message in capsys.readouterr().err


def test_help_has_examples(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["voxdisplay-sim", "--help"])
    with pytest.raises(SystemExit) as end:
        runpy.run_path(program.__file__, run_name="__main__")
    assert end.value.code == 0
    assert "voxdisplay-sim --tcp 127.0.0.1:5000" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "port"),
    [
        (["--pty"], "/dev/"),
        (["--link", "LINK"], "/dev/"),
        (["--tcp", "127.0.0.1:0"], "tcp://127.0.0.1:"),
        (["--tcp", "[::1]:0"], "tcp://[::1]:"),
        (["--tcp", "0.0.0.0:0", "--allow-remote"], "tcp://0.0.0.0:"),
        (["--usbip", "127.0.0.1:0"], "usbip://127.0.0.1:"),
        (["--usbip", "127.0.0.1:0", "--usb-class", "cdc-acm"], "usbip://127.0.0.1:"),
    ],
)
def test_the_program_in_this_process(
    arguments: list[str],
    port: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if "[::1]:0" in arguments:
        try:
            listen("::1", 0).close()
        except OSError:
            pytest.skip("no IPv6 here")
    announce = program._announce

    def announce_and_end(*place: object) -> None:
        announce(*place)
        os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr(program, "_announce", announce_and_end)
    arguments = [str(tmp_path / "port") if a == "LINK" else a for a in arguments]
    before = signal.getsignal(signal.SIGTERM)
    assert program.main(arguments) == 0
    assert signal.getsignal(signal.SIGTERM) is before
    assert json.loads(capsys.readouterr().out)["port"].startswith(port)
    assert list(tmp_path.iterdir()) == []


def test_a_picture_that_cannot_be_dumped_does_not_stop_the_device(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    device = Device(Config((3, 5, 7), refresh=0))
    folder = tmp_path / "pictures"
    folder.mkdir()
    program._dump_swaps(device, folder / "front.npy")
    device.receive(hello() + data(0, 0, DOT, CLEAR | COMMIT))
    assert np.load(folder / "front.npy")[0, 0, 0].tolist() == [255, 255, 255]
    (folder / "front.npy").unlink()
    folder.rmdir()
    device.receive(data(1, 1, b"", CLEAR | COMMIT))
    assert "not dumped" in capsys.readouterr().err
    assert device.swaps == 2

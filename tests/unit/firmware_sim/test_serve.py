"""Event loops on pseudo-terminals and TCP."""

import contextlib
import os
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from device_packets import (
    ACK,
    CLEAR,
    COMMIT,
    DOT,
    INFO,
    SHOWN,
    data,
    hello,
    parse_responses,
    receive,
    status,
)

from firmware_sim import serve
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.faults import parse_faults
from firmware_sim.serve import (
    listen_tcp,
    open_pty,
    serve_tcp,
    serve_wire,
    symbolic_link,
)

WAIT = 20  # seconds after which a test has failed; none takes so long


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


def small(**settings: object) -> DeviceOnLine:
    return DeviceOnLine(Device(Config((3, 5, 7), **{"refresh": 1_000_000, **settings})))


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
    wire = DeviceOnLine(wire.device, parse_faults("unplug@3"))
    stop, stopper = os.pipe()
    ours.sendall(hello())
    assert serve_wire(wire, theirs.fileno(), stop) is False
    os.close(stop)
    os.close(stopper)


def test_a_pump_takes_nothing_from_a_line_that_stands_still(
    pair: tuple[socket.socket, socket.socket],
) -> None:
    ours, theirs = pair
    wire = DeviceOnLine(small().device, parse_faults("down.delay=1e99@1"))
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
    with listen_tcp("127.0.0.1", 0) as listener:
        wire = DeviceOnLine(small().device, parse_faults("unplug@20"))
        with running(serve_tcp, wire, listener):
            for _ in range(2):
                with connect(listener) as host:
                    host.sendall(hello())
                    assert receive(host, 1)[0].kind == INFO
                    host.sendall(hello())
                    if wire.device.taken_by_type[3] < 2:
                        assert host.recv(100) == b""


def test_a_host_that_never_reads_is_not_read(pair: tuple[socket.socket, socket.socket]) -> None:
    """A host that does not read makes neither the output grow nor the event loop stop."""
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
            (info,) = parse_responses(got)
            assert info.session == session
            os.close(host)


def test_a_link_is_replaced_and_removed(tmp_path: Path) -> None:
    link = tmp_path / "port"
    link.symlink_to("/nowhere")
    with symbolic_link(link, "/dev/null"):
        assert link.readlink() == Path("/dev/null")
    assert list(tmp_path.iterdir()) == []
    with symbolic_link(link, "/dev/null"):
        link.unlink()
        link.symlink_to("/another")
    assert link.readlink() == Path("/another")
    link.unlink()
    link.write_text("a file")
    with pytest.raises(FileExistsError, match="no link"), symbolic_link(link, "/dev/null"):
        pass
    assert link.read_text() == "a file"


def connect(listener: socket.socket) -> socket.socket:
    return socket.create_connection(listener.getsockname()[:2], WAIT)


def test_tcp_serves_one_connection_at_a_time() -> None:
    """One connection at a time; what was not taken is dropped with it, and the session ends."""
    with listen_tcp("127.0.0.1", 0) as listener:
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
        listen_tcp("0.0.0.0", 0)  # noqa: S104
    with listen_tcp("0.0.0.0", 0, remote=True):  # noqa: S104
        pass

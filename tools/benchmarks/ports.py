"""Benchmark of the transports beside the bare pipe below each, in one run.

At the other end of each is the same small peer in a process of its own, which counts, sends and
echoes bytes; so the difference to the bare pipe is the cost of the driver's transport. To measure
another kind of port, add an entry to `PORTS`.
"""

from __future__ import annotations

import contextlib
import os
import socket
import statistics
import struct
import time
import tty
import warnings
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

from serial import rfc2217

from benchmarks.usb import on_usb, on_usbip
from voxdisplay.display.handshake import request_info
from voxdisplay.errors import TransportError
from voxdisplay.transport import Transport, open_transport

_HEAD = struct.Struct("<cQ")
_SINK, _ECHO, _GIVE = b"S", b"E", b"G"
_CHUNK = 1 << 16
_ECHOED = 64
_DEADLINE_S = 60.0


class Peer:
    """Peer at the other end: bytes in, bytes out."""

    def __init__(self) -> None:
        self._head = b""
        self._kind = b""
        self._left = 0

    def feed(self, data: bytes) -> bytes:
        """Return the answer to some bytes."""
        out = bytearray()
        while data:
            if not self._left:
                need = _HEAD.size - len(self._head)
                self._head, data = self._head + data[:need], data[need:]
                if len(self._head) < _HEAD.size:
                    break
                self._kind, self._left = _HEAD.unpack(self._head)
                self._head = b""
                if self._kind == _GIVE:
                    out += bytes(self._left)
                    self._left = 0
                continue
            piece, data = data[: self._left], data[self._left :]
            self._left -= len(piece)
            if self._kind == _ECHO:
                out += piece
            elif not self._left:
                out += b"!"
        return bytes(out)


def in_another_process(serve: Callable[[], None]) -> int:
    """Run a function in a process of its own; return its id."""
    if child := os.fork():
        return child
    try:
        serve()
    except OSError:  # the other end was closed: that was all
        pass
    finally:
        os._exit(0)


def serve_descriptor(descriptor: int) -> None:
    """Be the peer on a descriptor that blocks."""
    peer = Peer()
    while data := os.read(descriptor, _CHUNK):
        out = memoryview(peer.feed(data))
        while out:
            out = out[os.write(descriptor, out) :]


def serve_rfc2217(connection: socket.socket) -> None:
    """Be the peer behind a server of RFC 2217."""
    line = SimpleNamespace(baudrate=9600, bytesize=8, parity="N", stopbits=1, dtr=True, rts=True)
    line.cts = line.dsr = line.cd = line.ri = False
    line.reset_input_buffer = line.reset_output_buffer = lambda: None
    manager = rfc2217.PortManager(line, SimpleNamespace(write=connection.sendall))
    peer = Peer()
    while data := connection.recv(_CHUNK):
        out = peer.feed(b"".join(manager.filter(data)))
        connection.sendall(out.replace(b"\xff", b"\xff\xff"))


class Bare:
    """File descriptor as a transport, with nothing around it: the reference of the comparison."""

    port = "bare"

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor

    def read(self, timeout_s: float) -> bytes:
        """See `Transport.read`; it waits for ever."""
        del timeout_s
        return os.read(self._descriptor, _CHUNK)

    def write(self, data: bytes, timeout_s: float) -> None:
        """See `Transport.write`; it waits for ever."""
        del timeout_s
        view = memoryview(data)
        while view:
            view = view[os.write(self._descriptor, view) :]

    def close(self) -> None:
        """See `Transport.close`."""
        os.close(self._descriptor)


@contextlib.contextmanager
def on_pty(*, bare: bool) -> Iterator[Transport]:
    """Yield a pty with the peer at its other end."""
    master, slave = os.openpty()
    tty.setraw(slave)

    def serve() -> None:
        os.close(slave)
        serve_descriptor(master)

    child = in_another_process(serve)
    transport = Bare(os.dup(slave)) if bare else open_transport(os.ttyname(slave))
    os.close(slave)
    try:
        yield transport
    finally:
        transport.close()
        os.close(master)
        os.waitpid(child, 0)


@contextlib.contextmanager
def on_socket(scheme: str | None) -> Iterator[Transport]:
    """Yield a connection with the peer at its other end; a bare one if ``scheme`` is None."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        host, number = listener.getsockname()

        def serve() -> None:
            connection, _ = listener.accept()
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            if scheme == "rfc2217":
                serve_rfc2217(connection)
            else:
                serve_descriptor(connection.fileno())

        child = in_another_process(serve)
        if scheme:
            transport = open_transport(f"{scheme}://{host}:{number}")
        else:
            ours = socket.create_connection((host, number))
            ours.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            transport = Bare(ours.detach())
        try:
            yield transport
        finally:
            transport.close()
            os.waitpid(child, 0)


@dataclass(frozen=True)
class Port:
    """Kind of port: how to open it, the pipe below it, and the size of the transfers."""

    name: str
    opened: Callable[[], AbstractContextManager[Transport]]
    below: str = ""
    bytes: int = 1 << 24


PORTS = [
    Port("bare pty", lambda: on_pty(bare=True)),
    Port("/dev/pts/N", lambda: on_pty(bare=False), "bare pty"),
    Port("bare TCP", lambda: on_socket(None)),
    Port("tcp://", lambda: on_socket("tcp"), "bare TCP"),
    Port("socket://", lambda: on_socket("socket"), "bare TCP"),
    Port("rfc2217://", lambda: on_socket("rfc2217"), "bare TCP", 1 << 19),
    Port("usb:", lambda: on_usb(Peer().feed)),
    Port("usbip://", lambda: on_usbip(Peer().feed, in_another_process), "bare TCP"),
]


def fetch(transport: Transport, count: int) -> None:
    """Read ``count`` bytes."""
    end_s = time.monotonic() + _DEADLINE_S
    while count > 0:
        count -= len(transport.read(1.0))
        if time.monotonic() > end_s:
            raise TransportError(f"{count} bytes did not come")


def seconds(function: Callable[..., Any], *arguments: Any) -> float:
    """Return the time of a call in seconds."""
    began_s = time.perf_counter()
    function(*arguments)
    return time.perf_counter() - began_s


def to_device(transport: Transport, count: int) -> None:
    """Send bytes; return when the peer reports that it has all of them."""
    transport.write(_HEAD.pack(_SINK, count) + bytes(count), _DEADLINE_S)
    fetch(transport, 1)


def from_device(transport: Transport, count: int) -> None:
    """Have the peer send bytes."""
    transport.write(_HEAD.pack(_GIVE, count), _DEADLINE_S)
    fetch(transport, count)


def round_trip(transport: Transport) -> None:
    """Have a small packet's worth of bytes come back."""
    transport.write(_HEAD.pack(_ECHO, _ECHOED) + bytes(_ECHOED), _DEADLINE_S)
    fetch(transport, _ECHOED)


@dataclass(frozen=True)
class Speed:
    """Measurement: bytes per second each way, and round trip in seconds."""

    down: float
    up: float
    trip_s: float


def measure(port: Port, repeats: int, scale: float) -> Speed:
    """Return the median speeds of a port."""
    count = int(port.bytes * scale)
    with port.opened() as transport:
        down = [seconds(to_device, transport, count) for _ in range(repeats)]
        up = [seconds(from_device, transport, count) for _ in range(repeats)]
        trips = [seconds(round_trip, transport) for _ in range(20 * repeats)]
    middle = statistics.median
    return Speed(count / middle(down), count / middle(up), middle(trips))


def bench_ports(repeats: int, *, quick: bool = False) -> None:
    """Print the table."""
    warnings.filterwarnings("ignore", "set(Daemon|Name)", DeprecationWarning)  # of pyserial
    head = f"{'port':<14}{'to device':>12}{'from device':>12}{'round trip':>12}"
    print(f"{head}   of the bare pipe below")
    measured: dict[str, Speed] = {}
    for port in PORTS:
        speed = measured[port.name] = measure(port, repeats, 0.02 if quick else 1.0)
        beside = ""
        if below := measured.get(port.below):
            beside = (
                f"   {speed.down / below.down:>5.0%}{speed.up / below.up:>7.0%}"
                f"{speed.trip_s / below.trip_s:>7.2f}x"
            )
        print(
            f"{port.name:<14}{speed.down / 1e6:>7.1f} MB/s{speed.up / 1e6:>7.1f} MB/s"
            f"{speed.trip_s * 1e6:>9.0f} us{beside}",
            flush=True,
        )
    transport = open_transport("sim:")
    trips = [seconds(request_info, transport, 1.0) for _ in range(20 * repeats)]
    transport.close()
    print(f"{'sim:':<14}{'':>24}{statistics.median(trips) * 1e6:>9.0f} us   HELLO and INFO")
    print(f"medians of {repeats}; round trips of {_ECHOED} bytes, medians of {20 * repeats}")

"""What USB costs: the driver over emulated USB, beside pyusb alone and a bare TCP connection.

Rows for ``tools/bench.py ports``; in this process, and over USB/IP to another one.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import statistics
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import usb.core
import usb.util

from firmware_sim.serve import listen
from firmware_sim.usb import open_usbip
from firmware_sim.usb.backend import Backend
from firmware_sim.usb.descriptors import BULK, Descriptors, Endpoint, Interface
from firmware_sim.usb.device import Setup, UsbDevice
from firmware_sim.usb.function import TRIPLE
from firmware_sim.usb.host import Bus
from firmware_sim.usb.usbip_server import serve_usbip
from voxdisplay.transport.usb import UsbTransport

PACKET = 512
CHUNK = 1 << 16
WORD = bytes(64)
ECHO, SINK, SOURCE = range(3)
_OUT, _IN = 0x01, 0x81
_SECONDS = 0.3  # for each figure


class Mirror:
    """A function that swallows, or gives back, or gives without end."""

    def __init__(self) -> None:
        ends = (Endpoint(_OUT, BULK, PACKET), Endpoint(_IN, BULK, PACKET))
        interface = Interface(0, TRIPLE, ends)
        self.descriptors = Descriptors(0x1209, 0x0001, "", "mirror", "", (interface,))
        self._mode = ECHO
        self._waiting: deque[bytes] = deque()

    def takes(self, endpoint: int, size: int) -> bool:
        """See `Function.takes`."""
        del endpoint, size
        return True

    def receive(self, endpoint: int, packet: bytes) -> None:
        """See `Function.receive`."""
        del endpoint
        if self._mode == ECHO and packet:
            self._waiting.append(packet)

    def packet(self, endpoint: int) -> bytes | None:
        """See `Function.packet`."""
        del endpoint
        if self._mode == SOURCE:
            return bytes(PACKET)
        return self._waiting.popleft() if self._waiting else None

    def request(self, setup: Setup, data: bytes) -> bytes:
        """See `Function.request`: choose a mode."""
        del data
        self._mode = setup.value
        return b""

    def reset(self) -> None:
        """See `Function.reset`."""
        self._waiting.clear()

    def until_due(self) -> None:
        """See `Function.until_due`."""


@dataclass(frozen=True)
class Row:
    """What one kind of pipe does: megabytes a second each way, and microseconds there and back."""

    name: str
    out_mb_s: float
    in_mb_s: float
    round_trip_us: float


@dataclass(frozen=True)
class Pipe:
    """Ways to move bytes; ``mode`` tells the other end what to do with them."""

    write: Callable[[bytes], object]
    read: Callable[[], int]  # bytes that came
    mode: Callable[[int], object]


def usb_rows(repeats: int) -> list[Row]:
    """Measure all."""
    rows = []
    device = UsbDevice(Mirror())
    backend = Backend(Bus(device))
    rows.append(_measure("pyusb in process", _pyusb(backend), repeats))
    rows.append(_measure("usb: in process", _driver(backend), repeats))
    with _other_process("usbip") as (host, port):
        backend = open_usbip(f"usbip://{host}:{port}")
        rows.append(_measure("pyusb over USB/IP", _pyusb(backend), repeats))
        rows.append(_measure("usbip:// to another process", _driver(backend), repeats))
    with _other_process("tcp") as address, socket.create_connection(address) as sock:
        rows.append(_measure("bare TCP to another process", _tcp(sock), repeats))
    return rows


def print_rows(rows: list[Row]) -> None:
    """Print a table."""
    print(f"{'pipe':<30}{'out MB/s':>10}{'in MB/s':>10}{'round trip us':>15}")
    for row in rows:
        figures = f"{row.out_mb_s:10.1f}{row.in_mb_s:10.1f}{row.round_trip_us:15.0f}"
        print(f"{row.name:<30}{figures}")


def _measure(name: str, made: contextlib.AbstractContextManager[Pipe], repeats: int) -> Row:
    with made as pipe:

        def out() -> float:
            pipe.mode(SINK)
            return _rate(lambda: (pipe.write(bytes(CHUNK)) and 0) or CHUNK) / 1e6

        def into() -> float:
            pipe.mode(SOURCE)
            return _rate(pipe.read) / 1e6

        def there_and_back() -> float:
            pipe.mode(ECHO)

            def once() -> int:
                pipe.write(WORD)
                got = 0
                while got < len(WORD):
                    got += pipe.read()
                return 1

            return 1e6 / _rate(once)

        def median(figure: Callable[[], float]) -> float:
            return statistics.median(figure() for _ in range(repeats))

        # What is on its way when the mode changes would be read as an echo: that one comes first.
        round_trip_us = median(there_and_back)
        return Row(name, median(out), median(into), round_trip_us)


def _rate(do: Callable[[], int]) -> float:
    """Do something again and again; give how much of it was done in a second."""
    began_s = time.perf_counter()
    done = 0
    while (spent_s := time.perf_counter() - began_s) < _SECONDS:
        done += do()
    return done / spent_s


@contextlib.contextmanager
def _pyusb(backend: Any) -> Iterator[Pipe]:
    device: Any = usb.core.find(backend=backend)
    buffer = usb.util.create_buffer(CHUNK)
    try:
        yield Pipe(
            lambda data: device.write(_OUT, data, 5000),
            lambda: device.read(_IN, buffer, 5000),
            lambda mode: device.ctrl_transfer(0x40, 1, mode),
        )
    finally:
        usb.util.dispose_resources(device)


@contextlib.contextmanager
def _driver(backend: Any) -> Iterator[Pipe]:
    with contextlib.closing(UsbTransport("usb:", backend=backend)) as pipe:
        yield Pipe(
            lambda data: pipe.write(data, 5.0),
            lambda: len(pipe.read(5.0)),
            lambda mode: pipe._device.ctrl_transfer(0x40, 1, mode),  # noqa: SLF001 - the bench's own
        )


@contextlib.contextmanager
def _tcp(sock: socket.socket) -> Iterator[Pipe]:
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    modes = {ECHO: b"e", SINK: b"s", SOURCE: b"g"}
    yield Pipe(sock.sendall, lambda: len(sock.recv(CHUNK)), lambda mode: sock.sendall(modes[mode]))


@contextlib.contextmanager
def _other_process(kind: str) -> Iterator[tuple[str, int]]:
    command = [sys.executable, __file__, kind]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None  # noqa: S101 - it is a pipe
        try:
            host, port = json.loads(process.stdout.readline())
            yield host, port
        finally:
            process.terminate()


def _serve(kind: str) -> None:
    with listen("127.0.0.1", 0) as listener:
        print(json.dumps(listener.getsockname()[:2]), flush=True)
        if kind == "usbip":
            serve_usbip(UsbDevice(Mirror()), listener, os.pipe()[0])
            return
        sock, _ = listener.accept()
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        mode = b"e"
        with contextlib.suppress(ConnectionError):
            while data := sock.recv(CHUNK):
                # Modes come as one letter, data as zeros.
                mode = data.strip(b"\0")[-1:] or mode
                if mode == b"e":
                    sock.sendall(data.replace(b"e", b""))
                while mode == b"g":
                    sock.sendall(bytes(CHUNK))


if __name__ == "__main__":
    if sys.argv[1:]:
        _serve(sys.argv[1])
    else:
        print_rows(usb_rows(3))

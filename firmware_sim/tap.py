"""Tap: out-of-band access to the front page for one watcher at a time.

It is no part of protocol.md: no device has it and no host may need it. It shows what *is* on
display, as a person in front of the display would see it, whoever speaks to the device meanwhile.

The tap listens on TCP, on this machine only. A watcher sends requests and gets a response to each:

- The request is 6 bytes: the picture that the watcher has, as the u16 ``boot`` and the u32
  ``swaps`` of its header. A watcher that has none sends FF in all bytes.
- The response comes as soon as another picture is on display: a header, and the front page as it is
  in memory, that is ``nx * ny * nz`` pixels in scan order (protocol.md, section 2.1), with a byte
  per voxel of MONO1. A page of INDEX8 is followed by its palette: 256 times red, green and blue, a
  byte each. Pictures in between are left out: only the newest counts.

The header is 40 bytes, its integers unsigned and little-endian:

- ``VXT1``, 4 bytes
- u16 boot: boot id of the device
- u16 frame: frame id on display; FFFF if no frame of the open session is
- u16 nx, u16 ny, u16 nz
- u16 format: number of the pixel format (protocol.md, section 2.1)
- u32 swaps since the device started
- u32 digest of the page (protocol.md, section 8)
- u32 packets taken, u32 packets refused, u32 damaged segments, and u32 overruns of the receive
  ring; all since the device started, modulo 2^32 like the swaps

A watcher that sends a request before the response to the one before is disconnected. The tap must
not slow the device down: a page is copied only for a request, and copying takes no more than about
a twentieth of the time.
"""

import contextlib
import socket
import struct
import threading
import time
from collections.abc import Iterable, Iterator
from typing import Final, Self

from firmware_sim import spec
from firmware_sim.bench import Bench, Snapshot
from firmware_sim.device import Device
from firmware_sim.readiness import wait_ready
from firmware_sim.serve import accept

_HOST: Final = "127.0.0.1"
_REQUEST: Final = struct.Struct("<HI")
_HEADER: Final = struct.Struct("<4sHHHHHHIIIIII")
_MAGIC: Final = b"VXT1"
_NO_FRAME: Final = 0xFFFF
_IDLE_FACTOR: Final = 20  # pause after copying a page, in multiples of the time that it took
_SEND_BYTES: Final = 1 << 23  # most of a page in one call, to bound what a large volume takes
_U32: Final = 0xFFFFFFFF


class Tap:
    """Server of watchers, in a thread of its own. Use it as a context manager, or `close` it.

    Parameters
    ----------
    device
        The device. Its ``on_swap`` has to call `notice`.

    Attributes
    ----------
    address : str
        Where it listens, as HOST:PORT.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._bench = Bench(device)
        self._listener = socket.create_server((_HOST, 0), backlog=1)
        self.address = "{}:{}".format(*self._listener.getsockname())
        self._bell, self._ringer = socket.socketpair()
        self._ringer.setblocking(False)
        self._connection: socket.socket | None = None
        self._waiting = False  # for a swap
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="tap", daemon=True)
        self._thread.start()

    def notify_swap(self) -> None:
        """Wake a watcher that waits for a swap. Costs next to nothing if none does."""
        if self._waiting:
            self._waiting = False
            self._wake()

    def close(self) -> None:
        """Stop, and disconnect the watcher. Calling it again has no effect."""
        if self._closing.is_set():
            return
        self._closing.set()
        self._wake()
        if connection := self._connection:
            with contextlib.suppress(OSError):  # it has just disconnected
                connection.shutdown(socket.SHUT_RDWR)
        self._thread.join()
        for one in (self._listener, self._bell, self._ringer):
            one.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _wake(self) -> None:
        with contextlib.suppress(BlockingIOError):  # full: the thread wakes up anyway
            self._ringer.send(b"\0")

    # The rest runs in the thread.

    def _run(self) -> None:
        while self._readable(self._listener):
            connection = accept(self._listener, self._bell)
            if connection is None:
                continue
            self._connection = connection
            with connection, contextlib.suppress(OSError):
                connection.setblocking(True)
                self._serve(connection)
            self._connection = None

    def _serve(self, watcher: socket.socket) -> None:
        """Respond to a watcher until it disconnects.

        The socket blocks, so that the system takes a page in few calls and the interpreter lock is
        released as often. With many small calls it would change hands each time, and stall either
        the device or this thread.
        """
        while self._readable(watcher):
            request = watcher.recv(_REQUEST.size, socket.MSG_WAITALL)
            if len(request) < _REQUEST.size or not self._await_new_picture(watcher, request):
                return
            began = time.thread_time()
            header, shown = self._capture()
            spent = time.thread_time() - began
            watcher.sendall(header)
            for piece in _large_pieces(shown.stored.dense_pieces()):
                watcher.sendall(piece)
            watcher.sendall(shown.palette)
            self._closing.wait(_IDLE_FACTOR * spent)

    def _readable(self, one: socket.socket) -> bool:
        """Wait until a socket is readable; return False if the tap is closed instead."""
        while not self._closing.is_set():
            if one in self._wait(one):
                return True
        return False

    def _await_new_picture(self, watcher: socket.socket, request: bytes) -> bool:
        """Wait for another picture than the requested one; return False if the watcher is gone."""
        self._waiting = True  # before the comparison, so that no swap is missed
        while self._current_picture() == request:
            if self._wait(watcher) or self._closing.is_set():
                return False
            self._waiting = True
        self._waiting = False
        return True

    def _wait(self, one: socket.socket) -> list[socket.socket]:
        """Wait for a socket or the bell; return the socket if it is readable."""
        readable, _ = wait_ready([self._bell, one])
        if self._bell in readable:
            self._bell.recv(64)
            readable.remove(self._bell)
        return readable

    def _current_picture(self) -> bytes:
        """Return the request of a watcher that has the picture on display."""
        return _REQUEST.pack(self._device.boot, self._device.swaps & _U32)

    def _capture(self) -> tuple[bytes, Snapshot]:
        shown = self._bench.snapshot()
        device = self._device
        header = _HEADER.pack(
            _MAGIC,
            shown.boot,
            _NO_FRAME if shown.frame is None else shown.frame,
            *shown.grid,
            device.config.pixels.code,
            shown.swaps & _U32,
            shown.digest,
            sum(device.taken_by_type.values()) & _U32,
            sum(device.errors_by_code.values()) & _U32,
            device.damaged & _U32,
            device.errors_by_code.get(spec.CODE_OVERRUN, 0) & _U32,
        )
        return header, shown


def _large_pieces(pieces: Iterable[memoryview]) -> Iterator[bytes]:
    """Join pieces until they are large."""
    large = bytearray()
    for piece in pieces:
        large += piece
        if len(large) >= _SEND_BYTES:
            yield bytes(large)
            large.clear()
    yield bytes(large)

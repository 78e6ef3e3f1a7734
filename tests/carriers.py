"""Pairs of a transport and its peer, one for every kind of byte pipe: for the transport kit.

A carrier is a context manager that yields the driver's transport and the peer, a plain descriptor.
Another kind is another entry of `CARRIERS`.
"""

from __future__ import annotations

import contextlib
import os
import socket
import threading
import time
import tty

from serial import rfc2217
from usb_carriers import USB_CARRIERS

from firmware_sim.readiness import wait_ready
from voxdisplay.transport import open_transport
from voxdisplay.transport.plugin import PluginTransport

WAIT_S = 20  # after which a test has failed; none takes so long


class Peer:
    """The other end of a pipe, as a descriptor that does not block."""

    def __init__(self, descriptor):
        self.descriptor = descriptor
        os.set_blocking(descriptor, False)

    def read(self, count):
        """Read exactly so many bytes."""
        data = bytearray()
        while len(data) < count:
            ready, _ = wait_ready([self.descriptor], timeout_s=WAIT_S)
            assert ready, f"{len(data)} of {count} bytes came"
            piece = os.read(self.descriptor, count - len(data))
            assert piece, f"closed after {len(data)} of {count} bytes"
            data += piece
        return bytes(data)

    def write(self, data):
        view = memoryview(data)
        while view:
            _, ready = wait_ready([], [self.descriptor], WAIT_S)
            assert ready, f"{len(view)} of {len(data)} bytes were not taken"
            view = view[os.write(self.descriptor, view) :]

    def close(self):
        if self.descriptor >= 0:
            os.close(self.descriptor)
            self.descriptor = -1


class SocketPipe:
    """Pipe as an entry point of another package returns it: read, write, close, and OSErrors."""

    def __init__(self, ours):
        self._socket = ours

    def read(self, timeout_s):
        self._socket.settimeout(max(timeout_s, 1e-6))
        try:
            data = self._socket.recv(65536)
        except (TimeoutError, BlockingIOError):
            return b""
        if not data:
            raise ConnectionError("the other end was closed")
        return data

    def write(self, data, timeout_s):
        self._socket.settimeout(timeout_s)
        self._socket.sendall(data)

    def close(self):
        self._socket.close()


@contextlib.contextmanager
def pipe():
    ours, theirs = socket.socketpair()
    peer = Peer(theirs.detach())
    transport = PluginTransport("pipe:", lambda _port: SocketPipe(ours))
    try:
        yield transport, peer
    finally:
        transport.close()
        peer.close()


@contextlib.contextmanager
def pty():
    master, slave = os.openpty()
    tty.setraw(slave)
    transport = open_transport(os.ttyname(slave))
    os.close(slave)
    peer = Peer(master)
    try:
        yield transport, peer
    finally:
        transport.close()
        peer.close()


@contextlib.contextmanager
def listening(scheme):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        transport = open_transport(f"{scheme}://127.0.0.1:{listener.getsockname()[1]}")
        peer = Peer(listener.accept()[0].detach())
        try:
            yield transport, peer
        finally:
            transport.close()
            peer.close()


class Rfc2217Line:
    """Serial line behind a server of RFC 2217; records the settings."""

    bytesize, parity, stopbits = 8, "N", 1
    cts = dsr = cd = True
    ri = False
    xonxoff = rtscts = dsrdtr = break_condition = False

    def __init__(self):
        self.baudrate = 9600
        self.dtr = self.rts = None
        self.rates = []

    def __setattr__(self, name, value):
        super().__setattr__(name, value)
        if name == "baudrate" and hasattr(self, "rates"):
            self.rates.append(value)

    def reset_input_buffer(self):
        pass

    reset_output_buffer = reset_input_buffer


class _Locked:
    """Connection with a lock around `write`, as `PortManager` needs it."""

    def __init__(self, connection):
        self._connection, self._lock = connection, threading.Lock()

    def write(self, data):
        with self._lock, contextlib.suppress(OSError):
            self._connection.sendall(data)


class Rfc2217Server:
    """A server of RFC 2217 for one connection, before the line whose far end is ``inner``.

    Nothing is taken from the network that the line does not take.
    """

    def __init__(self, inner):
        self.line = Rfc2217Line()
        self._inner = inner
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = f"rfc2217://127.0.0.1:{self._listener.getsockname()[1]}"
        self._stop, self._stopper = os.pipe()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self):
        ready, _ = wait_ready([self._listener, self._stop])
        if self._stop in ready:
            return
        connection, _ = self._listener.accept()
        with connection, self._inner, contextlib.suppress(OSError):
            self._pump(connection)

    def _pump(self, connection):
        out = _Locked(connection)
        manager = rfc2217.PortManager(self.line, out)
        waiting = b""
        while True:
            wants = [self._stop, self._inner] + ([] if waiting else [connection])
            ready, room = wait_ready(wants, [self._inner] if waiting else [])
            if self._stop in ready:
                return
            if room:
                waiting = waiting[self._inner.send(waiting) :]
            if self._inner in ready:
                if not (data := self._inner.recv(65536)):
                    return
                out.write(data.replace(b"\xff", b"\xff\xff"))
            if connection in ready:
                if not (data := connection.recv(4096)):
                    return
                waiting = b"".join(manager.filter(data))

    def close(self):
        os.write(self._stopper, b"\0")
        self._thread.join(WAIT_S)
        assert not self._thread.is_alive()
        self._listener.close()
        self._inner.close()
        os.close(self._stop)
        os.close(self._stopper)


@contextlib.contextmanager
def over_rfc2217():
    inner, theirs = socket.socketpair()
    server = Rfc2217Server(inner)
    peer = Peer(theirs.detach())
    try:
        transport = open_transport(server.port)
        try:
            yield transport, peer
        finally:
            transport.close()
    finally:
        peer.close()
        server.close()


CARRIERS = {
    "pipe": pipe,
    "pty": pty,
    "tcp": lambda: listening("tcp"),
    "socket": lambda: listening("socket"),
    "rfc2217": over_rfc2217,
    **USB_CARRIERS,
}


def eventually(condition, what="it"):
    """Wait until a condition holds; fail if it never does."""
    deadline_s = time.monotonic() + WAIT_S
    while not condition():
        assert time.monotonic() < deadline_s, f"{what} never happened"
        time.sleep(0.005)

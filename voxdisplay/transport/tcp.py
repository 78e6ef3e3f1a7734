"""``tcp://host:port``, ``socket://host:port``: byte pipe over a TCP connection. Knows no packet.

Whether a server of serial lines speaks telnet there is found out from what it begins with.
"""

from __future__ import annotations

import contextlib
import os
import socket
import time
from urllib.parse import urlsplit

from voxdisplay.errors import OpenError, TransportClosed, TransportTimeout
from voxdisplay.transport.diagnosis import network_hint
from voxdisplay.transport.library_errors import LIBRARY_ERRORS, message_of
from voxdisplay.transport.telnet import TelnetDetector

_READ_BYTES = 1 << 16
_CONNECT_S = 5.0
_EXAMPLE_HINT = "write it like tcp://127.0.0.1:5000 or tcp://[::1]:5000"


class TcpTransport:
    """A pipe over TCP; small packets leave at once (TCP_NODELAY).

    Parameters
    ----------
    port : str
        ``tcp://host:port`` or ``socket://host:port``.

    Raises
    ------
    OpenError
        If it is no such URL, or nothing accepts the connection.

    """

    def __init__(self, port: str) -> None:
        self.port = port
        self._telnet = TelnetDetector()
        self._owner_pid = os.getpid()
        try:
            url = urlsplit(port)
            host, number = url.hostname, url.port
        except ValueError as error:
            raise OpenError(f"{port}: {error}", port=port, hint=_EXAMPLE_HINT) from error
        if not host or not number or url.path not in {"", "/"} or url.query or url.fragment:
            raise OpenError(f"{port} is not a TCP port", port=port, hint=_EXAMPLE_HINT)
        try:
            self._socket = socket.create_connection((host, number), timeout=_CONNECT_S)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        except OSError as error:
            raise OpenError(
                f"{port} cannot be opened: {message_of(error)}",
                port=port,
                hint=network_hint(error),
            ) from error
        except LIBRARY_ERRORS as error:  # a name that no host can have
            raise OpenError(
                f"{port} is not a TCP port: {message_of(error)}", port=port, hint=_EXAMPLE_HINT
            ) from error

    def read(self, timeout_s: float) -> bytes:
        """See `Transport.read`."""
        try:
            self._socket.settimeout(max(timeout_s, 0.0))
            data = self._socket.recv(_READ_BYTES)
        except (TimeoutError, BlockingIOError):
            return b""
        except LIBRARY_ERRORS as error:
            raise TransportClosed(f"{self.port} is gone: {message_of(error)}") from error
        if not data:
            raise TransportClosed(f"{self.port} was closed by the device")
        return self._telnet.received(data)

    def write(self, data: bytes, timeout_s: float) -> None:
        """See `Transport.write`."""
        deadline_s = time.monotonic() + timeout_s
        view = memoryview(self._telnet.escaped(data))
        size = len(view)
        while view:
            try:
                self._socket.settimeout(max(deadline_s - time.monotonic(), 1e-3))
                view = view[self._socket.send(view) :]
            except TimeoutError as error:
                raise TransportTimeout(
                    f"{self.port} took only {size - len(view)} of {size} bytes in {timeout_s:.1f} s"
                ) from error
            except LIBRARY_ERRORS as error:
                raise TransportClosed(f"{self.port} is gone: {message_of(error)}") from error

    def close(self) -> None:
        """See `Transport.close`."""
        if os.getpid() == self._owner_pid:
            with contextlib.suppress(*LIBRARY_ERRORS):  # a forked process may still have it
                self._socket.shutdown(socket.SHUT_RDWR)
        with contextlib.suppress(*LIBRARY_ERRORS):
            self._socket.close()

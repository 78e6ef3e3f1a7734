"""``rfc2217://``: pyserial's port behind a server of serial lines, read in blocks.

pyserial's own reader puts every byte into a queue by itself, at 0.2 MB/s. Its negotiation of
options and line settings is kept. Its socket is replaced by one that separates the data from
telnet's commands, so that its reader thread sees the commands alone. Requests that a display does
not need answered (DTR, RTS, flow control, PURGE) are sent and not waited for: servers in front of
a port without modem lines never answer them. Of pyserial's private parts this takes ``_socket``,
``_telnet_read_loop`` and ``_rfc2217_options``. Knows no packet.
"""

from __future__ import annotations

import contextlib
import socket
import threading
from typing import Any, Final

import serial
from serial import rfc2217

from voxdisplay.transport.library_errors import LIBRARY_ERRORS
from voxdisplay.transport.telnet import TelnetDecoder

_READ_BYTES: Final = 1 << 16
# More is not taken from the server until some of it is read, so that it waits as a tty would.
_MAX_BUFFERED_BYTES: Final = 1 << 20


class _CommandSocket:
    """A socket whose `recv` returns telnet commands only; the data are buffered for `read_data`.

    The reader thread of pyserial calls `recv`, the user of the port `read_data`.
    """

    def __init__(self, inner: socket.socket) -> None:
        self._inner = inner
        self._decoder = TelnetDecoder()
        self._data = bytearray()
        self._ended = False
        self._changed = threading.Condition()

    def recv(self, _count: int) -> bytes:
        """Return the next commands; ``b""`` at the end of the connection."""
        commands = b""
        while not commands and (data := self._inner.recv(_READ_BYTES)):
            plain, commands = self._decoder.feed(data)
            with self._changed:
                self._data += plain
                self._changed.notify_all()
                self._changed.wait_for(lambda: self._ended or len(self._data) < _MAX_BUFFERED_BYTES)
        return commands

    def read_data(self, count: int, timeout_s: float | None) -> bytes:
        """Return so many bytes of data, or fewer if no more come in time or at the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._ended or len(self._data) >= count, timeout_s)
            data = bytes(self._data[:count])
            del self._data[:count]
            self._changed.notify_all()
            if not data and self._ended:
                raise serial.SerialException("the server has closed the connection")
        return data

    def discard_data(self) -> None:
        """Drop the data that have come."""
        with self._changed:
            self._data.clear()
            self._changed.notify_all()

    @property
    def data_waiting(self) -> int:
        """Number of bytes of data that have come and were not read."""
        return len(self._data)

    def mark_ended(self) -> None:
        """Wake all readers: nothing more comes."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    # -- the rest of what pyserial asks of its socket

    def setsockopt(self, *option: int) -> None:
        self._inner.setsockopt(*option)

    def sendall(self, data: bytes) -> None:
        self._inner.sendall(data)

    def fileno(self) -> int:
        return self._inner.fileno()

    def shutdown(self, how: int) -> None:
        self.mark_ended()
        with contextlib.suppress(OSError):  # pyserial would not close it then
            self._inner.shutdown(how)

    def close(self) -> None:
        self.mark_ended()
        self._inner.close()


class Rfc2217Port(rfc2217.Serial):
    """pyserial's port, but for how data are read and which answers are waited for."""

    _command_socket: _CommandSocket | None = None
    _rfc2217_options: Any

    @property
    def _socket(self) -> Any:
        return self._command_socket

    @_socket.setter
    def _socket(self, inner: socket.socket | None) -> None:
        self._command_socket = None if inner is None else _CommandSocket(inner)

    def _telnet_read_loop(self) -> None:
        command_socket = self._command_socket
        # What it raises is that the connection is gone, or that the server speaks no telnet.
        with contextlib.suppress(*LIBRARY_ERRORS):
            super()._telnet_read_loop()  # type: ignore[misc] # not in its types
        if command_socket is not None:
            command_socket.mark_ended()

    def rfc2217_set_control(self, value: bytes) -> None:
        """Request a modem line or a kind of flow control; wait for no answer."""
        self._rfc2217_options["control"].set(value)

    def rfc2217_send_purge(self, value: bytes) -> None:
        """Request that a buffer of the server is emptied; wait for no answer."""
        self._rfc2217_options["purge"].set(value)

    @property
    def in_waiting(self) -> int:
        """See pyserial."""
        return 0 if self._command_socket is None else self._command_socket.data_waiting

    def read(self, size: int = 1) -> bytes:
        """See pyserial."""
        if self._command_socket is None:
            raise serial.PortNotOpenError
        return self._command_socket.read_data(size, self.timeout)

    def reset_input_buffer(self) -> None:
        """See pyserial."""
        super().reset_input_buffer()
        if self._command_socket is not None:
            self._command_socket.discard_data()

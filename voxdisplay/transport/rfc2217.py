"""``rfc2217://``: pyserial's port behind a server of serial lines, read in blocks.

pyserial's own reader puts every byte into a queue by itself, and gives 0.2 MB/s. What is kept of it
is all that RFC 2217 is about: options, rates and wires. Its socket is one of ours, which parts the
data from telnet's commands; the reader sees only the commands. Of pyserial's private parts this
takes ``_socket``, where it keeps its socket, and ``_telnet_read_loop``, what its thread runs.
Knows no packet.
"""

from __future__ import annotations

import socket
import threading
from typing import Any, Final

import serial
from serial import rfc2217

_READ_BYTES: Final = 1 << 16
# More is not taken from the server until some of it is read, so that it waits as a tty would.
_MAX_BUFFERED_BYTES: Final = 1 << 20

_IAC, _SB, _SE = 0xFF, 0xFA, 0xF0
_WITH_OPTION = range(0xFB, 0xFF)  # WILL, WONT, DO, DONT


class TelnetDecoder:
    """Parts what a telnet server sends into data and commands, wherever it is cut."""

    def __init__(self) -> None:
        self._escaped = False  # the last byte was IAC
        self._option = False  # the next byte is the option of a command
        self._within = False  # between IAC SB and IAC SE

    def feed(self, data: bytes) -> tuple[bytes, bytes]:
        """Give the data, unescaped, and the commands as they came."""
        plain, commands = bytearray(), bytearray()
        at = 0
        while at < len(data):
            byte = data[at]
            if self._option:
                commands.append(byte)
                self._option = False
                at += 1
            elif self._escaped:
                self._escaped = False
                at += 1
                if byte == _IAC and not self._within:
                    plain.append(byte)
                elif byte != _SE or self._within:  # an end without a beginning ends the reader
                    commands += bytes((_IAC, byte))
                    self._option = byte in _WITH_OPTION
                    self._within = (self._within or byte == _SB) and byte != _SE
            else:
                end = data.find(_IAC, at)
                self._escaped = end >= 0
                end = end if end >= 0 else len(data)
                (commands if self._within else plain).extend(data[at:end])
                at = end + 1
        return bytes(plain), bytes(commands)


class _CommandSocket:
    """A socket that keeps the data, and gives the commands to who reads it."""

    def __init__(self, inner: socket.socket) -> None:
        self._inner = inner
        self._decoder = TelnetDecoder()
        self._data = bytearray()
        self._ended = False
        self._changed = threading.Condition()

    def recv(self, _count: int) -> bytes:
        """Give the next commands; ``b""`` at the end."""
        commands = b""
        while not commands and (data := self._inner.recv(_READ_BYTES)):
            plain, commands = self._decoder.feed(data)
            with self._changed:
                self._data += plain
                self._changed.notify_all()
                self._changed.wait_for(lambda: self._ended or len(self._data) < _MAX_BUFFERED_BYTES)
        return commands

    def read_data(self, count: int, timeout_s: float | None) -> bytes:
        """Give so many bytes of data, or fewer if no more come in time or at the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._ended or len(self._data) >= count, timeout_s)
            data = bytes(self._data[:count])
            del self._data[:count]
            self._changed.notify_all()
            if not data and self._ended:
                raise serial.SerialException("the server has closed the connection")
        return data

    @property
    def data_waiting(self) -> int:
        """Count the bytes of data that have come."""
        return len(self._data)

    def mark_ended(self) -> None:
        """Wake who waits: nothing more comes."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    # -- and what else pyserial asks of its socket

    def setsockopt(self, *option: int) -> None:
        self._inner.setsockopt(*option)

    def sendall(self, data: bytes) -> None:
        self._inner.sendall(data)

    def fileno(self) -> int:
        return self._inner.fileno()

    def shutdown(self, how: int) -> None:
        self.mark_ended()
        self._inner.shutdown(how)

    def close(self) -> None:
        self.mark_ended()
        self._inner.close()


class Serial(rfc2217.Serial):
    """pyserial's port, but for how data are read."""

    _command_socket: _CommandSocket | None = None

    @property
    def _socket(self) -> Any:
        return self._command_socket

    @_socket.setter
    def _socket(self, inner: socket.socket | None) -> None:
        self._command_socket = None if inner is None else _CommandSocket(inner)

    def _telnet_read_loop(self) -> None:
        sieved = self._command_socket
        try:
            super()._telnet_read_loop()  # type: ignore[misc] # not in its types
        finally:
            if sieved is not None:
                sieved.mark_ended()

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
            self._command_socket.read_data(self._command_socket.data_waiting, 0)

"""Byte pipe over pyserial: ttys, ptys, and pyserial's URLs.

Where the system can wait on the port (POSIX, ``socket://``), reads come in large blocks and at
once, and every write has a deadline. Elsewhere (Windows, ``rfc2217://``) pyserial's own timeouts
are polled. Why a port does not open is the business of `diagnosis`. Knows no packet.
"""

from __future__ import annotations

import contextlib
import os
import time
from typing import Any

import serial

from voxdisplay.errors import TransportClosed, TransportTimeout
from voxdisplay.transport.diagnosis import as_open_error
from voxdisplay.transport.ftdi_latency import lower_latency
from voxdisplay.transport.library_errors import LIBRARY_ERRORS, message_of
from voxdisplay.transport.pyserial_ports import abandon_port, close_port, open_port
from voxdisplay.transport.readiness import Readiness

_READ_BYTES = 1 << 16
_WRITE_BYTES = 1 << 14
# Where the port cannot be waited on. Setting pyserial's timeouts reconfigures a port, so they are
# set once: reads return this often to check the deadline, and writes are small enough for a slow
# line to take within the timeout.
_POLL_S = 0.02
_POLLED_WRITE_BYTES = 2048
_POLLED_WRITE_S = 5.0
_STALLED_HINT = "is something still reading there?"


class SerialTransport:
    """A pipe over a serial port, opened exclusively.

    Parameters
    ----------
    port : str
        A device such as ``/dev/ttyUSB0`` or ``COM3``, or a URL of pyserial.
    baud : int
        Bits per second.
    reset : bool
        Raise DTR and RTS on opening, on which many boards restart; False leaves both alone.

    Attributes
    ----------
    baud : int
        Bits per second, as last set.

    Raises
    ------
    OpenError
        If it cannot be opened; the message says why, ``hint`` what to do.

    """

    def __init__(self, port: str, *, baud: int = 115200, reset: bool = True) -> None:
        self.port = port
        self.baud = baud
        self._owner_pid = os.getpid()
        try:
            # Of many kinds, with more than they share.
            self._serial: Any = open_port(port, baud=baud, timeout_s=_POLL_S, reset=reset)
        except LIBRARY_ERRORS as error:
            raise as_open_error(port, error) from error
        self._readable: Readiness | None = None  # None: the port polls, with its own timeout
        self._writable: Readiness | None = None
        self._closed = False
        try:
            self._set_up()
        except LIBRARY_ERRORS as error:  # it may be pulled out here, too
            self.close()
            raise as_open_error(port, error) from error
        except BaseException:
            self.close()
            raise

    def _set_up(self) -> None:
        """Set the timeouts and the latency of an open port: 0 where the system waits."""
        line = self._serial
        if (descriptor := _descriptor(line)) is not None:
            line.timeout = line.write_timeout = 0
            self._readable = self._writable = Readiness(descriptor)
        elif _is_rfc2217(line):
            # It writes to its socket, and knows no timeout for that.
            self._writable = Readiness(line._socket.fileno())  # noqa: SLF001
        else:
            line.write_timeout = _POLLED_WRITE_S
        if isinstance(line, serial.Serial):
            lower_latency(str(line.portstr))

    @property
    def bytes_per_s(self) -> float | None:
        """Capacity of the line with a start and a stop bit a byte; None if it has no rate."""
        return self.baud / 10 if self.has_baud_rate else None

    @property
    def has_baud_rate(self) -> bool:
        """True if there is a line with a rate behind the port; ptys and sockets have none."""
        if not isinstance(self._serial, serial.Serial):
            return _is_rfc2217(self._serial)
        try:
            _ = self._serial.cts  # a pty has no modem lines to ask
        except LIBRARY_ERRORS:
            return False
        return True

    def set_baud(self, baud: int) -> None:
        """Change the rate of the line, without closing it.

        Raises
        ------
        ValueError
            If the port has no such rate.

        """
        try:
            self._serial.baudrate = baud
        except LIBRARY_ERRORS as error:
            raise ValueError(
                f"{self.port} has no rate of {baud} Bd: {message_of(error)}"
            ) from error
        self.baud = baud

    def read(self, timeout_s: float) -> bytes:
        """See `Transport.read`."""
        self._check_open()
        try:
            if self._readable is None:
                return self._read_polled(timeout_s)
            if not self._readable.readable(timeout_s):
                return b""
            return bytes(self._serial.read(_READ_BYTES))
        except LIBRARY_ERRORS as error:
            raise self._gone(error) from error

    def _read_polled(self, timeout_s: float) -> bytes:
        deadline_s = time.monotonic() + timeout_s
        while True:
            if waiting := self._serial.in_waiting:
                return bytes(self._serial.read(min(waiting, _READ_BYTES)))
            if first := self._serial.read(1):  # waits for one byte, and does not ask for more
                waiting = self._serial.in_waiting
                return bytes(first + self._serial.read(waiting)) if waiting else bytes(first)
            if time.monotonic() >= deadline_s:
                return b""

    def write(self, data: bytes, timeout_s: float) -> None:
        """See `Transport.write`."""
        self._check_open()
        deadline_s = time.monotonic() + timeout_s
        view = memoryview(data)
        step = _POLLED_WRITE_BYTES if self._readable is None else _WRITE_BYTES
        try:
            while view:
                left_s = deadline_s - time.monotonic()
                if self._writable is not None and not self._writable.writable(left_s):
                    break
                view = view[self._serial.write(view[:step]) :]
        except serial.SerialTimeoutException as error:
            raise TransportTimeout(
                f"{self.port} takes no more bytes", hint=_STALLED_HINT
            ) from error
        except LIBRARY_ERRORS as error:
            raise self._gone(error) from error
        if view:
            raise TransportTimeout(
                f"{self.port} took only {len(data) - len(view)} of {len(data)} bytes "
                f"in {timeout_s:.1f} s",
                hint=_STALLED_HINT,
            )

    def _gone(self, error: Exception) -> TransportClosed:
        return TransportClosed(f"{self.port} is gone: {message_of(error)}")

    def _check_open(self) -> None:
        if self._closed:
            raise TransportClosed(f"{self.port} is closed")

    def close(self) -> None:
        """See `Transport.close`.

        Bytes that the port has not sent yet are dropped: whoever needs them sent has waited for
        the answer.
        """
        if self._closed:
            return
        self._closed = True
        for readiness in (self._readable, self._writable):
            if readiness is not None:
                readiness.close()
        if os.getpid() != self._owner_pid:
            abandon_port(self._serial)
            return
        self.discard_output()  # a tty would wait half a minute for a device that takes nothing
        close_port(self._serial)

    def drain(self, timeout_s: float) -> None:
        """Wait until the system has put all bytes on the line, where it tells, at most so long."""
        deadline_s = time.monotonic() + timeout_s
        with contextlib.suppress(*LIBRARY_ERRORS):
            while self._serial.out_waiting and time.monotonic() < deadline_s:
                time.sleep(_POLL_S)

    def discard_output(self) -> None:
        """Drop the bytes that the system has not put on the line yet, where it can."""
        if isinstance(self._serial, serial.Serial):
            with contextlib.suppress(*LIBRARY_ERRORS):
                self._serial.reset_output_buffer()


def _descriptor(line: Any) -> int | None:
    """Return the descriptor that the system can wait on; None if there is none."""
    try:
        return int(line.fileno())
    except LIBRARY_ERRORS:
        return None


def _is_rfc2217(line: Any) -> bool:
    return type(line).__module__ == "voxdisplay.transport.rfc2217"

"""Serial ports through pyserial: real ttys, ptys, and its URLs.

Where the system lets us wait on a port itself, we do: reads come in large blocks and at once, and
every write has a deadline. Where it does not (Windows, rfc2217://), pyserial's own timeouts are
polled. Why a port does not open is the business of `diagnosis`. Knows no packet.
"""

from __future__ import annotations

import select
import sys
import time
from typing import Any

import serial

from voxdisplay.errors import OpenError, TransportClosed, TransportTimeout
from voxdisplay.transport.diagnosis import as_open_error, message_of
from voxdisplay.transport.ftdi_latency import lower_latency

_READ_BYTES = 1 << 16
_WRITE_BYTES = 1 << 14
# Where the port cannot be waited on. Setting pyserial's timeouts reconfigures a port, so they are
# set once: reads come back this often to look at ours, and writes are small enough for a slow line
# to take within the time that is told.
_POLL_S = 0.02
_POLLED_WRITE_BYTES = 2048
_POLLED_WRITE_S = 5.0
_STALLED_HINT = "is something still reading there?"

# A device that goes away shows itself as any of these, by pyserial's layer and the system's mood.
_GONE: tuple[type[Exception], ...] = (serial.SerialException, OSError, TypeError)
if sys.platform != "win32":
    import termios

    _GONE = (*_GONE, termios.error)


class SerialTransport:
    """A pipe over a serial port, opened exclusively.

    Parameters
    ----------
    port : str
        A device such as ``/dev/ttyUSB0`` or ``COM3``, or a URL of pyserial.
    baud : int
        Bits per second.

    Attributes
    ----------
    baud : int
        Bits per second, as last set.

    """

    def __init__(self, port: str, *, baud: int = 115200) -> None:
        self.port = port
        self.baud = baud
        try:
            self._serial: Any = _open(port, baud)  # of many kinds, with more than they share
        except _GONE as error:
            raise as_open_error(port, error) from error
        except (ValueError, OverflowError) as error:  # a URL that is unknown, or an absurd rate
            raise OpenError(f"{port} cannot be opened: {error}", port=port) from error
        self._closed = False
        self._descriptor = _descriptor(self._serial)

    @property
    def bytes_per_s(self) -> float | None:
        """What the line can carry, a start and a stop bit a byte; None if it has no rate."""
        return self.baud / 10 if self.has_baud_rate else None

    @property
    def has_baud_rate(self) -> bool:
        """Whether there is a line behind the port that has a rate: ptys and sockets have none."""
        if not isinstance(self._serial, serial.Serial):
            return _is_rfc2217(self._serial)
        try:
            _ = self._serial.cts  # a pty has no such wire to ask
        except _GONE:
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
        except _GONE as error:
            raise ValueError(
                f"{self.port} has no rate of {baud} Bd: {message_of(error)}"
            ) from error
        except OverflowError as error:  # the system has no number for it
            raise ValueError(f"{self.port} has no rate of {baud} Bd") from error
        self.baud = baud

    def read(self, timeout_s: float) -> bytes:
        """See `Transport.read`."""
        self._check_open()
        try:
            if self._descriptor is None:
                return self._read_polled(timeout_s)
            readable, _, _ = select.select([self._descriptor], [], [], max(timeout_s, 0.0))
            return bytes(self._serial.read(_READ_BYTES)) if readable else b""
        except _GONE as error:
            raise TransportClosed(f"{self.port} is gone: {message_of(error)}") from error

    def _read_polled(self, timeout_s: float) -> bytes:
        deadline_s = time.monotonic() + timeout_s
        while True:
            if waiting := self._serial.in_waiting:
                return bytes(self._serial.read(min(waiting, _READ_BYTES)))
            if first := self._serial.read(1):  # waits for it, and has no sense of more
                waiting = self._serial.in_waiting
                return bytes(first + self._serial.read(waiting)) if waiting else bytes(first)
            if time.monotonic() >= deadline_s:
                return b""

    def write(self, data: bytes, timeout_s: float) -> None:
        """See `Transport.write`."""
        self._check_open()
        deadline_s = time.monotonic() + timeout_s
        view = memoryview(data)
        step = _POLLED_WRITE_BYTES if self._descriptor is None else _WRITE_BYTES
        try:
            while view:
                left_s = max(deadline_s - time.monotonic(), 0.0)
                if not self._wait_writable(left_s):
                    break
                view = view[self._serial.write(view[:step]) :]
        except serial.SerialTimeoutException as error:
            raise TransportTimeout(
                f"{self.port} takes no more bytes", hint=_STALLED_HINT
            ) from error
        except _GONE as error:
            raise TransportClosed(f"{self.port} is gone: {message_of(error)}") from error
        if view:
            raise TransportTimeout(
                f"{self.port} took only {len(data) - len(view)} of {len(data)} bytes "
                f"in {timeout_s:.1f} s",
                hint=_STALLED_HINT,
            )

    def _wait_writable(self, timeout_s: float) -> bool:
        """Wait until the port takes bytes; tell whether it does."""
        wire = self._descriptor
        if _is_rfc2217(self._serial):
            wire = self._serial._socket.fileno()  # noqa: SLF001 - it writes to it, without deadline
        if wire is None:
            return True
        return bool(select.select([], [wire], [], timeout_s)[1])

    def _check_open(self) -> None:
        if self._closed:
            raise TransportClosed(f"{self.port} is closed")

    def close(self) -> None:
        """See `Transport.close`.

        What the port has not sent yet is dropped: who wants it sent has waited for the answer.
        """
        if self._closed:
            return
        self._closed = True
        try:
            if isinstance(self._serial, serial.Serial):
                # A tty would wait half a minute for a device that takes nothing.
                self._serial.reset_output_buffer()
        except _GONE:
            pass
        _close(self._serial)


def _open(port: str, baud: int) -> serial.SerialBase:
    settings: dict[str, Any] = {"baudrate": baud, "timeout": _POLL_S}
    line: serial.SerialBase
    if port.lower().startswith("rfc2217:"):
        from voxdisplay.transport import rfc2217  # noqa: PLC0415 - only what is needed

        line = rfc2217.Serial(None, **settings)
        line.port = port
    else:
        line = serial.serial_for_url(port, do_not_open=True, **settings)
    if isinstance(line, serial.Serial):  # the system's own, perhaps behind spy://
        line.exclusive = True
    line.open()
    try:
        if _descriptor(line) is not None:
            line.timeout = line.write_timeout = 0
        elif not _is_rfc2217(line):  # which knows no such thing
            line.write_timeout = _POLLED_WRITE_S
    except BaseException:  # it may be pulled out here, too
        _close(line)
        raise
    if isinstance(line, serial.Serial):
        lower_latency(str(line.portstr))
    return line


def _close(line: Any) -> None:
    """Close all that a port has open: pyserial forgets some of it."""
    # A socket whose other end is gone, and the file that spy:// writes.
    forgotten = [getattr(line, "_socket", None), getattr(line, "formatter", None)]
    forgotten = [getattr(each, "output", each) for each in forgotten]
    for each in (line, *forgotten):
        try:
            if each not in (None, sys.stdout, sys.stderr):
                each.close()
        except _GONE:  # it is gone: that is what was wanted
            continue


def _descriptor(line: serial.SerialBase) -> int | None:
    """Give what the system can wait on, if there is such a thing."""
    try:
        return int(line.fileno())
    except (AttributeError, OSError):
        return None


def _is_rfc2217(line: serial.SerialBase) -> bool:
    return type(line).__module__ == "voxdisplay.transport.rfc2217"

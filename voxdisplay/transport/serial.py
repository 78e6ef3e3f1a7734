"""Serial ports through pyserial: real ttys, ptys, and its URLs."""

from __future__ import annotations

import errno
import os
import stat
import sys
import time

import serial

from voxdisplay.errors import OpenError, TransportClosed, TransportTimeout
from voxdisplay.transport.discovery import serial_ports

_READ_BYTES = 1 << 16
# Small enough for a slow line to take within the time that pyserial is told once.
_WRITE_BYTES = 2048
_WRITE_TIMEOUT_S = 5.0
# pyserial's own timeout is set once, as setting it reconfigures the port: reads come back this
# often to look at ours.
_POLL_S = 0.02

# A device that goes away shows itself as any of these, by pyserial's layer and the system's mood.
_GONE: tuple[type[Exception], ...] = (serial.SerialException, OSError, TypeError)
if sys.platform != "win32":
    import termios

    _GONE = (*_GONE, termios.error)


class SerialTransport:
    """A pipe over a serial port, opened exclusively."""

    def __init__(self, port: str, *, baud: int = 115200) -> None:
        self.port = port
        try:
            self._serial = serial.serial_for_url(
                port,
                baudrate=baud,
                timeout=_POLL_S,
                write_timeout=_WRITE_TIMEOUT_S,
                exclusive=None if "://" in port else True,
            )
        except _GONE as error:
            raise _explain(port, error) from error
        except ValueError as error:  # a URL that pyserial does not know, or an impossible baud
            raise OpenError(f"{port} cannot be opened: {error}", port=port) from error

    def read(self, timeout_s: float) -> bytes:
        """See `Transport.read`."""
        deadline_s = time.monotonic() + timeout_s
        try:
            while True:
                waiting = self._serial.in_waiting
                data: bytes = self._serial.read(max(1, min(waiting, _READ_BYTES)))
                if data or time.monotonic() >= deadline_s:
                    return data
        except _GONE as error:
            raise TransportClosed(f"{self.port} is gone: {_reason(error)}") from error

    def write(self, data: bytes, timeout_s: float) -> None:
        """See `Transport.write`."""
        deadline_s = time.monotonic() + timeout_s
        view = memoryview(data)
        while view:
            try:
                sent = self._serial.write(view[:_WRITE_BYTES])
            except serial.SerialTimeoutException as error:
                raise TransportTimeout(
                    f"{self.port} takes no more bytes", hint="is something still reading there?"
                ) from error
            except _GONE as error:
                raise TransportClosed(f"{self.port} is gone: {_reason(error)}") from error
            view = view[_WRITE_BYTES if sent is None else sent :]
            if view and time.monotonic() > deadline_s:
                raise TransportTimeout(f"{self.port} takes its bytes too slowly")

    def close(self) -> None:
        """See `Transport.close`."""
        try:
            self._serial.close()
        except _GONE:  # it is gone: that is what was wanted
            return


def _reason(error: Exception) -> str:
    return str(error) or type(error).__name__


def _explain(port: str, error: Exception) -> OpenError:
    """Turn what pyserial says on opening into what a person can do."""
    number = getattr(error, "errno", None)
    text = str(error)
    if number == errno.EACCES:
        return OpenError(f"{port} may not be opened", port=port, hint=_permission_hint(port))
    if number in {errno.EBUSY, errno.EAGAIN} or "exclusively lock" in text:
        return OpenError(
            f"{port} is busy",
            port=port,
            hint=f"another program has it open (try: fuser -v {port})",
        )
    if number == errno.ENOENT or "FileNotFoundError" in text:
        found = [found.port for found in serial_ports()]
        known = "there is " + ", ".join(found) if found else "no serial port was found"
        return OpenError(
            f"{port} does not exist",
            port=port,
            hint=f"{known}; sim: is the built-in emulator",
        )
    return OpenError(f"{port} cannot be opened: {_reason(error)}", port=port)


def _permission_hint(port: str) -> str:
    try:
        status = os.stat(port)  # noqa: PTH116 - a port's name need not be a path
    except OSError:
        return "look at its permissions"
    if status.st_mode & stat.S_IRGRP and status.st_mode & stat.S_IWGRP:
        import grp  # noqa: PLC0415 - not on every system

        try:
            group = grp.getgrgid(status.st_gid).gr_name
        except KeyError:
            group = str(status.st_gid)
        return f"add yourself to its group: sudo usermod -aG {group} $USER, then log in again"
    return f"give yourself access: sudo chmod a+rw {port}"

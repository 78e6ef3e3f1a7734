"""Ports of pyserial, opened, with their reads free of ``select.select``.

pyserial waits by ``select``, which refuses descriptors above 1023. The system's own serial ports
and ``socket://`` are read here without it; their descriptor must have been found readable before.
``rfc2217://`` has a module of its own. Of pyserial's private parts this takes ``_socket`` and
``_update_dtr_state``, ``_update_rts_state``, which `open` calls. Knows no packet.
"""

from __future__ import annotations

import contextlib
import os
import sys
import weakref
from typing import Any, Final
from urllib.parse import urlsplit

import serial
from serial.urlhandler import protocol_socket

from voxdisplay.errors import OpenError
from voxdisplay.transport.library_errors import LIBRARY_ERRORS

if sys.platform != "win32":
    import fcntl
    import termios

_ENDED = "it reads as ended: the device is disconnected"


class NativePort(serial.Serial):
    """A serial port of the system whose `read` takes what is there, once."""

    def read(self, size: int = 1) -> bytes:
        """Return what can be read now, at most so many bytes."""
        if sys.platform == "win32":
            return bytes(super().read(size))
        try:
            data = os.read(self.fileno(), size)
        except BlockingIOError:
            return b""
        if not data:
            raise serial.SerialException(_ENDED)
        return data


class SocketPort(protocol_socket.Serial):
    """``socket://``: pyserial's port, but for how it is read."""

    _socket: Any

    @property
    def in_waiting(self) -> int:
        """See pyserial. It is asked only where a port cannot be waited on, as this one can."""
        return 0

    def read(self, size: int = 1) -> bytes:
        """Return what can be read now, at most so many bytes."""
        try:
            data = bytes(self._socket.recv(size))
        except BlockingIOError:
            return b""
        if not data:
            raise serial.SerialException("the server has closed the connection")
        return data

    def reset_input_buffer(self) -> None:
        """Keep what has come: a new connection has nothing old in it."""


def open_port(port: str, *, baud: int, timeout_s: float, reset: bool) -> Any:
    """Open a serial device or a URL of pyserial, exclusively where the system can.

    Parameters
    ----------
    port : str
    baud : int
        Bits per second.
    timeout_s : float
        Timeout of reads where the port cannot be waited on.
    reset : bool
        Raise DTR and RTS, on which many boards restart. Otherwise both are left as they are, and
        a tty of the system does not drop them when it is closed either (HUPCL).

    Returns
    -------
    object
        An open port of pyserial.

    Raises
    ------
    OpenError
        If a URL lacks host or port.
    LIBRARY_ERRORS
        If it cannot be opened otherwise.

    """
    line = _unopened(port, baud, timeout_s)
    if isinstance(line, serial.Serial):  # the system's own, perhaps behind spy://
        line.exclusive = True
    if not reset:
        _keep_modem_lines(line)
    try:
        line.open()
    except BaseException:
        close_port(line)  # the file of spy:// is open
        raise
    _OPEN_PORTS.add(line)
    if not reset and isinstance(line, serial.Serial) and sys.platform != "win32":
        with contextlib.suppress(*LIBRARY_ERRORS):
            _clear_hupcl(line.fileno())
    return line


def _unopened(port: str, baud: int, timeout_s: float) -> Any:
    settings: dict[str, Any] = {"baudrate": baud, "timeout": timeout_s}
    scheme = port.partition(":")[0].lower()
    line: Any
    if scheme == "rfc2217":
        from voxdisplay.transport import rfc2217  # noqa: PLC0415 - only what is needed

        _check_host(port)
        line = rfc2217.Rfc2217Port(None, **settings)
        line.port = port
    elif scheme == "socket":
        line = SocketPort(None, **settings)
        line.port = port
    else:
        line = serial.serial_for_url(port, do_not_open=True, **settings)
        if isinstance(line, serial.Serial):
            # Behind spy://, hwgrep:// and alt:// are classes of pyserial's own: `read` goes
            # between each and its base.
            kind = type(line)
            bases = (NativePort,) if kind is serial.Serial else (kind, NativePort)
            line.__class__ = type(kind.__name__, bases, {})
    return line


def _check_host(port: str) -> None:
    """Raise `OpenError` if a URL has no host or no port: pyserial's message would not say so."""
    try:
        url = urlsplit(port)
        if url.hostname and url.port:
            return
    except ValueError:
        pass
    raise OpenError(
        f"{port} does not name a host and a port",
        port=port,
        hint="write it like rfc2217://127.0.0.1:4000",
    )


def _keep_modem_lines(line: Any) -> None:
    """Have pyserial leave DTR and RTS alone when it opens a port."""
    if sys.platform == "win32" and isinstance(line, serial.Serial):
        line.dtr = line.rts = False  # opening sets both; low is how they are while nobody has it
        return
    line._update_dtr_state = line._update_rts_state = lambda: None  # noqa: SLF001


def _clear_hupcl(descriptor: int) -> None:
    """Have the system keep DTR and RTS when the port is closed: no edge at the next opening."""
    if sys.platform == "win32":
        return
    attributes = termios.tcgetattr(descriptor)
    attributes[2] &= ~termios.HUPCL
    termios.tcsetattr(descriptor, termios.TCSANOW, attributes)


def close_port(line: Any) -> None:
    """Close all that a port has open, and give it back whoever has inherited it by a fork.

    pyserial closes its descriptor only. Its lock belongs to the open file, which a forked process
    may still have; so it is released first.
    """
    if isinstance(line, serial.Serial) and sys.platform != "win32":
        with contextlib.suppress(*LIBRARY_ERRORS):
            fcntl.flock(line.fileno(), fcntl.LOCK_UN)
    # A socket whose other end is gone, and the file that spy:// writes.
    forgotten = [getattr(line, "_socket", None), getattr(line, "formatter", None)]
    forgotten = [getattr(each, "output", each) for each in forgotten]
    for each in (line, *forgotten):
        if each not in (None, sys.stdout, sys.stderr):
            with contextlib.suppress(*LIBRARY_ERRORS):  # it may be gone already
                each.close()


def abandon_port(line: Any) -> None:
    """Close the descriptors that a fork has inherited, without a word to the line or the server."""
    with contextlib.suppress(*LIBRARY_ERRORS):
        if isinstance(line, serial.Serial):
            line.close()
        elif inherited := getattr(line, "_socket", None):
            getattr(inherited, "_inner", inherited).close()  # without the lock of a reader's thread
            line._socket, line.is_open = None, False  # noqa: SLF001 - else its end would speak


def _abandon_open_ports() -> None:
    for line in list(_OPEN_PORTS):
        abandon_port(line)


# A forked process closes what it has inherited at once: the end of pyserial's objects, whenever it
# comes there, would end the connection of the process that opened them.
_OPEN_PORTS: Final[weakref.WeakSet[Any]] = weakref.WeakSet()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_abandon_open_ports)

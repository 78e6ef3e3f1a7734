"""Waiting for a device that is not there: unplugged in mid-use, or not plugged in yet.

Must not know what is displayed, nor what is sent again.
"""

from __future__ import annotations

import errno
import socket
import time
from collections.abc import Callable, Iterator
from typing import Final, TypeVar

from voxdisplay.display.handshake import closed_meanwhile, request_info
from voxdisplay.errors import OpenError, TransportClosed, TransportError
from voxdisplay.printable_text import printable
from voxdisplay.transport import Transport, open_transport
from voxdisplay.transport.discovery import find_port, serial_ports

_T = TypeVar("_T")
_RETRY_INTERVAL_S = 0.25
# Of a port that is not there, or has just appeared, when other programs probe it and its
# permissions are not set yet. (A host that is not on the network yet has no name: `gaierror`.)
_TRANSIENT: Final = {
    errno.ENOENT, errno.ENXIO, errno.ENODEV, errno.EIO, errno.EACCES, errno.EPERM, errno.EBUSY,
    errno.EAGAIN, errno.ECONNREFUSED, errno.ECONNRESET, errno.EHOSTUNREACH, errno.ENETUNREACH,
    errno.ETIMEDOUT,
}  # fmt: skip
# What pyserial says where it hides the cause: on Windows, and of hwgrep://.
_TRANSIENT_TEXTS: Final = ("FileNotFoundError", "no ports found matching")


def open_when_available(
    opener: Callable[[], _T], within_s: float, note: Callable[[str], None]
) -> _T:
    """Return what ``opener`` returns, called again as long as the port or device is not there.

    Parameters
    ----------
    opener : callable
        Opens a port.
    within_s : float
        How long to wait.
    note : callable
        Called with a line of text if the first attempt fails.

    Raises
    ------
    TransportError
        From the opener: that of the last attempt, or one that waiting cannot change.

    """
    deadline_s = time.monotonic() + within_s
    waiting = False
    while True:
        try:
            return opener()
        except TransportError as error:
            if not _may_pass(error):
                raise
            left_s = deadline_s - time.monotonic()
            if left_s <= 0:
                raise _not_in_time(error, within_s) from error
            if not waiting:
                note(f"{error}; waiting {within_s:g} s for it")
                waiting = True
        time.sleep(min(_RETRY_INTERVAL_S, left_s))


def _may_pass(error: TransportError) -> bool:
    """Return whether an attempt to open a port may succeed later."""
    if not isinstance(error, OpenError):
        return True  # the port is there, and the device starts or restarts
    return any(_is_transient(cause) for cause in _causes(error))


def _is_transient(cause: BaseException) -> bool:
    if isinstance(cause, FileNotFoundError | TimeoutError | socket.gaierror):
        return True
    if any(text in str(cause) for text in _TRANSIENT_TEXTS):
        return True
    # termios.error has its number as an argument only.
    numbers = (getattr(cause, "errno", None), *cause.args[:1])
    return any(isinstance(number, int) and number in _TRANSIENT for number in numbers)


def _causes(error: BaseException) -> Iterator[BaseException]:
    cause = error.__cause__
    while cause is not None:
        yield cause
        cause = cause.__cause__ or cause.__context__


def _not_in_time(error: TransportError, within_s: float) -> TransportError:
    message = f"{error}, and that did not change within {within_s:g} s"
    if isinstance(error, OpenError):
        return OpenError(message, port=error.port, hint=error.hint)
    return type(error)(message, hint=error.hint)


class Reconnector:
    """Search for one device that may be unplugged and plugged in again.

    Parameters
    ----------
    port : str
        The port that it was opened by.
    within_s : float
        How long it may be away, from its loss until it has shown or sent something again.
    baud : int
        Bits per second of a serial line.
    note : callable, optional
        Called with a line of text when the device is lost and when it is back.
    reset : bool
        See `open_transport`.

    """

    def __init__(
        self,
        port: str,
        within_s: float,
        *,
        baud: int = 115200,
        note: Callable[[str], None] = lambda _text: None,
        reset: bool = True,
    ) -> None:
        self._port = port
        self._within_s = within_s
        self._baud = baud
        self._note = note
        self._reset = reset
        self._found = find_port(port)  # known as long as the device is there
        self._lost_s: float | None = None

    def reset_deadline(self) -> None:
        """Allow the next loss the whole time again: the device works."""
        self._lost_s = None

    def wait_for_device(
        self, why: TransportError, serial: str, cancelled: Callable[[], bool] = lambda: False
    ) -> Transport:
        """Return a new pipe to the same device, when it is back.

        Parameters
        ----------
        why : TransportError
            How it was lost.
        serial : str
            The serial number of its INFO, made printable; empty if it has none.
        cancelled : callable
            Returns True when the device is not wanted any more.

        Returns
        -------
        Transport
            Behind it the device has answered HELLO.

        Raises
        ------
        TransportClosed
            If it is not back in time.
        LocalProtocolError
            If it was cancelled.

        """
        now = time.monotonic()
        if self._lost_s is None:
            self._lost_s = now
            self._note(f"{why}; waiting {self._within_s:g} s for it to come back")
        deadline_s = self._lost_s + self._within_s
        last: Exception = why
        while (left_s := deadline_s - time.monotonic()) > 0:
            for port in self._candidates():
                try:
                    transport = self._open(port, serial, left_s, cancelled)
                except TransportError as error:
                    last = error
                    continue
                away_s = time.monotonic() - self._lost_s
                self._note(f"{port} is back after {away_s:.1f} s; the picture is sent again")
                return transport
            if cancelled():
                raise closed_meanwhile()
            time.sleep(max(0.0, min(_RETRY_INTERVAL_S, deadline_s - time.monotonic())))
        also = "" if last is why else f" ({last})"
        raise TransportClosed(
            f"{why}, and it did not come back within {self._within_s:g} s{also}", hint=why.hint
        ) from why

    def _candidates(self) -> list[str]:
        """Return the ports to try: plugged in again, a tty may get another number."""
        if self._found is None or not self._found.serial_number:
            return [self._port]
        return [port.port for port in serial_ports() if port.is_same_device(self._found)]

    def _open(
        self, port: str, serial: str, timeout_s: float, cancelled: Callable[[], bool]
    ) -> Transport:
        transport = open_transport(port, baud=self._baud, reset=self._reset)
        try:
            found = printable(request_info(transport, timeout_s, cancelled).serial)
            _check_serial(port, found, serial)
        except BaseException:
            transport.close()
            raise
        return transport


def _check_serial(port: str, found: str, wanted: str) -> None:
    if wanted and found != wanted:
        raise OpenError(
            f"at {port} is another device, {found or 'without a serial number'}", port=port
        )

"""Waiting for a device that has gone away, and knowing it again when it is back.

Knows ports, and who answers behind them. What was being shown, and what is sent again, is the
display's business.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from voxdisplay.display.handshake import request_info
from voxdisplay.errors import OpenError, TransportClosed, TransportError
from voxdisplay.transport import Transport, open_transport
from voxdisplay.transport.discovery import find_port, serial_ports

_RETRY_INTERVAL_S = 0.25


class Reconnector:
    """The patience with one device that may be pulled out and plugged in again.

    Parameters
    ----------
    port : str
        The port that it was opened by.
    within_s : float
        How long it may be away. The time begins when it is lost, and ends when it shows something.
    baud : int
        Bits per second of a serial line.
    note : callable, optional
        Is told, in a line, what happens.

    """

    def __init__(
        self,
        port: str,
        within_s: float,
        *,
        baud: int = 115200,
        note: Callable[[str], None] | None = None,
    ) -> None:
        self._port = port
        self._within_s = within_s
        self._baud = baud
        self._note = note or (lambda _text: None)
        self._found = find_port(port)  # as long as it is there
        self._lost_s: float | None = None

    def reset_deadline(self) -> None:
        """Note that the device works: the next loss has the whole time again."""
        self._lost_s = None

    def wait_for_device(self, why: TransportError, serial: str) -> Transport:
        """Wait until the device is back.

        Parameters
        ----------
        why : TransportError
            How it was lost.
        serial : str
            Its own serial number, from INFO; empty if it has none.

        Returns
        -------
        Transport
            A new pipe, behind which the same device has answered HELLO.

        Raises
        ------
        TransportClosed
            If it is not back in time.

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
                    transport = self._open(port, serial, left_s)
                except TransportError as error:
                    last = error
                    continue
                away_s = time.monotonic() - self._lost_s
                self._note(f"{port} is back after {away_s:.1f} s; the picture is sent again")
                return transport
            time.sleep(max(0.0, min(_RETRY_INTERVAL_S, deadline_s - time.monotonic())))
        also = "" if last is why else f" ({last})"
        raise TransportClosed(
            f"{why}, and it did not come back within {self._within_s:g} s{also}", hint=why.hint
        ) from why

    def _candidates(self) -> list[str]:
        """Give the ports at which it may be: plugged in again, a tty may get another number."""
        if self._found is None or not self._found.serial_number:
            return [self._port]
        return [port.port for port in serial_ports() if port.is_same_device(self._found)]

    def _open(self, port: str, serial: str, timeout_s: float) -> Transport:
        transport = open_transport(port, baud=self._baud)
        try:
            self._check_same(port, request_info(transport, timeout_s).serial, serial)
        except BaseException:
            transport.close()
            raise
        return transport

    @staticmethod
    def _check_same(port: str, found: str, wanted: str) -> None:
        if wanted and found != wanted:
            raise OpenError(
                f"at {port} is another device, {found or 'without a number'}", port=port
            )

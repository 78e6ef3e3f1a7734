"""Detection of a serial line's baud rate.

A device listens, and answers, at one rate only and does not announce it (protocol.md, section 16).
So HELLO is sent at one common rate after the other, the fastest first; what arrives at a wrong rate
is a damaged segment, which changes nothing. Must not know frames.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from voxdisplay.display.handshake import request_info
from voxdisplay.errors import TransportTimeout
from voxdisplay.transport import Transport, open_transport

if TYPE_CHECKING:
    from voxdisplay.transport.serial import SerialTransport

Baud: TypeAlias = int | Literal["auto"]
DEFAULT_BAUD: Final = 115_200
RATES: Final = (
    12_000_000, 8_000_000, 6_000_000, 4_000_000, 3_000_000, 2_000_000, 1_500_000, 1_000_000,
    921_600, 500_000, 460_800, 230_400, 115_200, 57_600, 38_400, 19_200, 9_600,
)  # fmt: skip
_RATE_TIMEOUT_S = 0.35  # long enough for two HELLOs, should noise damage the first one's answer
ALL_RATES_S: Final = len(RATES) * _RATE_TIMEOUT_S


def open_at_rate(
    port: str,
    baud: Baud,
    timeout_s: float,
    note: Callable[[str], None] = lambda _text: None,
    *,
    reset: bool = True,
) -> Transport:
    """Open a port at a rate, or at the best one: see `open_at_best_rate`."""
    if baud == "auto":
        return open_at_best_rate(port, timeout_s, note, reset=reset)
    return open_transport(port, baud=baud, reset=reset)


def open_at_best_rate(
    port: str, timeout_s: float, note: Callable[[str], None], *, reset: bool = True
) -> Transport:
    """Open a port at the fastest common rate at which the device behind it answers.

    The port is opened once, because boards may restart when it is. A device that is still starting
    is asked again at all rates until ``timeout_s`` has passed; every rate is tried at least once. A
    port without a rate (a pty, TCP, USB) is opened as it is.

    Parameters
    ----------
    port : str
        A serial device or a URL of pyserial; any other port is opened as it is.
    timeout_s : float
        How long the device may take to answer, besides the time to try all rates.
    note : callable
        Called with a line of text that names the rate.
    reset : bool
        See `open_transport`.

    Raises
    ------
    OpenError
        If it cannot be opened.
    TransportTimeout
        If nothing answers at any rate.
    TransportClosed
        If it goes away meanwhile.

    """
    transport = open_transport(port, baud=DEFAULT_BAUD, reset=reset)
    from voxdisplay.transport.serial import SerialTransport  # noqa: PLC0415 - loads pyserial

    if not isinstance(transport, SerialTransport) or not transport.has_baud_rate:
        note(f"{port} has no baud rate")
        return transport
    try:
        _find_rate(transport, timeout_s)
    except BaseException:
        transport.close()
        raise
    note(f"{port} answers at {transport.baud} Bd")
    return transport


def _find_rate(transport: SerialTransport, timeout_s: float) -> None:
    end_s = time.monotonic() + timeout_s
    refused: set[int] = set()
    while True:
        for rate in RATES:
            if rate not in refused and _answers_at(transport, rate, refused):
                return
        if time.monotonic() >= end_s:
            tried = [rate for rate in RATES if rate not in refused]
            rates = f"{tried[-1]} to {tried[0]} Bd" if tried else "any rate: the port refuses all"
            raise TransportTimeout(
                f"{transport.port}: nothing answered HELLO at {rates}",
                hint="is the display switched on, and is this its port? Another rate: --baud RATE",
            )


def _answers_at(transport: SerialTransport, rate: int, refused: set[int]) -> bool:
    try:
        transport.set_baud(rate)
    except ValueError:
        refused.add(rate)
        return False
    try:
        request_info(transport, _RATE_TIMEOUT_S)
    except TransportTimeout:
        return False
    return True

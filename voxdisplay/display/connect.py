"""Opening a display by the name of its port: at which rate, and who waits if it goes away.

Knows no frames, and leaves the pipe's kind to `voxdisplay.transport`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Literal, TextIO

from voxdisplay.display.baud import DEFAULT_BAUD, open_at_rate
from voxdisplay.display.connection import Clock
from voxdisplay.display.display import TIMEOUT_S, Display
from voxdisplay.display.reconnect import Reconnector
from voxdisplay.transport import Transport


def open(  # noqa: A001 - as the built-in: vd.open(port)
    port: str | Transport,
    *,
    baud: int | Literal["auto"] = DEFAULT_BAUD,
    timeout_s: float = TIMEOUT_S,
    reconnect_s: float = 0.0,
    note: Callable[[str], None] | None = None,
    capture: TextIO | None = None,
    clock: Clock = time.monotonic,
) -> Display:
    """Open a display: the port, and a session with the device behind it.

    Parameters
    ----------
    port : str or Transport
        ``sim:``, ``/dev/ttyUSB0``, ``COM3``, ``tcp://host:port``, a URL of pyserial, or an open
        pipe, which is closed with the display.
    baud : int or "auto"
        Bits per second of a serial line; ``"auto"`` for the fastest common one at which the device
        answers: see `voxdisplay.display.baud`.
    timeout_s : float
        How long the device may be silent.
    reconnect_s : float
        How long a device that is pulled out is waited for. When the same device is back, it gets
        its picture again, whole, and all goes on. 0: it is not waited for.
    note : callable, optional
        Is told, in a line, when a device is lost and when it is back, and what rate was found.
    capture : text file, optional
        Gets all bytes to and from the device, with times: see `voxdisplay.transport.capture`.
    clock : callable
        Gives seconds, on any steady clock.

    Raises
    ------
    OpenError
        If the port cannot be opened.
    TransportTimeout
        If nothing behind it answers HELLO.
    IncompatibleDevice
        If it speaks another protocol major, or has a pixel format we do not know.

    """
    note = note or (lambda _text: None)
    transport = open_at_rate(port, baud, timeout_s, note) if isinstance(port, str) else port
    try:
        reconnect = None
        if reconnect_s:
            rate = getattr(transport, "baud", DEFAULT_BAUD)
            reconnect = Reconnector(transport.port, reconnect_s, baud=rate, note=note)
        return Display(
            transport, timeout_s=timeout_s, reconnect=reconnect, capture=capture, clock=clock
        )
    except BaseException:
        transport.close()
        raise

"""Byte pipes, and their selection by the name of a port. Knows no packet.

A port is ``kind:rest``: ``sim:``, ``tcp://127.0.0.1:5000``; anything else is pyserial's. Further
kinds come as entry points of the group ``voxdisplay.transport``: callables that take the whole name
and return an object with ``read``, ``write`` and ``close`` as of `Transport`. They raise
`ValueError` for a name that is wrong and `OSError` for a pipe that fails, and need nothing of this
package. Those of the group ``voxdisplay.usb`` return a backend of pyusb: see `transport.usb`.
"""

from __future__ import annotations

import re
from importlib.metadata import entry_points

from voxdisplay.errors import OpenError
from voxdisplay.transport.base import Transport

__all__ = ["Transport", "open_transport"]

_GROUP = "voxdisplay.transport"
_USB_GROUP = "voxdisplay.usb"
_SINK_GROUP = "voxdisplay.sink"  # known here for an error alone


def open_transport(port: str, *, baud: int = 115200, reset: bool = True) -> Transport:
    """Open a port.

    Parameters
    ----------
    port : str
        ``sim:``, ``tcp://host:port``, ``usb:``, ``usb:VID:PID[:SERIAL]``, a serial device such as
        ``/dev/ttyUSB0`` or ``COM3``, or any URL of pyserial.
    baud : int
        Bits per second of a serial line.
    reset : bool
        Raise DTR and RTS of a serial line, on which many boards restart; False leaves both alone,
        as far as the system does: Linux raises them when a port is opened for the first time.

    Raises
    ------
    OpenError
        If it cannot be opened; the message says why, ``hint`` what to do.

    """
    match = re.match(r"([a-z][a-z0-9+-]+):", port, re.IGNORECASE)
    kind = match[1].lower() if match else ""
    if kind == "tcp" or (kind == "socket" and "?" not in port):  # pyserial's has options
        from voxdisplay.transport.tcp import TcpTransport  # noqa: PLC0415 - only what is needed

        return TcpTransport(port)
    if kind == "usb":
        from voxdisplay.transport.usb import UsbTransport  # noqa: PLC0415

        return UsbTransport(port)
    for entry in entry_points(group=_GROUP, name=kind):
        from voxdisplay.transport.plugin import PluginTransport, opener_of  # noqa: PLC0415

        return PluginTransport(port, opener_of(entry))
    for entry in entry_points(group=_USB_GROUP, name=kind):
        from voxdisplay.transport.plugin import open_usb, opener_of  # noqa: PLC0415

        return open_usb(port, opener_of(entry))
    if kind and entry_points(group=_SINK_GROUP, name=kind):
        raise OpenError(
            f"{port} is an LED cube, on which nothing answers: there is no line to measure",
            port=port,
            hint="push, play, clear and test-pattern send to it",
        )
    if not port.strip():
        raise OpenError("no port was named", port=port, hint="try sim: for the built-in emulator")
    from voxdisplay.transport.serial import SerialTransport  # noqa: PLC0415

    return SerialTransport(port, baud=baud, reset=reset)

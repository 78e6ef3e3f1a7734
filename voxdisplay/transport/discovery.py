"""Enumeration of ports. Each kind of port has a finder; none of them opens anything.

A port that cannot be looked at, because it comes or goes at this moment, is listed by its name
alone or not at all: listing never fails.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields
from importlib import import_module
from pathlib import Path
from typing import Any, Final

from voxdisplay.printable_text import printable
from voxdisplay.transport.library_errors import LIBRARY_ERRORS

# Finders: a module and a function in it, without parameters, that returns `FoundPort`s. Called
# only when ports are listed, and left out where what they need is not installed.
_FINDERS: Final = (
    ("voxdisplay.transport.discovery", "serial_ports"),
    ("voxdisplay.transport.usb", "usb_ports"),
)
# A list that fails while a device comes or goes is right a moment later.
_ATTEMPTS: Final = 3
# USB serial devices of Linux and macOS, for when pyserial cannot list them.
_DEVICES: Final = ("ttyUSB*", "ttyACM*", "cu.usb*")
_DEV: Final = Path("/dev")


@dataclass(frozen=True, slots=True)
class FoundPort:
    """A port that can be named to ``--port``. Its texts are printable, whatever a device says.

    Attributes
    ----------
    port : str
    description : str
    vid, pid : int or None
        USB vendor and product, where the system knows them.
    serial_number : str or None
    product : str or None
        Name of the USB device by its own descriptor.

    """

    port: str
    description: str
    vid: int | None = None
    pid: int | None = None
    serial_number: str | None = None
    product: str | None = None

    def __post_init__(self) -> None:
        for field in fields(self):
            if isinstance(value := getattr(self, field.name), str):
                object.__setattr__(self, field.name, printable(value))

    @property
    def kind(self) -> str:
        """Kind of port: ``"emulator"``, ``"usb"`` or ``"serial"``."""
        return {"sim": "emulator", "usb": "usb"}.get(self.port.partition(":")[0], "serial")

    def is_same_device(self, other: FoundPort) -> bool:
        """Return whether both are one USB device, wherever it is plugged in.

        Only a serial number tells two devices of a kind apart.
        """
        mine = (self.vid, self.pid, self.serial_number)
        return all(mine) and mine == (other.vid, other.pid, other.serial_number)


def serial_ports() -> list[FoundPort]:
    """Return the serial ports that the system knows, sorted by name."""
    for _ in range(_ATTEMPTS):
        try:
            from serial.tools import list_ports  # noqa: PLC0415 - looks through the system

            found = [_found_port(port) for port in list_ports.comports()]
            break
        except LIBRARY_ERRORS:
            continue
    else:
        found = _devices_by_name()
    return sorted(found, key=lambda port: port.port)


def _found_port(port: Any) -> FoundPort:
    """Return a port of pyserial's list, without what is not of the right type."""

    def text(value: object) -> str | None:
        return value if isinstance(value, str) and value else None

    def number(value: object) -> int | None:
        return value if isinstance(value, int) else None

    return FoundPort(
        str(port.device),
        text(port.description) or "",
        number(port.vid),
        number(port.pid),
        text(port.serial_number),
        text(port.product),
    )


def _devices_by_name() -> list[FoundPort]:
    """Return the USB serial devices by the names that the system has for them."""
    if sys.platform == "win32":
        return []
    try:
        paths = [path for pattern in _DEVICES for path in _DEV.glob(pattern)]
    except OSError:
        return []
    return [FoundPort(str(path), "no details: the system's list is incomplete") for path in paths]


def all_ports() -> list[FoundPort]:
    """Return everything that can be opened without further knowledge."""
    return [FoundPort("sim:", "the built-in emulator"), *_discovered()]


def _discovered() -> Iterator[FoundPort]:
    for module, name in _FINDERS:
        try:
            finder = getattr(import_module(module), name)
            ports: Iterable[FoundPort] = finder()
        except LIBRARY_ERRORS:  # not installed, or damaged
            continue
        yield from ports


def find_port(port: str) -> FoundPort | None:
    """Return the listed serial port of a name, or of a link to it; None if there is none."""
    try:
        real = str(Path(port).resolve())
    except (OSError, ValueError, RuntimeError):  # RuntimeError: a loop of links
        return None
    return next((found for found in serial_ports() if found.port in {port, real}), None)

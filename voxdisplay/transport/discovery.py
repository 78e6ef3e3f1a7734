"""Which ports there are. Each kind of port has a finder; none of them opens anything."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Final

# Finders: a module and a function in it, without parameters, that gives `FoundPort`s. Looked up
# only when ports are listed, and left out where what they need is not installed.
_FINDERS: Final = (
    ("voxdisplay.transport.discovery", "serial_ports"),
    ("voxdisplay.transport.usb", "usb_ports"),
)


@dataclass(frozen=True, slots=True)
class FoundPort:
    """A port that can be named to ``--port``.

    Attributes
    ----------
    port : str
    description : str
    vid, pid : int or None
        USB vendor and product, where the system knows them.
    serial_number : str or None
    product : str or None
        What the USB device calls itself.

    """

    port: str
    description: str
    vid: int | None = None
    pid: int | None = None
    serial_number: str | None = None
    product: str | None = None

    @property
    def kind(self) -> str:
        """What it is: ``"emulator"``, ``"usb"`` or ``"serial"``."""
        return {"sim": "emulator", "usb": "usb"}.get(self.port.partition(":")[0], "serial")

    def is_same_device(self, other: FoundPort) -> bool:
        """Tell whether both are one USB device, wherever it is plugged in.

        Only a serial number tells two devices of a kind apart.
        """
        mine = (self.vid, self.pid, self.serial_number)
        return all(mine) and mine == (other.vid, other.pid, other.serial_number)


def serial_ports() -> list[FoundPort]:
    """List the serial ports that the system knows, by name."""
    from serial.tools.list_ports import comports  # noqa: PLC0415 - looks through the system

    return sorted(
        (
            FoundPort(
                found.device,
                found.description,
                found.vid,
                found.pid,
                found.serial_number or None,
                found.product,
            )
            for found in comports()
        ),
        key=lambda found: found.port,
    )


def all_ports() -> list[FoundPort]:
    """List everything that can be opened without further knowledge."""
    return [FoundPort("sim:", "the built-in emulator"), *_discovered()]


def _discovered() -> Iterator[FoundPort]:
    for module, name in _FINDERS:
        try:
            finder = getattr(import_module(module), name)
        except ImportError:
            continue
        ports: Iterable[FoundPort] = finder()
        yield from ports


def find_port(port: str) -> FoundPort | None:
    """Find the serial port of a name, or of a link to it, among those that the system knows."""
    try:
        real = str(Path(port).resolve())
    except (OSError, ValueError):
        return None
    return next((found for found in serial_ports() if found.port in {port, real}), None)

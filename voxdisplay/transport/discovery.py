"""Which ports there are."""

from __future__ import annotations

from dataclasses import dataclass


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

    """

    port: str
    description: str
    vid: int | None = None
    pid: int | None = None
    serial_number: str | None = None


def serial_ports() -> list[FoundPort]:
    """List the serial ports that the system knows, by name."""
    from serial.tools.list_ports import comports  # noqa: PLC0415 - looks through the system

    return sorted(
        (
            FoundPort(found.device, found.description, found.vid, found.pid, found.serial_number)
            for found in comports()
        ),
        key=lambda found: found.port,
    )


def all_ports() -> list[FoundPort]:
    """List everything that can be opened without further knowledge."""
    return [FoundPort("sim:", "the built-in emulator"), *serial_ports()]

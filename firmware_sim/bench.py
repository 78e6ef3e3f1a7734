"""Bench: test controls of the device, past the wire.

For tests and viewers; nothing here is part of the protocol.
"""

from dataclasses import dataclass

from firmware_sim import spec
from firmware_sim.device import Device
from firmware_sim.sparse_pixels import SparsePixels

_TYPES = {
    value: name.removeprefix("TYPE_")
    for name, value in vars(spec).items()
    if name.startswith("TYPE_")
}
_CODES = {
    value: name.removeprefix("CODE_")
    for name, value in vars(spec).items()
    if name.startswith("CODE_")
}


@dataclass(frozen=True)
class Snapshot:
    """The front page at one moment.

    Parameters
    ----------
    stored
        All pixels in scan order; MONO1 has a byte per voxel.
    grid
        (nx, ny, nz).
    pixel_format
        ``"mono1"``, ``"index8"``, ``"rgb565"`` or ``"rgb888"``.
    frame
        Frame id, or None if no frame of the open session is on display.
    digest
        Digest of the page, section 8.
    boot, swaps
        Boot id of the device, and number of swaps since it started.
    palette
        256 colours of red, green and blue, a byte each; empty if the format is not INDEX8.
    """

    stored: SparsePixels
    grid: tuple[int, int, int]
    pixel_format: str
    frame: int | None
    digest: int
    boot: int
    swaps: int
    palette: bytes = b""

    @property
    def pixels(self) -> bytes:
        """All pixels in scan order in one piece: of a large volume that is much memory."""
        return bytes(self.stored)


@dataclass(frozen=True)
class Counters:
    """Numbers of events since the start of the device.

    Parameters
    ----------
    packets
        Packets taken, by type: its name, or its number if it has none.
    refused
        ERRORs sent, by the name of their code.
    damaged
        Damaged segments.
    swaps
        Swaps.
    overruns
        Overruns of the receive ring.
    """

    packets: dict[str, int]
    refused: dict[str, int]
    damaged: int
    swaps: int
    overruns: int


class Bench:
    """Access to a device past the wire: its front page, counters and power switch.

    Parameters
    ----------
    device
        The device.
    """

    def __init__(self, device: Device) -> None:
        self._device = device

    def snapshot(self) -> Snapshot:
        """Return the front page. May be called from any thread."""
        device = self._device
        has_palette = device.config.pixels.code == spec.FORMAT_INDEX8
        with device.page_lock:
            front, session = device.memory.front, device.session
            return Snapshot(
                front.stored.copy(),
                device.config.grid,
                device.config.pixel_format,
                session.shown if session else None,
                front.digest,
                device.boot,
                device.swaps,
                bytes(front.palette) if has_palette else b"",
            )

    def counters(self) -> Counters:
        """Return the numbers of events since the start of the device."""
        device = self._device
        return Counters(
            {_TYPES.get(kind, str(kind)): n for kind, n in sorted(device.taken_by_type.items())},
            {_CODES[code]: n for code, n in sorted(device.errors_by_code.items())},
            device.damaged,
            device.swaps,
            device.errors_by_code.get(spec.CODE_OVERRUN, 0),
        )

    def power_cycle(self) -> None:
        """Restart the device: another boot id, no session, dark pages."""
        self._device.power_cycle()

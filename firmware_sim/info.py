"""What INFO says of the device, and what a device says that lies (5).

A lie is for who tests a host: INFO announces what the device does not do. It knows nothing of
sessions and of bytes on the wire.
"""

import struct
from dataclasses import dataclass, replace

from firmware_sim import spec
from firmware_sim.config import Config
from firmware_sim.memory import Memory

_INFO = struct.Struct("<BHHBBHHHBBHIII")
_U32 = 0xFFFFFFFF


@dataclass(frozen=True)
class Announcement:
    """What a device says of itself.

    Parameters
    ----------
    boot
        Boot id.
    pixel_format
        One of ``spec.FORMAT_*``.
    grid
        Voxels along x, y and z.
    max_payload, credit
        In bytes.
    refresh
        Ticks per 1000 seconds.
    features
        A bit for each ``spec.FEATURE_*``.
    strings
        Name, firmware and serial as INFO ends with them.
    """

    boot: int
    pixel_format: int
    grid: tuple[int, int, int]
    max_payload: int
    credit: int
    refresh: int
    features: int
    strings: bytes

    def payload(self, session: int) -> bytes:
        """Return the payload of the INFO that answers a HELLO."""
        info = _INFO.pack(
            spec.VERSION_MAJOR,
            session,
            self.boot,
            spec.VERSION_MINOR,
            self.pixel_format,
            *self.grid,
            Memory.PAGES,
            0,
            self.max_payload,
            self.credit,
            self.refresh,
            self.features,
        )
        return info + self.strings


def make_announcement(config: Config, boot: int) -> Announcement:
    """Return what a device says of itself, lies included.

    Parameters
    ----------
    config
        The device.
    boot
        Its boot id.
    """
    said = Announcement(
        boot,
        config.pixels.code,
        config.grid,
        config.max_payload,
        config.rx_buffer,
        config.refresh,
        config.feature_bits,
        config.strings,
    )
    if "grid" in config.lies:  # each side one voxel longer, or shorter if it is the longest
        nx, ny, nz = (side + 1 if side < spec.LIMIT_MAX_SIDE else side - 1 for side in config.grid)
        said = replace(said, grid=(nx, ny, nz))
    if "credit" in config.lies:
        said = replace(said, credit=min(2 * said.credit, _U32))
    if "format" in config.lies:  # the one that follows in section 2.1
        said = replace(said, pixel_format=said.pixel_format % spec.FORMAT_RGB888 + 1)
    if "payload" in config.lies:
        said = replace(said, max_payload=min(2 * said.max_payload, spec.LIMIT_MAX_PAYLOAD))
    if "boot" in config.lies:
        said = replace(said, boot=boot ^ 0xFFFF)
    return said

"""Contents of INFO (5), including deliberate lies.

A lie is for tests of a host: INFO announces what the device does not do. Knows nothing of sessions
or of bytes on the wire.
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
    """Contents of an INFO.

    Parameters
    ----------
    boot
        Boot id.
    pixel_format
        One of ``spec.FORMAT_*``.
    grid
        Number of voxels along x, y and z.
    max_payload, credit
        In bytes.
    refresh
        Ticks per 1000 seconds.
    minor
        Version: section 15.
    features
        A bit for each ``spec.FEATURE_*``.
    strings
        Name, firmware and serial in the form in which they end INFO.
    """

    boot: int
    pixel_format: int
    grid: tuple[int, int, int]
    max_payload: int
    credit: int
    refresh: int
    minor: int
    features: int
    strings: bytes

    def payload(self, session: int) -> bytes:
        """Return the payload of the INFO in response to the HELLO of a session."""
        info = _INFO.pack(
            spec.VERSION_MAJOR,
            session,
            self.boot,
            self.minor,
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
    """Return what a device announces, lies included.

    Parameters
    ----------
    config
        The device.
    boot
        Its boot id.
    """
    announcement = Announcement(
        boot,
        config.pixels.code,
        config.grid,
        config.max_payload,
        config.rx_buffer,
        config.refresh,
        config.minor,
        config.feature_bits,
        config.strings,
    )
    if "grid" in config.lies:  # each side one voxel longer, or shorter if it is the longest
        nx, ny, nz = (side + 1 if side < spec.LIMIT_MAX_SIDE else side - 1 for side in config.grid)
        announcement = replace(announcement, grid=(nx, ny, nz))
    if "credit" in config.lies:
        announcement = replace(announcement, credit=min(2 * config.rx_buffer, _U32))
    if "format" in config.lies:  # the next one of section 2.1
        code = config.pixels.code % spec.FORMAT_RGB888 + 1
        announcement = replace(announcement, pixel_format=code)
    if "payload" in config.lies:
        doubled = min(2 * config.max_payload, spec.LIMIT_MAX_PAYLOAD)
        announcement = replace(announcement, max_payload=doubled)
    if "boot" in config.lies:
        announcement = replace(announcement, boot=boot ^ 0xFFFF)
    return announcement

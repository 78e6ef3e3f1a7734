"""The device as it announces itself in INFO, with the quantities derived from it.

Checks nothing. Invalid strings are truncated, not refused: the check 5/info-strings looks at them.
"""

from __future__ import annotations

from dataclasses import dataclass

from voxdisplay.conformance import packets
from voxdisplay.wire import spec

Voxel = tuple[int, int, int]  # x, y, z

FEATURES = {
    name.removeprefix("FEATURE_"): bit
    for name, bit in vars(spec).items()
    if name.startswith("FEATURE_")
}
FORMATS = {
    value: name.removeprefix("FORMAT_")
    for name, value in vars(spec).items()
    if name.startswith("FORMAT_")
}


@dataclass(frozen=True, slots=True)
class AnnouncedDevice:
    """Fields of an INFO, under the names of protocol.md, section 5."""

    format: int
    nx: int
    ny: int
    nz: int
    pages: int = 2
    max_payload: int = 1024
    rx_buffer: int = 16384
    refresh: int = 0
    features: int = 0
    boot: int = 0
    name: str = ""
    firmware: str = ""
    serial: str = ""

    @classmethod
    def from_info(cls, info: packets.Response) -> AnnouncedDevice:
        """Parse an INFO."""
        texts, at = [], 0
        for _ in range(3):
            size = info.tail[at] if at < len(info.tail) else 0
            texts.append(info.tail[at + 1 : at + 1 + size].decode(errors="replace"))
            at += 1 + size
        names = ("format", "nx", "ny", "nz", "pages", "max_payload", "rx_buffer", "refresh")
        values = {name: getattr(info, name) for name in (*names, "features", "boot")}
        return cls(**values, name=texts[0], firmware=texts[1], serial=texts[2])

    def has(self, feature: str) -> bool:
        """Return whether a feature is announced, by its name in section 5."""
        if feature == "RAMP":  # an op of two features together
            return self.has("FADE") and self.has("PALETTE")
        if feature == "VALUES" and self.format == spec.FORMAT_MONO1:  # has none, whatever it says
            return False
        return bool(self.features >> FEATURES[feature] & 1)

    @property
    def grid(self) -> tuple[int, int, int]:
        """Voxels along x, y and z."""
        return self.nx, self.ny, self.nz

    def contains(self, x: int, y: int, z: int) -> bool:
        """Return whether a voxel is on the grid."""
        return all(0 <= at < side for at, side in zip((x, y, z), self.grid, strict=True))

    @property
    def voxel_count(self) -> int:
        """Number of voxels, V of section 2."""
        return self.nx * self.ny * self.nz

    @property
    def pixel_bytes(self) -> int:
        """Number of bytes of a pixel."""
        return spec.PIXEL_BYTES[self.format]

    @property
    def full_pixel(self) -> int:
        """Pixel value of the full pixel, section 2.1."""
        return 1 if self.format == spec.FORMAT_MONO1 else (1 << 8 * self.pixel_bytes) - 1

    @property
    def coordinate_bytes(self) -> int:
        """Number of bytes of a coordinate in an op."""
        return 2 if max(self.grid) > 256 else 1

    @property
    def period_s(self) -> float:
        """Seconds between two refresh ticks; 0 if a swap happens at once."""
        return 1000 / self.refresh if self.refresh else 0.0

    @property
    def longest_packet_bytes(self) -> int:
        """Most bytes that the longest packet can have on the wire."""
        return packets.max_encoded_bytes(self.max_payload)

    @property
    def is_readable(self) -> bool:
        """True if READ or DIGEST is announced: what is on display can be verified."""
        return self.has("READ") or self.has("DIGEST")

    def index(self, x: int, y: int, z: int) -> int:
        """Return the index of a voxel in scan order."""
        return x + self.nx * (y + self.ny * z)

    def voxel_at(self, index: int) -> tuple[int, int, int]:
        """Return the coordinates of the voxel with an index."""
        return index % self.nx, index // self.nx % self.ny, index // self.nx // self.ny

    def __str__(self) -> str:
        features = " ".join(name for name in FEATURES if self.has(name)) or "no features"
        refresh = f"{self.refresh / 1000:g} Hz" if self.refresh else "swaps at once"
        return (
            f"{self.name or 'a display'} {self.firmware}".strip()
            + f", {self.nx}x{self.ny}x{self.nz} {FORMATS.get(self.format, self.format)}, {refresh},"
            f" payloads up to {self.max_payload} bytes, credit {self.rx_buffer}; {features}"
        )

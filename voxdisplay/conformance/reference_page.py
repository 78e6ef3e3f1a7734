"""Reference page: pixels, palette and digest (sections 2.1 and 8 of protocol.md)."""

from __future__ import annotations

from dataclasses import dataclass, field

from voxdisplay.conformance.announced_device import AnnouncedDevice
from voxdisplay.wire import spec

_U32 = 0xFFFFFFFF


def _brightness(level: int, top: int) -> int:
    return (2 * 255 * level + top) // (2 * top)  # floor(255 * level / top + 1/2)


def rgb(red: int, green: int, blue: int) -> int:
    """Return a colour as one number, as section 8 does."""
    return red + 256 * green + 65536 * blue


DEFAULT_PALETTE = tuple(
    rgb(_brightness(i >> 5, 7), _brightness(i >> 2 & 7, 7), _brightness(i & 3, 3))
    for i in range(256)
)


def mix(index: int, value: int) -> int:
    """Return the term of one voxel in the digest."""
    h = (index * spec.DIGEST_MUL_INDEX + value * spec.DIGEST_MUL_VALUE) & _U32
    h ^= h >> spec.DIGEST_SHIFT_1
    h = h * spec.DIGEST_MUL_1 & _U32
    h ^= h >> spec.DIGEST_SHIFT_2
    h = h * spec.DIGEST_MUL_2 & _U32
    return h ^ h >> spec.DIGEST_SHIFT_3


@dataclass(slots=True)
class Page:
    """A page: the values of its lit pixels by index, and its palette."""

    pixels: dict[int, int] = field(default_factory=dict)
    palette: list[int] = field(default_factory=lambda: list(DEFAULT_PALETTE))

    def copy(self) -> Page:
        """Return an independent copy."""
        return Page(dict(self.pixels), list(self.palette))

    def write(self, index: int, value: int) -> None:
        """Write one pixel."""
        if value:
            self.pixels[index] = value
        else:
            self.pixels.pop(index, None)

    def digest(self, device: AnnouncedDevice) -> int:
        """Return the digest of section 8."""
        total = sum(mix(index, value) for index, value in self.pixels.items())
        if device.has("PALETTE"):
            for i, (color, default) in enumerate(zip(self.palette, DEFAULT_PALETTE, strict=True)):
                if color != default:
                    total += mix(device.voxel_count + i & _U32, 0x1000000 + color)
        return total & _U32

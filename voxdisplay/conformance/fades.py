"""Blends of FADE and RAMP (section 7.9 of protocol.md), in their simplest form.

Knows no op and no page.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from voxdisplay.conformance.announced_device import AnnouncedDevice
from voxdisplay.wire import spec


def blend(stops: Sequence[Sequence[int]], count: int, place: int) -> tuple[int, ...]:
    """Return what a place has of the blend of ``stops`` over ``count`` places."""
    m = max(count - 1, 1)
    s, r = divmod(place * (len(stops) - 1), m)
    pairs = zip(stops[s], stops[min(s + 1, len(stops) - 1)], strict=True)
    return tuple(a + (2 * r * (b - a) + m) // (2 * m) for a, b in pairs)


def color_bytes(device: AnnouncedDevice) -> int:
    """Return the bytes of a colour of FADE."""
    return 1 if device.format == spec.FORMAT_INDEX8 else 3


def _level(channel: int, top: int) -> int:
    return (2 * top * channel + 255) // 510


@dataclass
class Fade:
    """A fade, and how far it has come.

    Attributes
    ----------
    device : AnnouncedDevice
    stops : sequence of bytes
        Its colours.
    count : int
        Number of voxels.
    place : int
        The voxel whose pen is the pen now.
    end : int or None
        The cursor as an op of the fade has left it; None if another op has set it since.

    """

    device: AnnouncedDevice
    stops: Sequence[Sequence[int]]
    count: int
    place: int
    end: int | None = None

    def pen(self, place: int) -> int:
        """Return the pixel value of a place."""
        numbers = blend(self.stops, self.count, min(place, self.count - 1))
        if self.device.format == spec.FORMAT_INDEX8:
            return numbers[0]
        red, green, blue = numbers
        if self.device.format == spec.FORMAT_RGB565:
            return _level(red, 31) << 11 | _level(green, 63) << 5 | _level(blue, 31)
        return red | green << 8 | blue << 16

    def count_voxel(self) -> None:
        """Go on to the next place."""
        self.place = min(self.place + 1, self.count)

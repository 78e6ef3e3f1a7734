"""Blends of colours over places in a row: FADE and RAMP (7.9).

Knows nothing of voxels, cursors and pages. Proceeds from place to place by additions, as a device
without a divider would.
"""

from collections.abc import Iterator, Sequence

from firmware_sim import spec

_BYTES_OF_COLOR = 3
_TOPS = (31, 63, 31)  # levels of RGB565 (2.1)
_GREEN, _RED = 5, 11  # where they begin in the u16


class Blend:
    """Walk along a blend.

    Parameters
    ----------
    stops
        The colours, each a sequence of as many numbers.
    count
        Number of places.
    place
        The place at which the walk begins, below ``count``.
    """

    def __init__(self, stops: Sequence[Sequence[int]], count: int, place: int = 0) -> None:
        self._stops = stops
        self._width = max(count - 1, 1)
        self._left = count - 1 - place
        self._stop, self._rest = divmod(place * (len(stops) - 1), self._width)

    @property
    def color(self) -> bytes:
        """The colour of the place, a byte for each number."""
        stops, rest, width = self._stops, self._rest, self._width
        here = stops[self._stop]
        there = stops[min(self._stop + 1, len(stops) - 1)]
        return bytes(
            a + (2 * rest * (b - a) + width) // (2 * width)
            for a, b in zip(here, there, strict=True)
        )

    def advance(self) -> None:
        """Go on to the next place, but not beyond the last."""
        if not self._left:
            return
        self._left -= 1
        self._rest += len(self._stops) - 1
        while self._rest >= self._width:
            self._rest -= self._width
            self._stop += 1


def split_colors(raw: bytes, size: int = _BYTES_OF_COLOR) -> list[bytes]:
    """Return the colours of an operand, each of ``size`` bytes."""
    return [raw[at : at + size] for at in range(0, len(raw), size)]


def ramp(colors: bytes, count: int) -> bytes:
    """Return red, green and blue of ``count`` palette entries that blend colours."""
    blend = Blend(split_colors(colors), count)
    out = bytearray()
    for _ in range(count):
        out += blend.color
        blend.advance()
    return bytes(out)


class Fade:
    """Pen of a fade.

    Parameters
    ----------
    pixel_format
        Code of the pixel format, ``spec.FORMAT_*``.
    blend
        The blend, at the voxel where the fade begins.

    Attributes
    ----------
    pixel : bytes
        The pen of the place.
    """

    def __init__(self, pixel_format: int, blend: Blend) -> None:
        self._packed = pixel_format == spec.FORMAT_RGB565
        self._blend = blend
        self._last = self.pixel = self._pixel()

    def _pixel(self) -> bytes:
        color = self._blend.color
        if not self._packed:
            return color
        red, green, blue = (
            (2 * top * channel + 255) // 510 for top, channel in zip(_TOPS, color, strict=True)
        )
        return (red << _RED | green << _GREEN | blue).to_bytes(2, "little")

    def pens(self, voxels: Sequence[int], *, again: bool) -> Iterator[tuple[int, bytes]]:
        """Yield voxels with their pens, and count them.

        Parameters
        ----------
        voxels
            Indices in the order in which they are written.
        again
            True if the first has been written already, and is not counted.
        """
        for number, voxel in enumerate(voxels):
            if again and not number:
                yield voxel, self._last
                continue
            yield voxel, self.pixel
            self._last = self.pixel
            self._blend.advance()
            self.pixel = self._pixel()

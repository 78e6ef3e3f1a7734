"""Video memory: two pages of pixels in scan order, palette and digest of each (2.1, 6, 7.6, 8).

A pixel stands in memory as it does on the wire; MONO1 has a byte for each voxel. The memory knows
nothing of packets and ops: its callers give it voxels that are on the grid.
"""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Final

from firmware_sim import spec
from firmware_sim.digest import terms, terms_of_one
from firmware_sim.grid import Grid

_COLOR: Final = 3  # bytes of a colour: red, green, blue
_BATCH: Final = 65_536  # voxels that are accounted for at a time
_LONG: Final = 512  # runs from this length on are accounted for one by one


@dataclass(frozen=True)
class PixelFormat:
    """A pixel format of section 2.1.

    Parameters
    ----------
    code
        One of ``spec.FORMAT_*``.
    name
        Its name, in small letters.
    size
        Bytes of a pixel.
    full
        The full pixel.
    """

    code: int
    name: str
    size: int
    full: bytes


FORMATS: Final = {
    pixel_format.name: pixel_format
    for pixel_format in (
        PixelFormat(spec.FORMAT_MONO1, "mono1", 1, b"\x01"),
        PixelFormat(spec.FORMAT_INDEX8, "index8", 1, b"\xff"),
        PixelFormat(spec.FORMAT_RGB565, "rgb565", 2, b"\xff\xff"),
        PixelFormat(spec.FORMAT_RGB888, "rgb888", 3, b"\xff\xff\xff"),
    )
}


def _default_palette() -> bytes:
    """Return the default palette (2.1), its values times 255 rounded to the nearest (8)."""
    return bytes(
        (2 * 255 * level + top) // (2 * top)
        for i in range(spec.LIMIT_MAX_COLORS)
        for level, top in ((i >> 5, 7), (i >> 2 & 7, 7), (i & 3, 3))
    )


DEFAULT_PALETTE: Final = _default_palette()


class Page:
    """Video memory for one whole picture, dark at first.

    Parameters
    ----------
    volume
        Number of voxels.
    pixel_size
        Bytes of a pixel.

    Attributes
    ----------
    pixels : bytearray
        All pixels in scan order, `volume` times `pixel_size` bytes.
    palette : bytearray
        256 colours of red, green and blue, a byte each. Of use with INDEX8 only.
    digest : int
        Section 8; every write keeps it up to date.
    """

    def __init__(self, volume: int, pixel_size: int) -> None:
        self.volume = volume
        self.pixel_size = pixel_size
        self.clear()

    def clear(self) -> None:
        """Make all voxels dark, and the palette the default one."""
        self.pixels = bytearray(self.volume * self.pixel_size)
        self.palette = bytearray(DEFAULT_PALETTE)
        self.digest = 0

    def copy(self, other: "Page") -> None:
        """Take over picture and palette of another page of the same shape."""
        self.pixels[:] = other.pixels
        self.palette[:] = other.palette
        self.digest = other.digest

    def put(self, start: int, pixels: bytes) -> None:
        """Write pixels in scan order.

        Parameters
        ----------
        start
            Index of the first voxel.
        pixels
            Pixels of voxels on the grid, one behind the other.
        """
        size = self.pixel_size
        at = start * size
        old = self.pixels[at : at + len(pixels)]
        if old == pixels:
            return
        self.pixels[at : at + len(pixels)] = pixels
        indices = range(start, start + len(pixels) // size)
        self._account(terms(indices, pixels, size) - terms(indices, old, size))

    def fill(self, start: int, count: int, pixel: bytes) -> None:
        """Write one pixel to many voxels in scan order.

        Parameters
        ----------
        start
            Index of the first voxel.
        count
            How many voxels, all on the grid.
        pixel
            The pixel that all of them get.
        """
        size = self.pixel_size
        old = self.pixels[start * size : (start + count) * size]
        self.pixels[start * size : (start + count) * size] = pixel * count
        self._replace(range(start, start + count), old, pixel)

    def fill_runs(self, starts: Sequence[int], count: int, pixel: bytes) -> None:
        """Write one pixel to many runs of voxels.

        Parameters
        ----------
        starts
            Index of the first voxel of each run.
        count
            How many voxels each run has, all on the grid.
        pixel
            The pixel that all of them get.
        """
        if count >= _LONG:
            for start in starts:
                self.fill(start, count, pixel)
            return
        size = self.pixel_size
        pixels = self.pixels
        run = pixel * count
        batch = _BATCH // count
        for first in range(0, len(starts), batch):
            old = bytearray()
            for start in starts[first : first + batch]:
                place = slice(start * size, (start + count) * size)
                old += pixels[place]
                pixels[place] = run
            runs = (range(start, start + count) for start in starts[first : first + batch])
            self._replace(array("Q", chain.from_iterable(runs)), old, pixel)

    def plot(self, indices: "array[int]", pixel: bytes) -> None:
        """Write one pixel to many voxels.

        Parameters
        ----------
        indices
            Array of type ``"Q"`` of the voxels' indices, each on the grid.
        pixel
            The pixel that all of them get.
        """
        pixels = self.pixels
        size = self.pixel_size
        old = bytearray()
        if size == 1:
            value = pixel[0]
            for index in indices:
                old.append(pixels[index])
                pixels[index] = value
        else:
            for index in indices:
                place = slice(index * size, (index + 1) * size)
                old += pixels[place]
                pixels[place] = pixel
        self._replace(indices, old, pixel)

    def color(self, first: int, colors: bytes) -> None:
        """Set entries of the palette.

        Parameters
        ----------
        first
            The first entry.
        colors
            Red, green and blue of each; none behind the palette's end.
        """
        place = slice(first * _COLOR, first * _COLOR + len(colors))
        old, self.palette[place] = self.palette[place], colors
        self._account(self._color_terms(first, colors) - self._color_terms(first, old))

    def _color_terms(self, first: int, colors: bytes | bytearray) -> int:
        """Return what entries of the palette add to the digest (8), if they have these colours."""
        total = 0
        for i in range(first, first + len(colors) // _COLOR):
            color = colors[(i - first) * _COLOR : (i - first + 1) * _COLOR]
            if color != DEFAULT_PALETTE[i * _COLOR : (i + 1) * _COLOR]:
                total += terms((self.volume + i,), color + b"\1", _COLOR + 1)  # 1000000h + ...
        return total

    def _replace(self, indices: "array[int] | range", old: bytearray, pixel: bytes) -> None:
        """Account for one pixel in the place of others, in the order in which they were written."""
        gain = terms_of_one(indices, int.from_bytes(pixel, "little"))
        self._account(gain - terms(indices, old, self.pixel_size))

    def _account(self, gain: int) -> None:
        self.digest = (self.digest + gain) & 0xFFFFFFFF


class Memory:
    """Front page and back page.

    Parameters
    ----------
    grid
        The shape of the display.
    pixel_format
        The format of its pixels.

    Attributes
    ----------
    front, back : Page
        The page that is shown, and the one that is written.
    """

    PAGES: Final = 2

    def __init__(self, grid: Grid, pixel_format: PixelFormat) -> None:
        self.grid = grid
        self.pixel_format = pixel_format
        self.front = Page(grid.volume, pixel_format.size)
        self.back = Page(grid.volume, pixel_format.size)

    def begin(self, dark: bool) -> None:
        """Prepare the back page for a frame: dark, or a copy of the front page and its palette."""
        if dark:
            self.back.clear()
        else:
            self.back.copy(self.front)

    def swap(self) -> None:
        """Exchange the pages."""
        self.front, self.back = self.back, self.front

"""Video memory: two pages of pixels in scan order, and the digest of each (2.1, 6, 8).

A pixel stands in memory as it does on the wire; MONO1 has a byte for each voxel. The memory knows
nothing of packets and ops: its callers give it voxels that are on the grid.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from firmware_sim import spec
from firmware_sim.digest import terms
from firmware_sim.grid import Grid

if TYPE_CHECKING:
    from array import array


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
    digest : int
        Section 8; every write keeps it up to date.
    """

    def __init__(self, volume: int, pixel_size: int) -> None:
        self.volume = volume
        self.pixel_size = pixel_size
        self.clear()

    def clear(self) -> None:
        """Make all voxels dark."""
        self.pixels = bytearray(self.volume * self.pixel_size)
        self.digest = 0

    def copy(self, other: "Page") -> None:
        """Take over the picture of another page of the same shape."""
        self.pixels[:] = other.pixels
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
        self.pixels[at : at + len(pixels)] = pixels
        self._account(range(start, start + len(pixels) // size), old, pixels)

    def plot(self, indices: "array[int]", pixel: bytes) -> None:
        """Write one pixel to many voxels.

        Parameters
        ----------
        indices
            Array of type ``"Q"`` of the voxels' indices, each on the grid and no two equal.
        pixel
            The pixel that all of them get.
        """
        pixels = self.pixels
        size = self.pixel_size
        old = bytearray()
        for index in indices:
            at = index * size
            place = slice(at, at + size)
            old += pixels[place]
            pixels[place] = pixel
        self._account(indices, old, pixel * len(indices))

    def _account(self, indices: "array[int] | range", old: bytes | bytearray, new: bytes) -> None:
        if old == new:
            return
        gain = terms(indices, new, self.pixel_size) - terms(indices, old, self.pixel_size)
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
        """Prepare the back page for a frame: dark, or a copy of the front page."""
        if dark:
            self.back.clear()
        else:
            self.back.copy(self.front)

    def swap(self) -> None:
        """Exchange the pages."""
        self.front, self.back = self.back, self.front

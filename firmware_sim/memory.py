"""Video memory: two pages of pixels in scan order, palette and digest of each (2.1, 6, 7.6, 8).

Pixels have the same bytes in memory as on the wire, except that MONO1 has a byte per voxel. A page
costs what has been written on it: the rest takes no memory, and no time to clear or copy. Knows
nothing of packets and ops: callers pass voxels that are on the grid.
"""

import mmap
import os
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from firmware_sim import spec
from firmware_sim.digest import mix_sum
from firmware_sim.grid import Grid

_COLOR: Final = 3  # bytes of a colour: red, green, blue
_LOG_VOXELS: Final = 4096  # written voxels to collect before the digest is updated with them
_DIRECT_VOXELS: Final = 256  # writes of so many voxels update the digest at once
_MEGABYTE: Final = 1_000_000
_BLOCK_BITS: Final = 10  # a block of so many voxels in scan order is copied as a whole
_PENDING_VOXELS: Final = 1 << 16  # written voxels to collect before their blocks are found
_SPARSE: Final = 4  # with more than one of so many blocks to copy, the whole page is copied


@dataclass(frozen=True)
class PixelFormat:
    """A pixel format of section 2.1.

    Parameters
    ----------
    code
        One of ``spec.FORMAT_*``.
    name
        Its name in lower case.
    size
        Number of bytes of a pixel.
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
    """Return the default palette (2.1), its values times 255 rounded to nearest (8)."""
    return bytes(
        (2 * 255 * level + top) // (2 * top)
        for i in range(spec.LIMIT_MAX_COLORS)
        for level, top in ((i >> 5, 7), (i >> 2 & 7, 7), (i & 3, 3))
    )


DEFAULT_PALETTE: Final = _default_palette()


def _dark_memory(size: int) -> mmap.mmap:
    """Return zeros that take up memory only where they are written."""
    # Without a reservation: most of a large volume is never written.
    flags = {"flags": mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS | getattr(mmap, "MAP_NORESERVE", 0)}
    memory = mmap.mmap(-1, size, **flags if hasattr(mmap, "MAP_PRIVATE") else {})
    if hasattr(mmap, "MADV_NOHUGEPAGE"):  # or one voxel takes up 2 MiB
        memory.madvise(mmap.MADV_NOHUGEPAGE)
    return memory


class Page:
    """Video memory for one frame, initially dark.

    Parameters
    ----------
    volume
        Number of voxels.
    pixel_size
        Number of bytes of a pixel.

    Attributes
    ----------
    memory : mmap
        All pixels in scan order, `volume` times `pixel_size` bytes.
    palette : bytearray
        256 colours of red, green and blue, a byte each. Used with INDEX8 only.
    """

    def __init__(self, volume: int, pixel_size: int) -> None:
        self.volume = volume
        self.pixel_size = pixel_size
        self.clear()

    def clear(self) -> None:
        """Make all voxels dark, and the palette the default one."""
        self.memory = _dark_memory(self.volume * self.pixel_size)
        self.palette = bytearray(DEFAULT_PALETTE)
        self._digest = 0
        self._clear_log()
        self._lit_blocks: set[int] = set()  # blocks that may have lit voxels
        self._equal_since: object = object()  # identifies the last copy between two pages
        self._changed_blocks: set[int] = set()  # blocks written since that copy
        self._clear_writes()

    def copy_from(self, other: "Page") -> None:
        """Copy pixels and palette of another page of the same size."""
        self._find_blocks()
        other._find_blocks()  # noqa: SLF001 - of its own kind
        if self._equal_since is other._equal_since:  # noqa: SLF001
            blocks = self._changed_blocks | other._changed_blocks  # noqa: SLF001
        else:
            blocks = self._lit_blocks | other._lit_blocks  # noqa: SLF001
        if len(blocks) * _SPARSE > self.volume >> _BLOCK_BITS:
            self.memory[:] = other.memory[:]
        else:
            block_size = self.pixel_size << _BLOCK_BITS
            for block in blocks:
                place = slice(block * block_size, (block + 1) * block_size)
                self.memory[place] = other.memory[place]
        self.palette[:] = other.palette
        self._digest = other.digest
        self._clear_log()
        self._lit_blocks = set(other._lit_blocks)  # noqa: SLF001
        self._equal_since = other._equal_since = object()  # noqa: SLF001
        self._changed_blocks.clear()
        other._changed_blocks.clear()  # noqa: SLF001

    @property
    def pixels(self) -> bytes:
        """A copy of all pixels in scan order."""
        return bytes(self.memory)

    def put(self, start: int, pixels: bytes) -> None:
        """Write pixels in scan order.

        Parameters
        ----------
        start
            Index of the first voxel.
        pixels
            Pixels of consecutive voxels on the grid.
        """
        size = self.pixel_size
        place = slice(start * size, start * size + len(pixels))
        old = self.memory[place]
        self.memory[place] = pixels
        self._log_replaced(range(start, start + len(pixels) // size), old, pixels)

    def fill(self, starts: Sequence[int], count: int, pixel: bytes) -> None:
        """Write the same pixel to runs of voxels in scan order.

        Parameters
        ----------
        starts
            Index of the first voxel of each run.
        count
            Length of each run in voxels, all on the grid.
        pixel
            The pixel.
        """
        run = pixel * count
        for start in starts:
            self.put(start, run)

    def plot(self, indices: "array[int]", pixel: bytes) -> None:
        """Write the same pixel to many voxels.

        Parameters
        ----------
        indices
            Array of type ``"Q"`` of distinct indices on the grid.
        pixel
            The pixel.
        """
        memory = self.memory
        size = self.pixel_size
        old = bytearray(len(indices) * size)
        for k, value in enumerate(pixel):
            places = indices if size == 1 else [index * size + k for index in indices]
            old[k::size] = bytes(map(memory.__getitem__, places))
            for place in places:
                memory[place] = value
        self._log_replaced(indices, old, pixel * len(indices))

    def set_colors(self, first: int, colors: bytes) -> None:
        """Set entries of the palette.

        Parameters
        ----------
        first
            The first entry.
        colors
            Red, green and blue of each entry, none beyond the end of the palette.
        """
        place = slice(first * _COLOR, first * _COLOR + len(colors))
        gain = -self._color_terms(place)
        self.palette[place] = colors
        self._digest += gain + self._color_terms(place)

    # The digest

    @property
    def digest(self) -> int:
        """Digest of the page as it is now, section 8."""
        size = self.pixel_size
        gain = mix_sum(self._written, self._new, size) - mix_sum(self._written, self._old, size)
        self._digest = (self._digest + gain) & 0xFFFFFFFF
        self._clear_log()
        return self._digest

    def _clear_log(self) -> None:
        """Begin a new log of writes that are not in the digest yet."""
        self._written = array("Q")  # indices in the order of the writes, possibly repeated
        self._old = bytearray()  # pixels before each write
        self._new = bytearray()  # pixels after it

    def _log_replaced(self, indices: Sequence[int], old: bytes | bytearray, new: bytes) -> None:
        if old == new:
            return
        size = self.pixel_size
        self._writes.append(indices)
        self._pending_voxels += len(indices)
        if self._pending_voxels > _PENDING_VOXELS:
            self._find_blocks()
        if len(indices) >= _DIRECT_VOXELS:
            self._digest += mix_sum(indices, new, size) - mix_sum(indices, old, size)
            return
        self._written.extend(indices)
        self._old += old
        self._new += new
        if len(self._written) >= _LOG_VOXELS:
            self._digest = self.digest

    # Blocks

    def _clear_writes(self) -> None:
        self._writes: list[Sequence[int]] = []  # whose blocks have not been found yet
        self._pending_voxels = 0

    def _find_blocks(self) -> None:
        """Add the blocks of all collected writes to those that have changed and may be lit."""
        for indices in self._writes:
            if isinstance(indices, range):
                blocks = range(indices[0] >> _BLOCK_BITS, (indices[-1] >> _BLOCK_BITS) + 1)
                self._changed_blocks.update(blocks)
            else:
                self._changed_blocks.update([index >> _BLOCK_BITS for index in indices])
        self._lit_blocks |= self._changed_blocks
        self._clear_writes()

    def _color_terms(self, place: slice) -> int:
        """Return the digest terms of a part of the palette."""
        entries = [
            at
            for at in range(place.start, place.stop, _COLOR)
            if self.palette[at : at + _COLOR] != DEFAULT_PALETTE[at : at + _COLOR]
        ]
        values = b"".join(self.palette[at : at + _COLOR] + b"\1" for at in entries)
        return mix_sum([self.volume + at // _COLOR for at in entries], values, _COLOR + 1)


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

    Raises
    ------
    ValueError
        If this machine has not enough memory for the pages.
    """

    PAGES: Final = 2

    def __init__(self, grid: Grid, pixel_format: PixelFormat) -> None:
        self.grid = grid
        self.pixel_format = pixel_format
        needed = self.PAGES * grid.volume * pixel_format.size  # if all is written
        too_large = ValueError(
            f"a grid of {grid} {pixel_format.name} needs {needed // _MEGABYTE} MB of memory, more "
            "than this machine has: take a smaller one"
        )
        if needed > _memory_bytes():
            raise too_large
        try:
            self.front = Page(grid.volume, pixel_format.size)
            self.back = Page(grid.volume, pixel_format.size)
        except (MemoryError, OSError):
            raise too_large from None

    def begin_frame(self, dark: bool) -> None:
        """Prepare the back page for a frame: dark, or a copy of the front page with its palette."""
        if dark:
            self.back.clear()
        else:
            self.back.copy_from(self.front)

    def swap(self) -> None:
        """Exchange the pages."""
        self.front, self.back = self.back, self.front


def _memory_bytes() -> int:
    """Return the physical memory of this machine; a very large number if it is not known."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return 1 << 62

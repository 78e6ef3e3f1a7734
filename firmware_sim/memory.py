"""Video memory: two pages of pixels in scan order, palette and digest of each (2.1, 6, 7.6, 8).

Pixels have the same bytes in memory as on the wire, except that MONO1 has a byte per voxel. A page
costs what has been written on it: the rest takes no memory, and no time to clear or copy. Knows
nothing of packets and ops: callers pass voxels that are on the grid.
"""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Final

from firmware_sim import spec
from firmware_sim.digest import mix_sum
from firmware_sim.grid import Grid
from firmware_sim.sparse_pixels import BLOCK_BITS, SparsePixels

_COLOR: Final = 3  # bytes of a colour: red, green, blue
_LOG_VOXELS: Final = 4096  # written voxels to collect before the digest is updated with them
_PENDING_VOXELS: Final = 1 << 16  # written voxels to collect before their blocks are found
_RUN_VOXELS: Final = 1 << 16  # longest run to write at once, to bound what a copy of it takes


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
    stored : SparsePixels
        All pixels in scan order.
    palette : bytearray
        256 colours of red, green and blue, a byte each. Used with INDEX8 only.
    """

    def __init__(self, volume: int, pixel_size: int) -> None:
        self.volume = volume
        self.pixel_size = pixel_size
        self.stored = SparsePixels(volume, pixel_size)
        self._log_bytes = _LOG_VOXELS * pixel_size
        self._run_start = self._run_end = -1  # the last write, if of consecutive voxels
        self.clear()

    def clear(self) -> None:
        """Make all voxels dark, and the palette the default one."""
        self.stored.clear()
        self.palette = bytearray(DEFAULT_PALETTE)
        self._digest = 0
        self._clear_log()
        self._equal_since: object = object()  # identifies the last copy between two pages
        self._changed_blocks: set[int] = set()  # blocks written since that copy
        self._clear_writes()

    def copy_from(self, other: "Page") -> None:
        """Copy pixels and palette of another page of the same size."""
        self._settle()
        self._find_blocks()
        other._settle()  # noqa: SLF001 - of its own kind
        other._find_blocks()  # noqa: SLF001
        blocks = None
        if self._equal_since is other._equal_since:  # noqa: SLF001
            blocks = self._changed_blocks | other._changed_blocks  # noqa: SLF001
        self.stored.copy_from(other.stored, blocks)
        self.palette[:] = other.palette
        self._digest = other.digest
        self._equal_since = other._equal_since = object()  # noqa: SLF001
        self._changed_blocks.clear()
        other._changed_blocks.clear()  # noqa: SLF001

    @property
    def pixels(self) -> bytes:
        """A copy of all pixels in scan order."""
        return bytes(self.stored)

    def put(self, start: int, pixels: bytes) -> None:
        """Write pixels in scan order.

        Parameters
        ----------
        start
            Index of the first voxel.
        pixels
            Pixels of consecutive voxels on the grid, at least one.
        """
        old = self.stored.exchange_run(start, pixels)
        if start != self._run_end:
            self._end_run()
            self._run_start = start
        self._run_end = start + len(pixels) // self.pixel_size
        self._log_pixels(old, pixels)

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
        dark = not any(pixel)
        run = pixel * min(count, _RUN_VOXELS)
        if count <= _RUN_VOXELS and not dark:
            for start in starts:
                self.put(start, run)
            return
        for start in starts:
            at, end = start, start + count
            while (at := self.stored.next_stored(at, end) if dark else at) < end:
                length = min(end - at, _RUN_VOXELS)
                self.put(at, run[: length * self.pixel_size])
                at += length

    def plot(self, indices: "array[int]", pixel: bytes) -> None:
        """Write the same pixel to many voxels.

        Parameters
        ----------
        indices
            Array of type ``"Q"`` of distinct indices on the grid.
        pixel
            The pixel.
        """
        old = self.stored.exchange(indices, pixel)
        self._end_run()
        self._log.append(indices)
        self._log_pixels(old, pixel * len(indices))

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
        self._digest = (self._digest + gain + self._color_terms(place)) & 0xFFFFFFFF

    # The digest

    @property
    def digest(self) -> int:
        """Digest of the page as it is now, section 8."""
        self._settle()
        return self._digest

    def _clear_log(self) -> None:
        """Begin a new log of writes that are not in the digest yet."""
        self._log: list[Sequence[int]] = []  # indices, in the order of the writes
        self._old = bytearray()  # pixels before each write
        self._new = bytearray()  # pixels after it
        self._run_end = -1

    def _end_run(self) -> None:
        """Take consecutive voxels that were written in one or more pieces for one write."""
        if self._run_end >= 0:
            self._log.append(range(self._run_start, self._run_end))
            self._run_end = -1

    def _log_pixels(self, old: bytes | bytearray, new: bytes) -> None:
        self._old += old
        self._new += new
        if len(self._new) >= self._log_bytes:
            self._settle()

    def _settle(self) -> None:
        """Update the digest with all logged writes."""
        self._end_run()
        log, size = self._log, self.pixel_size
        if self._old != self._new:
            indices = log[0] if len(log) == 1 else array("Q", chain.from_iterable(log))
            gain = mix_sum(indices, self._new, size) - mix_sum(indices, self._old, size)
            self._digest = (self._digest + gain) & 0xFFFFFFFF
            self._writes += log
            self._pending_voxels += len(indices)
            if self._pending_voxels > _PENDING_VOXELS:
                self._find_blocks()
        self._clear_log()

    # Blocks

    def _clear_writes(self) -> None:
        self._writes: list[Sequence[int]] = []  # whose blocks have not been found yet
        self._pending_voxels = 0

    def _find_blocks(self) -> None:
        """Add the blocks of all collected writes to those that have changed."""
        for indices in self._writes:
            if isinstance(indices, range):
                first, last = indices[0] >> BLOCK_BITS, indices[-1] >> BLOCK_BITS
                if first == last:
                    self._changed_blocks.add(first)
                else:
                    self._changed_blocks.update(range(first, last + 1))
            else:
                self._changed_blocks.update([index >> BLOCK_BITS for index in indices])
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
    """

    PAGES: Final = 2

    def __init__(self, grid: Grid, pixel_format: PixelFormat) -> None:
        self.grid = grid
        self.pixel_format = pixel_format
        self.front = Page(grid.volume, pixel_format.size)
        self.back = Page(grid.volume, pixel_format.size)

    def begin_frame(self, dark: bool) -> None:
        """Prepare the back page for a frame: dark, or a copy of the front page with its palette."""
        if dark:
            self.back.clear()
        else:
            self.back.copy_from(self.front)

    def swap(self) -> None:
        """Exchange the pages."""
        self.front, self.back = self.back, self.front

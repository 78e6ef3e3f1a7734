"""Palette of INDEX8 pages: colour of each pixel value, and allocation of entries to colours.

On a display with the feature PALETTE every page has its own (protocol.md, section 7.6): a frame can
show any colours, at most 255 besides black. Others have the default palette. Must not know voxels.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.array_arguments import as_array
from voxdisplay.raster.pixel_format import PixelFormat, Values

Colors = NDArray[np.uint8]

ENTRIES = 256
DEFAULT: Colors = PixelFormat.INDEX8.rgb(np.arange(ENTRIES))
DEFAULT.flags.writeable = False


class Palette:
    """Colours of pixel values. Pixel 0 is dark, whatever its entry is.

    Parameters
    ----------
    colors : (256, 3) uint8 array, optional
        Red, green and blue of each value; the default palette if left out.
    grows : bool
        True if a missing colour may take an entry that no pixel has used.

    Attributes
    ----------
    colors : (256, 3) uint8 array

    """

    def __init__(self, colors: Colors | None = None, *, grows: bool = False) -> None:
        self.colors = (DEFAULT if colors is None else _validated(colors)).copy()
        self._grows = grows
        self._used = np.zeros(ENTRIES, dtype=np.bool_)
        self._used[0] = True

    def copy(self) -> Palette:
        """Return a copy, with the same entries in use."""
        twin = Palette(self.colors, grows=self._grows)
        twin._used = self._used.copy()
        return twin

    def mark_used(self, values: NDArray[np.integer]) -> None:
        """Mark entries as used by pixels: they keep their colours."""
        self._used[values] = True

    def entries_differing(self, other: Colors) -> NDArray[np.int64]:
        """Return the entries that differ from other colours, ascending."""
        return np.flatnonzero((self.colors != other).any(axis=1))

    def rgb(self, values: NDArray[np.integer]) -> Colors:
        """Return the colours, (n, 3), that pixel values, (n,), show: black for 0."""
        shown = self.colors.copy()
        shown[0] = 0
        return shown[np.asarray(values)]

    def nearest(self, rgb: Colors) -> Values:
        """Return the pixel values of colours, (n, 3): exact ones while free entries last.

        If there are more colours than entries, those that get one are spread evenly over the order
        of their first use; the others take the nearest by the sum of squared differences.
        """
        wanted, first, back = np.unique(_packed_rgb(rgb), return_index=True, return_inverse=True)
        order = np.argsort(first)  # of their first use
        values = np.empty(len(wanted), dtype=np.int64)
        values[order] = self._values_of(wanted[order])
        self.mark_used(values)
        return values[back].astype(np.uint32)

    def _values_of(self, wanted: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the values of distinct colours, as 24-bit numbers."""
        entries = _packed_rgb(self.colors)
        entries[0] = 0  # black is pixel 0
        known, where = np.unique(entries, return_index=True)
        at = np.searchsorted(known, wanted).clip(max=len(known) - 1)
        values = np.where(known[at] == wanted, where[at], -1)
        self.mark_used(values[values >= 0])
        missing = np.flatnonzero(values < 0)
        if self._grows and len(missing):
            free = np.flatnonzero(~self._used)
            count = min(len(free), len(missing))
            chosen = missing[np.arange(count) * len(missing) // max(count, 1)]
            values[chosen] = free[:count]
            self.colors[free[:count]] = _unpacked_rgb(wanted[chosen])
            self._used[free[:count]] = True
            missing = np.flatnonzero(values < 0)
        if len(missing):
            shown = self.rgb(np.arange(ENTRIES)).astype(np.int64)
            for begin in range(0, len(missing), ENTRIES):
                some = missing[begin : begin + ENTRIES]
                apart = _unpacked_rgb(wanted[some]).astype(np.int64)[:, None] - shown
                values[some] = (apart**2).sum(axis=2).argmin(axis=1)
        return values


def _packed_rgb(rgb: Colors) -> NDArray[np.int64]:
    """Return colours as 24-bit numbers."""
    red, green, blue = rgb.astype(np.int64).T
    return np.asarray(red << 16 | green << 8 | blue)


def _unpacked_rgb(codes: NDArray[np.int64]) -> Colors:
    return np.stack((codes >> 16, codes >> 8 & 255, codes & 255), axis=1).astype(np.uint8)


def _validated(colors: Colors) -> Colors:
    colors = as_array("palette", colors)
    if colors.shape != DEFAULT.shape or colors.dtype != np.uint8:
        raise ValueError(
            f"palette: it is a (256, 3) array of uint8, red, green and blue of each pixel value; "
            f"this is {colors.shape} of {colors.dtype}"
        )
    return colors

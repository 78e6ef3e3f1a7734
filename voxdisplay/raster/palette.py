"""Palette of INDEX8 pages: colour of each pixel value, and allocation of entries to colours.

On a display with the feature PALETTE every page has its own (protocol.md, section 7.6): a frame can
show any colours, at most 255 besides black. Others have the default palette. Must not know voxels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.array_arguments import as_array
from voxdisplay.raster.color import interpolate_colors
from voxdisplay.raster.pixel_format import PixelFormat, Values

Colors = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Ramp:
    """Entries of a palette that blend colours: ``count`` of them from ``first`` on.

    Attributes
    ----------
    first, count : int
    stops : (k, 3) uint8 array
        The colours.

    """

    first: int
    count: int
    stops: Colors


ENTRIES = 256
# Fewer entries in a row do not show what is between colours.
_SHORTEST_RAMP = 64
_FEWEST_VOXELS = 64
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
    ramps : list of Ramp
        Entries that were taken for blends; RAMP sets each in few bytes.

    """

    def __init__(self, colors: Colors | None = None, *, grows: bool = False) -> None:
        self.colors = (DEFAULT if colors is None else _validated(colors)).copy()
        self._grows = grows
        self._used = np.zeros(ENTRIES, dtype=np.bool_)
        self._used[0] = True
        self.ramps: list[Ramp] = []
        # What was decided for curves by their stops and voxels: the same again if drawn again.
        self._decided: dict[tuple[bytes, int], Ramp | None] = {}

    def copy(self) -> Palette:
        """Return a copy, with the same entries in use."""
        twin = Palette(self.colors, grows=self._grows)
        twin._used = self._used.copy()
        twin.ramps = list(self.ramps)
        twin._decided = dict(self._decided)
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

    def ramp(self, stops: Colors, voxels: int) -> Ramp | None:
        """Take entries in a row for colours that are spread along a curve.

        Parameters
        ----------
        stops : (k, 3) uint8 array
            The colours.
        voxels : int
            How many voxels the curve has.

        Returns
        -------
        Ramp or None
            None where single entries are better: if it does not grow, if black is among the
            colours, which is dark, or if fewer entries than voxels show all colours as they are.

        """
        if not self._grows or voxels < _FEWEST_VOXELS:
            return None
        key = (stops.tobytes(), voxels)
        if key not in self._decided:
            self._decided[key] = self._new_ramp(stops, voxels)
        return self._decided[key]

    def _new_ramp(self, stops: Colors, voxels: int) -> Ramp | None:
        """Return the ramp of a curve that is drawn for the first time."""
        wanted = np.unique(_packed_rgb(interpolate_colors(stops, voxels)))
        if wanted[0] == 0:
            return None
        free = np.flatnonzero(~self._used)
        if len(free) < len(wanted):
            count = len(free)
        elif voxels <= len(free) and 2 * len(wanted) > voxels:
            count = voxels
        else:
            return None
        for ramp in self.ramps:
            if ramp.count >= count and np.array_equal(ramp.stops, stops):
                return ramp
        if not len(free):
            return None
        begins = np.flatnonzero(np.append(True, np.diff(free) != 1))
        lengths = np.diff(begins, append=len(free))
        longest = int(lengths.max())
        if longest < (count if count == voxels else _SHORTEST_RAMP):
            return None
        ramp = Ramp(int(free[begins[lengths.argmax()]]), min(count, longest), stops)
        self.ramps.append(ramp)
        entries = slice(ramp.first, ramp.first + ramp.count)
        self.colors[entries] = interpolate_colors(stops, ramp.count)
        self._used[entries] = True
        return ramp

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

"""Conversion of voxels and their colours to an item of a display list.

Must not know curves or frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.color import blend
from voxdisplay.raster.display_list import DrawnVoxels, Kind, Spread
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.palette import Palette
from voxdisplay.raster.pixel_format import PixelFormat, Values

# Formats whose pixels do not blend as their colours do.
_UNBLENDED = (PixelFormat.MONO1, PixelFormat.INDEX8)


class ColoredItem(NamedTuple):
    """Voxels of one object on the grid, with their pixels.

    Attributes
    ----------
    item : DrawnVoxels
    clipped : int
        Number of voxels outside the grid, which the item lacks.
    exact : bool
        True if the pixels show the colours as they are.

    """

    item: DrawnVoxels
    clipped: int
    exact: bool


class ColoredItems(NamedTuple):
    """Voxels of k objects on the grid, with their pixels.

    Attributes
    ----------
    items : DrawnVoxels
    clipped : (k,) int64 array
        Number of voxels of each that are outside the grid, which the items lack.
    exact : (k,) bool array
        True where the pixels show the colours as they are.

    """

    items: DrawnVoxels
    clipped: NDArray[np.int64]
    exact: NDArray[np.bool_]


class Coloring(NamedTuple):
    """Conversion of colours to pixels; without a palette, by the default one."""

    grid: Grid
    format: PixelFormat
    palette: Palette | None

    def colors_of(self, values: NDArray[np.integer]) -> NDArray[np.uint8]:
        """Return the colours, (n, 3) uint8, that pixel values, (n,), show."""
        return self.palette.rgb(values) if self.palette else self.format.rgb(values)

    def item(
        self,
        voxels: NDArray[np.integer],
        colors: NDArray[np.uint8] | Spread,
        kind: Kind,
        corners: NDArray[np.int64] | None = None,
    ) -> ColoredItem:
        """Return voxels as an item; colours that a growing palette lacks get entries.

        Parameters
        ----------
        voxels : (N, 3) integer array
            Columns x, y, z, inside the grid or not.
        colors : (1, 3), (N, 3) or (k, 3) uint8 array, or Spread
            One colour, one for each voxel, or several spread along the rows; or what is spread
            along a curve of which these are a stretch.
        kind : Kind
        corners : (c,) int64 array, optional
            Rows at which a straight line may end and another begin.

        """
        rgb, spread = self._rgb_of(colors, len(voxels))
        found, spread = self._pixels_of(rgb, spread if kind is not Kind.SET else None)
        exact = np.array_equal(self.colors_of(found), rgb)
        values = np.broadcast_to(found, (len(voxels),)) if len(found) != len(voxels) else found
        inside = self.grid.inside(voxels)
        at_corner = np.zeros(len(voxels), dtype=np.bool_)
        if corners is not None:
            at_corner[corners] = True
        # Voxels outside have meaningless indices; they are removed here.
        drawn = DrawnVoxels.of_item(self.grid.index_of(voxels), values, at_corner, kind, spread)
        clipped = len(inside) - int(np.count_nonzero(inside))
        return ColoredItem(drawn.select(inside), clipped, exact)

    def items(
        self,
        voxels: Sequence[NDArray[np.integer]],
        colors: Sequence[NDArray[np.uint8] | Spread],
        kind: Kind,
        corners: Sequence[NDArray[np.int64]],
    ) -> ColoredItems:
        """Return the voxels of k objects, at least one, as items: as `item` on each, but faster.

        Parameters
        ----------
        voxels : sequence of (N, 3) integer arrays
        colors : sequence of (1, 3), (N, 3) or (k, 3) uint8 arrays, or Spread
        kind : Kind
            Of all of them.
        corners : sequence of (c,) int64 arrays
            Rows at which a straight line may end and another begin.

        """
        lengths = list(map(len, voxels))
        looked_up = [
            self._rgb_of(each, length) for each, length in zip(colors, lengths, strict=True)
        ]
        rgb, spreads = zip(*looked_up, strict=True)
        counts, rows = np.array(lengths), np.array(list(map(len, rgb)))
        numbers = np.arange(len(counts), dtype=np.int32)
        together = np.concatenate(rgb)
        if self.palette:
            found, spreads = self._palette_pixels(rgb, spreads)
        else:
            found, spreads = self.format.nearest(together), self._blended(spreads)
        inexact = (self.colors_of(found) != together).any(axis=1)
        exact = np.ones(len(counts), dtype=np.bool_)
        exact[numbers.repeat(rows)[inexact]] = False
        # A single colour is that of all voxels.
        values = found.repeat(np.where(rows == 1, counts, 1).repeat(rows))
        every, item = np.concatenate(voxels), numbers.repeat(counts)
        inside = self.grid.inside(every)
        at_corner = np.zeros(len(every), dtype=np.bool_)
        for first, own in zip((np.cumsum(counts) - counts).tolist(), corners, strict=True):
            if len(own):
                at_corner[first + own] = True
        kinds = np.full(len(counts), kind, dtype=np.int8)
        # Voxels outside have meaningless indices; they are removed here.
        drawn = DrawnVoxels(self.grid.index_of(every), values, item, at_corner, kinds)
        if any(spreads):
            begin = np.array([each.first if each else 0 for each in spreads], dtype=np.int32)
            behind = begin - (np.cumsum(counts) - counts)
            places = (np.arange(len(every)) + behind.repeat(counts)).astype(np.int32)
            drawn = replace(drawn, places=places, spreads=spreads)
        clipped = counts - np.bincount(item[inside], minlength=len(counts))
        return ColoredItems(drawn.select(inside), clipped, exact)

    def _rgb_of(
        self, colors: NDArray[np.uint8] | Spread, length: int
    ) -> tuple[NDArray[np.uint8], Spread | None]:
        """Return one colour, which is looked up once, or one for each voxel; and their spread."""
        if not isinstance(colors, Spread):
            if len(colors) in {1, length}:
                return colors, None
            colors = Spread(colors, length)
        rgb = blend(colors.stops, colors.count, colors.first + np.arange(length))
        return rgb, colors

    def _blended(self, spreads: Sequence[Spread | None]) -> tuple[Spread | None, ...]:
        """Return the spreads of pixels without a palette of their own."""
        return (None,) * len(spreads) if self.format in _UNBLENDED else tuple(spreads)

    def _pixels_of(
        self, rgb: NDArray[np.uint8], spread: Spread | None
    ) -> tuple[Values, Spread | None]:
        """Return the pixel values of colours, and the spread that they have."""
        if self.palette is None:
            return self.format.nearest(rgb), self._blended([spread])[0]
        ramp = self.palette.ramp(spread.stops, spread.count) if spread else None
        if ramp is None or spread is None:
            return self.palette.nearest(rgb), None
        ends = np.array([[ramp.first], [ramp.first + ramp.count - 1]], dtype=np.uint8)
        spread = Spread(ends, spread.count, spread.first)
        values = blend(ends, spread.count, spread.first + np.arange(len(rgb)))
        return values[:, 0].astype(np.uint32), spread

    def _palette_pixels(
        self, rgb: Sequence[NDArray[np.uint8]], spreads: Sequence[Spread | None]
    ) -> tuple[Values, tuple[Spread | None, ...]]:
        """Return what objects have of a palette, whose entries they get one after another."""
        known: dict[tuple[bytes, bytes, int], tuple[Values, Spread | None]] = {}
        found, pixel_spreads = [], []
        for each, spread in zip(rgb, spreads, strict=True):
            stops = spread.stops.tobytes() if spread else b""
            key = (each.tobytes(), stops, spread.first if spread else -1)
            if key not in known:
                known[key] = self._pixels_of(each, spread)
            values, pixel_spread = known[key]
            found.append(values)
            pixel_spreads.append(pixel_spread)
        return np.concatenate(found), tuple(pixel_spreads)

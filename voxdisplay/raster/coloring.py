"""Conversion of voxels and their colours to an item of a display list.

Must not know curves or frames.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.color import blend
from voxdisplay.raster.display_list import DrawnVoxels, Kind, Spread
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.palette import Palette
from voxdisplay.raster.pixel_format import PixelFormat

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
        # A single colour is looked up once.
        spread = None
        if isinstance(colors, Spread):
            spread = colors
        elif len(colors) in {1, len(voxels)}:
            rgb = colors
        else:
            spread = Spread(colors, len(voxels))
        if spread:
            rgb = blend(spread.stops, spread.count, spread.first + np.arange(len(voxels)))
        if self.format in _UNBLENDED:
            spread = None
        found = self.palette.nearest(rgb) if self.palette else self.format.nearest(rgb)
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

"""Sparse raster of a frame: a display list over a page that was set from an array, if any.

Costs what is drawn; only a page is dense, and it is never written to, so that copies share it. Must
not know curves, colours or encodings.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.display_list import DisplayList, DrawnVoxels, Kind
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat, Pixels, Values, is_lit
from voxdisplay.raster.pixel_map import PixelMap, contains, without

# With more drawn voxels for each one left, a copy forgets their order.
_OVERDRAW_LIMIT = 4


@dataclass(frozen=True, eq=False)
class Page:
    """Pixels of a whole grid, which must not change.

    Attributes
    ----------
    pixels : ndarray
        In scan order: (V,), or (V, 3) for rgb888.
    format : PixelFormat

    """

    pixels: Pixels
    format: PixelFormat

    @cached_property
    def lit(self) -> PixelMap:
        """Lit voxels."""
        index = np.flatnonzero(is_lit(self.pixels))
        return PixelMap(index, self.at(index))

    def at(self, index: NDArray[np.int64]) -> Values:
        """Return the pixel values, (n,), of voxels, (n,)."""
        return self.format.values(self.pixels.take(index, axis=0))


class SparseRaster:
    """Pixels of one frame.

    Attributes
    ----------
    grid : Grid
    format : PixelFormat
    page : Page or None
        What was set from an array, below all that is drawn; None if the grid is dark there.

    """

    def __init__(self, grid: Grid, format: PixelFormat) -> None:  # noqa: A002 - as for `Frame`
        self.grid = grid
        self.format = format
        self.page: Page | None = None
        self._drawn = DisplayList()
        self._lit: PixelMap | None = None

    def copy(self) -> SparseRaster:
        """Return another raster of the same pixels; both share all arrays."""
        self._forget_order_if_overdrawn()
        twin = SparseRaster(self.grid, self.format)
        twin.page, twin._drawn, twin._lit = self.page, self._drawn.copy(), self._lit
        return twin

    def _forget_order_if_overdrawn(self) -> None:
        """Replace the items by their pixels if most drawn voxels are covered."""
        pixels = self._drawn.pixels
        if len(self._drawn) > _OVERDRAW_LIMIT * len(pixels):
            self._drawn = DisplayList()
            none = np.zeros(len(pixels), dtype=np.bool_)
            self._drawn.append(DrawnVoxels.of_item(pixels.index, pixels.values, none, Kind.SET))

    def cropped(self, corner: tuple[int, int, int], grid: Grid) -> SparseRaster:
        """Return the raster of a box, of which ``corner`` is the lowest voxel; order is kept."""
        found = SparseRaster(grid, self.format)
        if self.page is not None:
            x, y, z = corner
            array = self.page.pixels.reshape(self.format.shape(self.grid.array_shape))
            box = array[z : z + grid.nz, y : y + grid.ny, x : x + grid.nx]
            pixels: Pixels = np.array(box, order="C").reshape(self.format.shape((grid.voxels,)))
            found.set(pixels)
        if (drawn := self.visible) is not None:
            voxels = self.grid.voxels_at(drawn.index) - np.array(corner, dtype=np.int32)
            inside = grid.inside(voxels)
            if inside.any():
                index = grid.index_of(voxels[inside])
                found.draw(replace(drawn.select(inside), index=index))
        return found

    def draw(self, item: DrawnVoxels) -> None:
        """Draw an item over what is there."""
        self._drawn.append(item)
        self._lit = None

    def set(self, pixels: Pixels) -> None:
        """Replace all by a page, which must not change afterwards."""
        self.clear()
        self.page = Page(pixels, self.format)

    def clear(self) -> None:
        """Make all voxels dark."""
        self.page, self._drawn, self._lit = None, DisplayList(), None

    @property
    def drawn(self) -> PixelMap:
        """Pixels of what was drawn, dark ones included, without the page below it."""
        return self._drawn.pixels

    @property
    def visible(self) -> DrawnVoxels | None:
        """Visible voxels, dark ones included, of what was drawn; None without any."""
        return self._drawn.visible

    @property
    def ordered(self) -> DrawnVoxels | None:
        """Visible voxels, dark ones included, of items that may have an order; None without any."""
        drawn = self._drawn.visible
        if drawn is None or not (drawn.kinds == Kind.SET).any():
            return drawn
        return drawn.select((drawn.kinds != Kind.SET)[drawn.item])

    def lit_parts(self) -> tuple[DrawnVoxels | None, NDArray[np.int64]]:
        """Return the lit voxels of `ordered`, and the indices, ascending, of all other lit ones."""
        ordered, index = self.ordered, self.lit.index
        if ordered is None:
            return None, index
        on = ordered.select(ordered.values != 0)
        if not self.page and ordered is self._drawn.visible:
            return on, index[:0]
        return on, index[without(index, on.index)]

    @property
    def lit(self) -> PixelMap:
        """Lit voxels."""
        if self._lit is None:
            drawn = self._drawn.pixels
            self._lit = (drawn.over(self.page.lit) if self.page else drawn).lit()
        return self._lit

    def at(self, index: NDArray[np.int64]) -> Values:
        """Return the pixel values, (n,), of voxels, (n,) in any order."""
        if self.page is None:
            return self._drawn.pixels.at(index)
        found = self.page.at(index)
        self._drawn.pixels.write_to(found, index)
        return found

    def pixels(self, *, writable: bool = True) -> Pixels:
        """Return all pixels in scan order, (V,) or (V, 3) for rgb888: a copy if writable."""
        drawn = self._drawn.pixels
        if self.page and not len(drawn) and not writable:
            return self.page.pixels
        if self.page is None:
            shape = self.format.shape((self.grid.voxels,))
            array: Pixels = np.zeros(shape, dtype=self.format.dtype)
        else:
            array = self.page.pixels.copy()
        array[drawn.index] = self.format.pixels(drawn.values)
        return array

    def differing(self, other: SparseRaster) -> NDArray[np.int64]:
        """Return the indices, ascending, of voxels that differ from another raster's."""
        if self.page is None or other.page is None:
            return self.lit.differing(other.lit)
        drawn = self._drawn.pixels.over(other.drawn).index
        there: NDArray[np.int64] = drawn[self.at(drawn) != other.at(drawn)]
        if self.page is other.page:
            return there
        below = np.flatnonzero(is_lit(self.page.pixels ^ other.page.pixels))
        return np.asarray(np.sort(np.concatenate((below[~contains(drawn, below)], there))))

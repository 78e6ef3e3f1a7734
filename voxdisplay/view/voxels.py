"""From a page, the array that a display's memory is, to its lit voxels and their colours.

Knows grids and pixel formats; nothing of pictures.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from voxdisplay.grid import Grid
from voxdisplay.pixel import PixelFormat


class Lit(NamedTuple):
    """Lit voxels, in scan order.

    Attributes
    ----------
    positions : (n, 3) uint16 array
        Columns x, y, z.
    colors : (n, 3) uint8 array
        sRGB: columns red, green, blue.

    """

    positions: NDArray[np.uint16]
    colors: NDArray[np.uint8]


def lit_voxels(page: NDArray[np.integer], grid: Grid, format: PixelFormat) -> Lit:  # noqa: A002 - the word of the command line
    """List what is lit.

    Parameters
    ----------
    page : ndarray
        What `Display.read` and `Frame.array` give, indexed [z, y, x].
    grid : Grid
    format : PixelFormat

    Returns
    -------
    Lit

    Raises
    ------
    ValueError
        If the page is not of this grid and format.

    """
    page = np.asarray(page)
    format.check(page, grid.array_shape)
    index = np.flatnonzero(_is_lit(page, format))
    flat = page.reshape(-1, 3) if format is PixelFormat.RGB888 else page.reshape(-1)
    colors = flat[index] if format is PixelFormat.RGB888 else format.rgb(flat[index])
    # Half the time of Grid.voxels_at: a display's sides are 16-bit, its voxels need not be.
    rest = index.astype(np.uint32) if grid.voxels < 1 << 32 else index
    positions = np.empty((len(index), 3), dtype=np.uint16)
    for column, side in enumerate(grid[:2]):
        above = rest // rest.dtype.type(side)
        positions[:, column] = rest - above * rest.dtype.type(side)
        rest = above
    positions[:, 2] = rest
    return Lit(positions, colors.astype(np.uint8, copy=False))


def _is_lit(page: NDArray[np.integer], format_: PixelFormat) -> NDArray[np.bool_]:
    """Tell which voxels are lit, flat. A comparison first: numpy finds True fastest."""
    if format_ is not PixelFormat.RGB888:
        return np.asarray(page.reshape(-1) != 0)
    red, green, blue = page.reshape(-1, 3).T.astype(np.uint8, copy=False)
    return np.asarray((red | green | blue) != 0)

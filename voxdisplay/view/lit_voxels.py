"""From a page, the array that a display's memory is, to its lit voxels and their colours.

Knows grids and pixel formats; nothing of pictures.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.grid import Grid
from voxdisplay.raster.palette import Colors
from voxdisplay.raster.pixel_format import PixelFormat

_BLOCK_PIXELS = 8  # pixels of 1, 2 or 3 bytes, which make whole words
_DENSE_RATIO = 8  # where more than one in so many has something, it does not pay to look twice


class LitVoxels(NamedTuple):
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


def lit_voxels(
    page: NDArray[np.integer],
    grid: Grid,
    format: PixelFormat,  # noqa: A002 - the word of the command line
    palette: Colors | None = None,
) -> LitVoxels:
    """List what is lit.

    Parameters
    ----------
    page : ndarray
        What `Display.read` and `Frame.array` give, indexed [z, y, x].
    grid : Grid
    format : PixelFormat
    palette : (256, 3) uint8 array, optional
        Of an index8 page; by default the default one.

    Returns
    -------
    Lit

    Raises
    ------
    ValueError
        If the page is not of this grid and format.

    """
    page = np.asarray(page)
    format.validate(page, grid.array_shape)
    flat = page.reshape(format.shape((grid.voxels,)))
    index, pixels = _nonzero_pixels(np.ascontiguousarray(flat))
    if format is PixelFormat.RGB888:
        colors = pixels
    else:
        colors = format.rgb(pixels) if palette is None else palette[pixels]
    # Half the time of Grid.voxels_at: a display's sides are 16-bit, its voxels need not be.
    rest = index.astype(np.uint32) if grid.voxels < 1 << 32 else index
    positions = np.empty((len(index), 3), dtype=np.uint16)
    for column, side in enumerate(grid[:2]):
        above = rest // rest.dtype.type(side)
        positions[:, column] = rest - above * rest.dtype.type(side)
        rest = above
    positions[:, 2] = rest
    return LitVoxels(positions, colors.astype(np.uint8, copy=False))


def _nonzero_pixels(flat: NDArray[np.integer]) -> tuple[NDArray[np.int64], NDArray[np.integer]]:
    """Find pixels that are not 0, and give where they are and what.

    Most of a volume is dark: looks at words first, eight bytes of eight pixels,
    and at the pixels only of those that are not 0.
    """
    whole = len(flat) // _BLOCK_PIXELS
    eights = flat[: whole * _BLOCK_PIXELS].reshape(whole, _BLOCK_PIXELS, *flat.shape[1:])
    words = eights.reshape(-1).view(np.uint64)
    something = words != 0
    if np.count_nonzero(something) > len(words) // _DENSE_RATIO:
        index = np.flatnonzero(_is_nonzero(flat))
        return index, flat[index]
    found = np.flatnonzero(something) // flat[:1].nbytes  # a pixel's bytes are an eight's words
    busy = found[np.diff(found, prepend=-1) != 0]
    # What fills no eight is looked at in any case.
    pixels = np.concatenate(
        (eights[busy].reshape(-1, *flat.shape[1:]), flat[whole * _BLOCK_PIXELS :])
    )
    at = np.flatnonzero(_is_nonzero(pixels))
    return np.append(busy, whole)[at // _BLOCK_PIXELS] * _BLOCK_PIXELS + at % _BLOCK_PIXELS, pixels[
        at
    ]


def _is_nonzero(pixels: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Tell which pixels are not 0. A comparison last: numpy finds True fastest."""
    if pixels.ndim > 1:
        red, green, blue = pixels.T
        pixels = red | green | blue
    return np.asarray(pixels != 0)

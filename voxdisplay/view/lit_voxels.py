"""Extraction of lit voxels and their colours from a page.

Knows grids and pixel formats; knows no picture.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.grid import Grid
from voxdisplay.raster.palette import Colors
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.raster.pixel_map import PixelMap

_BLOCK_PIXELS = 8  # of 1, 2 or 3 bytes each: they make whole 64-bit words
_DENSE_RATIO = 8  # with more than one nonzero word in so many, one pass is faster than two


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
    page: NDArray[np.integer] | PixelMap,
    grid: Grid,
    format: PixelFormat,  # noqa: A002 - as the option --format
    palette: Colors | None = None,
) -> LitVoxels:
    """Return the lit voxels of a page.

    Parameters
    ----------
    page : ndarray or PixelMap
        As from `Display.read` or `Frame.array`, indexed [z, y, x]; or the lit pixels alone.
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
    if isinstance(page, PixelMap):
        values = page.values
        shown = format.rgb(values) if palette is None else palette[values]
        return LitVoxels(grid.voxels_at(page.index).astype(np.uint16), shown)
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
    """Return the indices and values of the pixels that are not 0.

    Most of a volume is dark: blocks of eight pixels are tested as 64-bit words first, and single
    pixels only in blocks that are not 0.
    """
    whole = len(flat) // _BLOCK_PIXELS
    eights = flat[: whole * _BLOCK_PIXELS].reshape(whole, _BLOCK_PIXELS, *flat.shape[1:])
    words = eights.reshape(-1).view(np.uint64)
    something = words != 0
    if np.count_nonzero(something) > len(words) // _DENSE_RATIO:
        index = np.flatnonzero(_is_nonzero(flat))
        return index, flat[index]
    found = (
        np.flatnonzero(something) // flat[:1].nbytes
    )  # a pixel has as many bytes as a block words
    busy = found[np.diff(found, prepend=-1) != 0]
    # Pixels after the last whole block are tested in any case.
    pixels = np.concatenate(
        (eights[busy].reshape(-1, *flat.shape[1:]), flat[whole * _BLOCK_PIXELS :])
    )
    at = np.flatnonzero(_is_nonzero(pixels))
    return np.append(busy, whole)[at // _BLOCK_PIXELS] * _BLOCK_PIXELS + at % _BLOCK_PIXELS, pixels[
        at
    ]


def _is_nonzero(pixels: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Return the mask of pixels that are not 0, as bool: `flatnonzero` is fastest on that."""
    if pixels.ndim > 1:
        red, green, blue = pixels.T
        pixels = red | green | blue
    return np.asarray(pixels != 0)

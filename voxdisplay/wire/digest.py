"""Digest of a page (protocol.md, section 8), vectorised over voxels.

Must not know frames or ops.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.pixel_format import PixelFormat, Pixels, Values, is_lit
from voxdisplay.raster.sparse_raster import SparseRaster
from voxdisplay.wire import spec

# Added to a palette entry's colour, so that it differs from every pixel value.
_COLOR = 0x1000000
_BLOCK = 1 << 15  # voxels per block: intermediate arrays stay in a core's cache


def digest(index: NDArray[np.integer], values: NDArray[np.integer]) -> int:
    """Return the digest of a page with the default palette.

    Parameters
    ----------
    index : (n,) integer array
        Scan-order indices of voxels, each once.
    values : (n,) integer array
        Their pixel values; dark ones, 0, add nothing.

    Returns
    -------
    int
        0 <= digest < 2**32; 0 for a dark page.

    """
    index, values = np.asarray(index), np.asarray(values)
    index, values = index[values != 0], values[values != 0]
    blocks = (slice(low, low + _BLOCK) for low in range(0, len(values), _BLOCK))
    found = sum(_block_digest(index[block].astype(np.uint32), values[block]) for block in blocks)
    return found & 0xFFFFFFFF


def page_digest(page: Pixels, format_: PixelFormat) -> int:
    """Return the digest of a whole page as it lies in the display's memory.

    Parameters
    ----------
    page : ndarray
        In scan order: (V,), or (V, 3) for rgb888.
    format_ : PixelFormat

    """
    found = 0
    for low in range(0, len(page), _BLOCK):
        pixels = page[low : low + _BLOCK]
        on = is_lit(pixels)
        index = np.arange(low, low + len(on), dtype=np.uint32)
        if not on.all():
            index, pixels = index[on], pixels[on]
        found += _block_digest(index, format_.values(pixels))
    return found & 0xFFFFFFFF


def raster_digest(raster: SparseRaster) -> int:
    """Return the digest of a frame with the default palette.

    Parameters
    ----------
    raster : SparseRaster
        Its pixels.

    """
    page, drawn = raster.page, raster.drawn
    if page is None:
        return digest(drawn.index, drawn.values)
    # In a page, much may be lit; a digest is a sum, to which what was drawn is added.
    below = digest(drawn.index, page.at(drawn.index))
    whole = page_digest(page.pixels, raster.format)
    return (whole - below + digest(drawn.index, drawn.values)) & 0xFFFFFFFF


def _block_digest(index: Values, values: NDArray[np.integer]) -> int:
    """Return the contribution of lit voxels, modulo 2**32."""
    h = index * np.uint32(spec.DIGEST_MUL_INDEX)
    part = values.astype(np.uint32)
    part *= np.uint32(spec.DIGEST_MUL_VALUE)
    h += part
    h ^= np.right_shift(h, np.uint32(spec.DIGEST_SHIFT_1), out=part)
    h *= np.uint32(spec.DIGEST_MUL_1)
    h ^= np.right_shift(h, np.uint32(spec.DIGEST_SHIFT_2), out=part)
    h *= np.uint32(spec.DIGEST_MUL_2)
    h ^= np.right_shift(h, np.uint32(spec.DIGEST_SHIFT_3), out=part)
    return int(h.sum(dtype=np.uint32))


def palette_digest(voxels: int, entries: NDArray[np.integer], colors: NDArray[np.integer]) -> int:
    """Return the contribution of a palette to the digest of its page.

    Parameters
    ----------
    voxels : int
        Voxels of the page.
    entries : (n,) integer array
        Entries that differ from the default palette.
    colors : (n, 3) integer array
        Their red, green and blue.

    """
    red, green, blue = np.asarray(colors, dtype=np.int64).reshape(-1, 3).T
    return digest(np.asarray(entries) + voxels, _COLOR + red + (green << 8) + (blue << 16))

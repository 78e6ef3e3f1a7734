"""The digest of a page (protocol.md, section 8), for whole sets of voxels at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.wire import spec

# What sets the value of a colour apart from that of a pixel.
_COLOR = 0x1000000


def digest(index: NDArray[np.integer], values: NDArray[np.integer]) -> int:
    """Give the digest of a page with the default palette.

    Parameters
    ----------
    index : (n,) integer array
        Scan-order indices of the voxels that may be lit, each once.
    values : (n,) integer array
        Their pixel values; those that are 0 do not count.

    Returns
    -------
    int
        0 <= digest < 2**32; 0 for a dark page.

    """
    value = np.asarray(values).astype(np.uint32)
    lit = value != 0
    h = np.asarray(index).astype(np.uint32) * np.uint32(spec.DIGEST_MUL_INDEX)
    h += value * np.uint32(spec.DIGEST_MUL_VALUE)
    h ^= h >> np.uint32(spec.DIGEST_SHIFT_1)
    h *= np.uint32(spec.DIGEST_MUL_1)
    h ^= h >> np.uint32(spec.DIGEST_SHIFT_2)
    h *= np.uint32(spec.DIGEST_MUL_2)
    h ^= h >> np.uint32(spec.DIGEST_SHIFT_3)
    return int(h[lit].sum(dtype=np.uint64)) & 0xFFFFFFFF


def palette_digest(voxels: int, entries: NDArray[np.integer], colors: NDArray[np.integer]) -> int:
    """Give what a palette adds to the digest of its page.

    Parameters
    ----------
    voxels : int
        Voxels of the page.
    entries : (n,) integer array
        The entries that are not those of the default palette.
    colors : (n, 3) integer array
        Their red, green and blue.

    """
    red, green, blue = np.asarray(colors, dtype=np.int64).reshape(-1, 3).T
    return digest(np.asarray(entries) + voxels, _COLOR + red + (green << 8) + (blue << 16))

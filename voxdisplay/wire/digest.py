"""The digest of a page (protocol.md, section 8), for whole sets of voxels at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.wire import spec


def digest(index: NDArray[np.integer], values: NDArray[np.integer]) -> int:
    """Give the digest of a page.

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

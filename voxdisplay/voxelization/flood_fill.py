"""Flood fill of the voxels outside of a set: what a shell encloses. Must not know bodies."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Bools, Ints

MAX_VOXELS = 1 << 28
"""Largest bounding box that is filled."""


def count_enclosed(voxels: NDArray[np.integer]) -> int | None:
    """Return how many voxels a set cuts off from outside: no 6-connected path leads there.

    Parameters
    ----------
    voxels : (N, 3) integer array

    Returns
    -------
    int or None
        None if the bounding box has more than `MAX_VOXELS` voxels.

    """
    if not len(voxels):
        return 0
    low = voxels.min(axis=0).astype(np.int64) - 1
    sides: Ints = voxels.max(axis=0) - low + 2
    if sides.prod() > MAX_VOXELS:
        return None
    dark = np.ones(sides[::-1], dtype=bool)
    x, y, z = (voxels - low).T
    dark[z, y, x] = False
    reached = np.zeros_like(dark)
    reached[0, 0, 0] = True  # of the margin, which is dark
    count = 0
    while True:
        for axis in range(3):
            _sweep(np.moveaxis(reached, axis, 0), np.moveaxis(dark, axis, 0))
        grown = int(np.count_nonzero(reached))
        if grown == count:
            return int(np.count_nonzero(dark)) - count
        count = grown


def _sweep(reached: Bools, dark: Bools) -> None:
    """Spread what is reached along the first axis, forwards and backwards."""
    for order in (range(1, len(dark)), range(len(dark) - 2, -1, -1)):
        step = -1 if order.step > 0 else 1
        for k in order:
            reached[k] |= reached[k + step] & dark[k]

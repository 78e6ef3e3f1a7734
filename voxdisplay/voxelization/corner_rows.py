"""Corners of a curve among its voxels. It must not know what is done with them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from voxdisplay.voxelization.index_ranges import distinct

if TYPE_CHECKING:
    from voxdisplay.voxelization.sequence import Sequence


def corner_rows(sequence: Sequence) -> NDArray[np.int64]:
    """Return the rows, ascending, of the voxels nearest to the breaks of a curve."""
    breaks = sequence.curve.breaks
    if not len(breaks) or len(sequence) < 2:
        return np.empty(0, dtype=np.int64)
    behind = np.searchsorted(sequence.t, breaks).clip(1, len(sequence) - 1)
    before = np.abs(sequence.t[behind - 1] - breaks) <= np.abs(sequence.t[behind] - breaks)
    return distinct(behind - before)

"""Kernel of `index_ranges`: insertion of columns into arrays.

It holds no state: several threads may run them at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Ints
from voxdisplay.compute.kernel_backend import jit
from voxdisplay.voxelization.index_ranges import Arrays
from voxdisplay.voxelization.kernels.contiguous import packed


def insert_columns(at: Ints, arrays: Arrays, fresh: Arrays) -> Arrays:
    """See `index_ranges.insert_columns`."""
    merged = []
    for array, other in zip(arrays, fresh, strict=True):
        both = _insert_columns(at, *(packed(np.atleast_2d(each)) for each in (array, other)))
        merged.append(both if array.ndim > 1 else both[0])
    return tuple(merged)


@jit
def _insert_columns(at: Ints, array: NDArray[Any], fresh: NDArray[Any]) -> NDArray[Any]:
    rows, size = array.shape
    both = np.empty((rows, size + at.size), dtype=array.dtype)
    for row in range(rows):
        old, new = array[row], both[row]
        begin = 0
        for nth in range(at.size):
            for k in range(begin, at[nth]):
                new[k + nth] = old[k]
            begin = at[nth]
            new[begin + nth] = fresh[row, nth]
        for k in range(begin, size):
            new[k + at.size] = old[k]
    return both

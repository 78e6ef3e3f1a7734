"""Index arithmetic for arrays that hold many ranges, one after the other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Ints
from voxdisplay.compute.kernel_backend import with_kernel

Arrays = tuple[NDArray[Any], ...]


def expand_ranges(low: Ints, count: Ints) -> Ints:
    """Return the numbers of ranges: low, low + 1, ... ``count`` of them for each."""
    end: Ints = count.cumsum()
    total = int(end[-1]) if end.size else 0
    return np.asarray((low - (end - count)).repeat(count) + np.arange(total))


def distinct(numbers: Ints) -> Ints:
    """Return the distinct ones of whole numbers, ascending.

    Since numpy 2.3, np.unique hashes them, which takes many times longer, and imports numpy.ma.
    """
    ordered = np.sort(numbers)
    is_new = np.ones(ordered.size, dtype=np.bool_)
    is_new[1:] = ordered[1:] != ordered[:-1]
    return np.asarray(ordered[is_new])


def split_blocks(starts: Ints, stop: int, size: int) -> Iterator[tuple[int, int]]:
    """Yield blocks [begin, end) of about ``size`` that make up [0, stop).

    Cuts are made at ``starts``, where curves begin, and at multiples of ``size`` from there, so
    that a curve is cut in the same places whatever comes before it.
    """
    edges = np.append(starts, stop)
    begin = 0
    while begin < stop:
        end = int(edges[np.searchsorted(edges, begin + size, side="right") - 1])
        end = end if end > begin else begin + size
        yield begin, end
        begin = end


@with_kernel
def insert_columns(at: Ints, arrays: Arrays, fresh: Arrays) -> Arrays:
    """Insert columns into arrays, (M,) or (3, M), before those at the ascending indices ``at``."""
    size = arrays[0].shape[-1]
    old = np.ones(size + at.size, dtype=bool)
    new = at + np.arange(at.size)
    old[new] = False
    order = np.cumsum(old) - 1  # columns of the array, then of what is fresh
    order[new] = np.arange(size, old.size)
    return tuple(
        np.concatenate((array, other), axis=-1).take(order, axis=-1)
        for array, other in zip(arrays, fresh, strict=True)
    )

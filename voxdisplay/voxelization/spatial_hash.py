"""Spatial hash of points in cubic cells, for neighbourhood queries.

This module must not know voxels or curves.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Ints
from voxdisplay.voxelization.index_ranges import expand_ranges

# Pairs worked on at once: this bounds the memory of a search.
PAIRS_PER_BLOCK = 1 << 17

# Offsets (dx, dy) of the columns of cells around a cell; the first five with no pair twice.
COLUMNS = ((0, 0), (0, 1), (1, -1), (1, 0), (1, 1), (0, -1), (-1, 1), (-1, 0), (-1, -1))


class SpatialHash:
    """Items sorted by the cell they are in.

    Parameters
    ----------
    cells : (3, n) integer array
        Rows x, y, z: the cell of each item. Differences must stay below 2^31.

    """

    def __init__(self, cells: NDArray[np.integer]) -> None:
        wide = cells.astype(np.int64)
        self._origin = wide.min(axis=1, initial=2**40)[:, None]
        wide -= self._origin
        self._top = int(wide[2].max(initial=0))
        # Columns (x, y) get numbers, so that a number and z fit into one 64-bit key.
        self._columns, number = np.unique(_column(wide[0], wide[1]), return_inverse=True)
        key = (number.reshape(-1) << 32) + wide[2]
        self.order: Ints = np.argsort(key, kind="stable")
        self._keys = key[self.order]

    def column_ranges(
        self, cells: NDArray[np.integer], offset: tuple[int, int]
    ) -> tuple[Ints, Ints]:
        """Return the items near cells, (3, n), in one column.

        Returns
        -------
        low, high : (n,) int64 arrays
            ``order[low:high]`` are the items at (x + dx, y + dy) and z - 1 ... z + 1.

        """
        x, y, z = cells.astype(np.int64) - self._origin
        wanted = _column(x + offset[0], y + offset[1])
        number = np.searchsorted(self._columns, wanted)
        number = np.minimum(number, self._columns.size - 1)
        base = number << 32
        low = np.searchsorted(self._keys, base + np.clip(z - 1, 0, self._top + 1))
        high = np.searchsorted(self._keys, base + np.clip(z + 1, -1, self._top), side="right")
        known = self._columns[number] == wanted
        return np.where(known, low, 0), np.where(known, np.maximum(high, low), 0)

    def neighbours(self, cells: NDArray[np.integer]) -> Iterator[tuple[Ints, Ints]]:
        """Yield cells, (3, n), with the items in the 27 cells around each.

        Yields
        ------
        of, item : (k,) int64 arrays
            Indices of cells, ascending, and of items. All pairs of a cell come together.

        """
        ranges = [self.column_ranges(cells, offset) for offset in COLUMNS]
        low = np.stack([low for low, _ in ranges], axis=1)
        count = np.stack([high for _, high in ranges], axis=1) - low
        total = np.cumsum(count.sum(axis=1))
        start = 0
        while start < total.size:
            done = int(total[start - 1]) if start else 0
            stop = max(int(np.searchsorted(total, done + PAIRS_PER_BLOCK, side="right")), start + 1)
            flat = count[start:stop].reshape(-1)
            of = np.repeat(np.arange(start, stop), count[start:stop].sum(axis=1))
            yield of, self.order[expand_ranges(low[start:stop].reshape(-1), flat)]
            start = stop


def _column(x: Ints, y: Ints) -> Ints:
    return (x << 32) + y

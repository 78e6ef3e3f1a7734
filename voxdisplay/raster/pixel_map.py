"""Sparse map from scan-order indices to pixel values: two arrays, sorted by index.

Must not know grids, drawing order or colours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.pixel_format import Values


@dataclass(frozen=True, eq=False)
class PixelMap:
    """Pixel values of some voxels.

    Attributes
    ----------
    index : (n,) int64 array
        Scan-order indices, ascending, each once.
    values : (n,) uint32 array
        Their pixel values.

    """

    index: NDArray[np.int64]
    values: Values

    def __len__(self) -> int:
        return len(self.index)

    def lit(self) -> PixelMap:
        """Return the voxels whose values are not 0."""
        on = self.values != 0
        return self if on.all() else PixelMap(self.index[on], self.values[on])

    def write_to(self, found: Values, at: NDArray[np.int64]) -> None:
        """Write the pixel values of some voxels over those of others.

        Parameters
        ----------
        found : (m,) uint32 array
            Receives the values of the voxels of the map; the rest remains.
        at : (m,) int64 array
            Scan-order indices, in any order.

        """
        if not len(self) or not len(at):
            return
        if len(at) > len(self) and (at[1:] > at[:-1]).all():
            # Look the fewer up among the more.
            row = np.searchsorted(at, self.index)
            row[row == len(at)] = 0
            there = at[row] == self.index
            found[row[there]] = self.values[there]
            return
        row = np.searchsorted(self.index, at)
        row[row == len(self)] = 0
        there = self.index[row] == at
        found[there] = self.values[row[there]]

    def at(self, index: NDArray[np.int64]) -> Values:
        """Return the pixel values, (m,), of voxels, (m,); 0 for those that the map lacks."""
        if index is self.index:
            return self.values
        found = np.zeros(len(index), dtype=np.uint32)
        self.write_to(found, index)
        return found

    def over(self, below: PixelMap) -> PixelMap:
        """Return the map of all voxels of both, with the values of this where both have one."""
        if not len(self):
            return below
        if not len(below):
            return self
        rest = without(below.index, self.index)
        index = np.concatenate((self.index, below.index[rest]))
        values = np.concatenate((self.values, below.values[rest]))
        order = np.argsort(index, kind="stable")
        return PixelMap(index[order], values[order])

    def differing(self, other: PixelMap) -> NDArray[np.int64]:
        """Return the indices, ascending, of voxels with another value in another map.

        A voxel that a map lacks counts as 0 there.
        """
        if self.index is other.index and self.values is other.values:
            return self.index[:0]
        mine: NDArray[np.int64] = self.index[self.values != other.at(self.index)]
        theirs = ~contains(self.index, other.index) & (other.values != 0)
        if not theirs.any():
            return mine
        return np.asarray(np.sort(np.concatenate((mine, other.index[theirs]))))


def contains(index: NDArray[np.int64], wanted: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which of some indices, (m,) in any order, are among others, (n,) ascending: (m,)."""
    if not len(index):
        return np.zeros(len(wanted), dtype=np.bool_)
    row = np.searchsorted(index, wanted)
    row[row == len(index)] = 0
    return np.asarray(index[row] == wanted)


def without(index: NDArray[np.int64], left_out: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which of some indices, (n,) ascending, are not among others, (m,): (n,)."""
    kept = np.ones(len(index), dtype=np.bool_)
    if len(index):
        row = np.searchsorted(index, left_out)
        row[row == len(index)] = 0
        kept[row[index[row] == left_out]] = False
    return kept


EMPTY = PixelMap(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.uint32))

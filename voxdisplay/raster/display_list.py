"""Display list of a frame: drawn voxels in drawing order, and which of them are visible.

Painter's algorithm: a later item covers an earlier one. Must not know curves, colours or encodings.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.pixel_format import Values


@dataclass(frozen=True)
class OrderedVoxels:
    """Voxels on the grid in drawing order, of one item or of several, one after another.

    Attributes
    ----------
    voxels : (n, 3) integer array
        Columns x, y, z.
    index : (n,) int64 array
        Their scan-order indices.
    values : (n,) integer array
        Their pixel values.
    item : (n,) int64 array
        Number of the item of each, ascending.
    corners : (n,) bool array
        True where a straight line may end and another begin.

    """

    voxels: NDArray[np.integer]
    index: NDArray[np.int64]
    values: NDArray[np.integer]
    item: NDArray[np.int64]
    corners: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.values)

    def select(self, kept: NDArray[np.bool_]) -> OrderedVoxels:
        """Return the voxels where a mask, (n,), is set."""
        if kept.all():
            return self
        return OrderedVoxels(*(getattr(self, field.name)[kept] for field in fields(self)))


def concatenate_ordered(parts: Sequence[OrderedVoxels]) -> OrderedVoxels:
    """Return the voxels of all parts, at least one, with their items renumbered."""
    if len(parts) == 1:
        return parts[0]
    voxels, index, values, _, corners = (
        np.concatenate([getattr(part, field.name) for part in parts])
        for field in fields(OrderedVoxels)
    )
    # Parts that were concatenated before have several items, numbered from 0.
    ordered = [int(part.item[-1]) + 1 if len(part) else 0 for part in parts]
    first = np.cumsum(ordered) - ordered
    owner = np.concatenate([part.item + n for part, n in zip(parts, first, strict=True)])
    return OrderedVoxels(voxels, index, values, owner, corners)


class DisplayList:
    """Drawn items, whose covered voxels are removed on request."""

    def __init__(self) -> None:
        self._items: list[OrderedVoxels] = []
        self._all_visible = True  # no voxel is covered by a later item

    def __len__(self) -> int:
        return sum(map(len, self._items))

    def copy(self) -> DisplayList:
        """Return another list of the same items."""
        twin = DisplayList()
        twin._items, twin._all_visible = list(self._items), self._all_visible
        return twin

    def append(self, item: OrderedVoxels) -> None:
        """Draw an item over all others."""
        self._items.append(item)
        self._all_visible = False

    def indices(self) -> NDArray[np.int64]:
        """Return the scan-order indices of all drawn voxels, ascending, each once."""
        if not self._items:
            return np.empty(0, dtype=np.int64)
        index = np.sort(np.concatenate([item.index for item in self._items]))
        return np.asarray(index[np.concatenate((index[:1] >= 0, index[1:] != index[:-1]))])

    def visible(self, values_at: Callable[[NDArray[np.int64]], Values]) -> OrderedVoxels | None:
        """Return the voxels that no later item covers; None if nothing was drawn.

        Parameters
        ----------
        values_at : callable
            Function from indices to the pixel values of the raster.

        """
        if not self._items:
            return None
        if not self._all_visible:
            drawn = concatenate_ordered(self._items)
            # A covered voxel never shows again: a newer item would have drawn it.
            self._items = [drawn.select(values_at(drawn.index) == drawn.values)]
            self._all_visible = True
        return self._items[0]

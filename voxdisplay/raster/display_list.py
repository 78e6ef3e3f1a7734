"""Display list of a frame: drawn voxels in drawing order, and which of them are visible.

Painter's algorithm: a later item covers an earlier one. Costs what was drawn, whatever the grid.
Must not know curves, colours or encodings.
"""

from __future__ import annotations

import enum
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.pixel_map import EMPTY, PixelMap

_BLOCK_ROWS = 1 << 18
_ROW_BITS = 32  # of a sort key: an index and a row fit one int64 together


class Kind(enum.IntEnum):
    """Order of an item's voxels.

    Attributes
    ----------
    CURVE
        They follow a curve: most are neighbours of the one before.
    ARRAY
        They stand in the order of somebody's array, which may follow a curve or not.
    SET
        They have no order.

    """

    CURVE = 0
    ARRAY = 1
    SET = 2


@dataclass(frozen=True, eq=False)
class Spread:
    """Colours spread along a curve: each of its voxels has their blend at its place.

    Attributes
    ----------
    stops : (k, 3) uint8 array
        The colours; for INDEX8 (k, 1), pixel values.
    count : int
        Number of places: voxels of the whole curve.
    first : int
        Place of the first voxel of the stretch that is drawn.

    """

    stops: NDArray[np.uint8]
    count: int
    first: int = 0

    def from_place(self, first: int) -> Spread:
        """Return the same spread for a stretch that begins at another place."""
        return replace(self, first=first)


@dataclass(frozen=True)
class DrawnVoxels:
    """Voxels on the grid in drawing order, of one item or of several, one after another.

    Attributes
    ----------
    index : (n,) int64 array
        Their scan-order indices.
    values : (n,) uint32 array
        Their pixel values.
    item : (n,) int32 array
        Number of the item of each, ascending.
    corners : (n,) bool array
        True where a straight line may end and another begin.
    kinds : (items,) int8 array
        `Kind` of each item.
    places : (n,) int32 array or None
        Place of each voxel in the spread of its item; None if no item has one.
    spreads : tuple of Spread or None
        Spread of each item, None for those without; empty if no item has one.

    """

    index: NDArray[np.int64]
    values: NDArray[np.uint32]
    item: NDArray[np.int32]
    corners: NDArray[np.bool_]
    kinds: NDArray[np.int8]
    places: NDArray[np.int32] | None = None
    spreads: tuple[Spread | None, ...] = ()

    @classmethod
    def of_item(
        cls,
        index: NDArray[np.int64],
        values: NDArray[np.uint32],
        corners: NDArray[np.bool_],
        kind: Kind,
        spread: Spread | None = None,
    ) -> DrawnVoxels:
        """Return the voxels of one item; with a spread, all of its places."""
        item = np.zeros(len(index), dtype=np.int32)
        drawn = cls(index, values, item, corners, np.array([kind], dtype=np.int8))
        if spread is None:
            return drawn
        places = np.arange(spread.first, spread.first + len(index), dtype=np.int32)
        return replace(drawn, places=places, spreads=(spread,))

    def __len__(self) -> int:
        return len(self.values)

    def part(self, begin: int, end: int) -> DrawnVoxels:
        """Return the voxels of some consecutive rows; items keep their numbers."""
        return self._taken(slice(begin, end))

    def select(self, kept: NDArray[np.bool_]) -> DrawnVoxels:
        """Return the voxels where a mask, (n,), is set; items keep their numbers."""
        if kept.all():
            return self
        return self._taken(kept)

    def _taken(self, rows: slice | NDArray[np.bool_]) -> DrawnVoxels:
        return replace(
            self,
            index=self.index[rows],
            values=self.values[rows],
            item=self.item[rows],
            corners=self.corners[rows],
            places=None if self.places is None else self.places[rows],
        )

    def recolored(self, values: NDArray[np.uint32]) -> DrawnVoxels:
        """Return the voxels with other pixel values, (n,), which no spread has."""
        return replace(self, values=values, places=None, spreads=())


def concatenate_drawn(parts: Sequence[DrawnVoxels]) -> DrawnVoxels:
    """Return the voxels of all parts, at least one, with their items renumbered."""
    if len(parts) == 1:
        return parts[0]
    arrays: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts]) for name in _ARRAYS
    }
    places, spreads = _concatenated_spreads(parts)
    together = DrawnVoxels(**arrays, places=places, spreads=spreads)
    items = [len(part.kinds) for part in parts]
    first = np.cumsum(items, dtype=np.int32) - np.array(items, dtype=np.int32)
    return replace(together, item=together.item + np.repeat(first, [len(part) for part in parts]))


class DisplayList:
    """Drawn items, whose covered voxels are removed on request."""

    def __init__(self) -> None:
        self._items: list[DrawnVoxels] = []
        self._pixels = EMPTY
        self._resolved = True  # no voxel is covered by a later item, and `_pixels` is theirs

    def __len__(self) -> int:
        return sum(map(len, self._items))

    def copy(self) -> DisplayList:
        """Return another list of the same items; what was resolved is shared."""
        twin = DisplayList()
        twin._items, twin._pixels, twin._resolved = list(self._items), self._pixels, self._resolved
        return twin

    def append(self, item: DrawnVoxels) -> None:
        """Draw an item over all others."""
        if len(item):
            self._items.append(item)
            self._resolved = False

    @property
    def pixels(self) -> PixelMap:
        """Pixel values of all drawn voxels, dark ones included."""
        self._resolve()
        return self._pixels

    @property
    def visible(self) -> DrawnVoxels | None:
        """Drawn voxels that no later item covers; None if nothing was drawn.

        A voxel that was drawn several times with its final value remains in each of the items.
        """
        self._resolve()
        return self._items[0] if self._items else None

    def _resolve(self) -> None:
        if self._resolved:
            return
        drawn = concatenate_drawn(self._items)
        self._items = [drawn]  # the same picture; the parts need no memory any more
        index, values = drawn.index, drawn.values
        if not (index[1:] > index[:-1]).all():
            key = index << _ROW_BITS
            for rows in _blocks(len(key)):
                key[rows] |= np.arange(rows.start, rows.start + len(key[rows]))
            key.sort()  # faster than argsort
            row = key.astype(np.uint32)  # the lower half
            key >>= _ROW_BITS
            index, values = key, np.empty_like(values)
            for rows in _blocks(len(row)):
                values[rows] = drawn.values[row[rows]]
            last = np.append(index[1:] != index[:-1], True)
            if not last.all():
                # A covered voxel never shows again: a newer item would have drawn it.
                final = values[last]
                visible = np.empty(len(row), dtype=np.bool_)
                before = 0
                for rows in _blocks(len(row)):
                    ends = last[rows]
                    nth = np.cumsum(ends) - ends + before
                    visible[row[rows]] = values[rows] == final[nth]
                    before += int(np.count_nonzero(ends))
                index, values = index[last], final
                del key, row
                drawn = drawn.select(visible)
        self._items = [drawn]
        self._pixels = PixelMap(index, values)
        self._resolved = True


def _blocks(size: int) -> Iterator[slice]:
    """Yield slices that make up so many rows, so that temporary arrays are small."""
    for low in range(0, size, _BLOCK_ROWS):
        yield slice(low, low + _BLOCK_ROWS)


def _concatenated_spreads(
    parts: Sequence[DrawnVoxels],
) -> tuple[NDArray[np.int32] | None, tuple[Spread | None, ...]]:
    """Return places and spreads of all parts, one after another."""
    if all(part.places is None for part in parts):
        return None, ()
    places = [
        np.zeros(len(part), dtype=np.int32) if part.places is None else part.places
        for part in parts
    ]
    spreads = [part.spreads or (None,) * len(part.kinds) for part in parts]
    return np.concatenate(places), tuple(chain.from_iterable(spreads))


_ARRAYS = ("index", "values", "item", "corners", "kinds")

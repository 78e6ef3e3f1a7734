"""Sets of lit voxels while they are found: a mask of a small box, bricks of a large one.

Must not know what lights them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Bools, Ints
from voxdisplay.voxelization.voxel_box import Triple

MAX_DENSE = 1 << 25
"""Boxes of more voxels are kept in bricks, of which only those with lit voxels take memory."""
_MAX_BRICKS = 1 << 24


class LitMask:
    """Lit voxels of a box, as one mask over it.

    Parameters
    ----------
    sides : (int, int, int)
        Numbers of voxels along x, y and z.

    """

    _mask: Bools

    def __init__(self, sides: Triple) -> None:
        self.sides = sides
        self._strides = (1, sides[0], sides[0] * sides[1])
        self._mask = np.zeros(sides[0] * sides[1] * sides[2], dtype=bool)

    def locate(self, axis: int, i: Ints, j: Ints, level: Ints) -> Ints:
        """Return places of voxels, all in the box: i, j along the two axes after `axis`."""
        place = level * self._strides[axis]
        place += i * self._strides[(axis + 1) % 3]
        place += j * self._strides[(axis + 2) % 3]
        return place

    def mark(self, place: Ints) -> None:
        """Light voxels."""
        self._mask[place] = True

    def lit(self, place: Ints) -> Bools:
        """Return which places are lit."""
        return self._mask.take(place)

    def storage(self) -> tuple[int, Ints, NDArray[np.int32], Bools]:
        """Return digits of a brick's side, bricks along each axis, their rows, and what is lit."""
        return 0, np.ones(3, dtype=np.int64), np.zeros(1, dtype=np.int32), self._mask

    def scan_index(self, place: Ints) -> Ints:
        """Return the scan-order indices of places."""
        return place

    def index(self) -> Ints:
        """Return the scan-order indices of lit voxels, ascending."""
        return np.flatnonzero(self._mask)


class LitBricks(LitMask):
    """Lit voxels of a large box, in cubes that are stored where something is lit."""

    def __init__(self, sides: Triple) -> None:
        self.sides = sides
        self._digits = 3
        while self._bricks_of(self._digits) > _MAX_BRICKS:
            self._digits += 1
        side = 1 << self._digits
        self._cells = tuple(-(-each // side) for each in sides)
        self._stored = np.full(self._bricks_of(self._digits), -1, dtype=np.int32)
        self._mask = np.zeros((0, side**3), dtype=np.bool_)
        self._bricks: list[NDArray[np.int64]] = []
        self._count = 0

    def _bricks_of(self, digits: int) -> int:
        nx, ny, nz = (-(-side >> digits) for side in self.sides)
        return nx * ny * nz

    def locate(self, axis: int, i: Ints, j: Ints, level: Ints) -> Ints:
        """Return places of voxels: number of the brick, then the place inside of it."""
        digits, low = self._digits, (1 << self._digits) - 1
        nx, ny, _ = self._cells
        strides = (1, nx, nx * ny)
        place = np.zeros(len(level), dtype=np.int64)
        for number, each in ((axis, level), ((axis + 1) % 3, i), ((axis + 2) % 3, j)):
            place += ((each >> digits) * strides[number]) << (3 * digits)
            place += (each & low) << (number * digits)
        return place

    def mark(self, place: Ints) -> None:
        """Light voxels."""
        brick, inner = self._split(place)
        stored = self._stored.take(brick)
        if (stored < 0).any():
            self._store(brick[stored < 0])
            stored = self._stored.take(brick)
        self._mask[stored, inner] = True

    def storage(self) -> tuple[int, Ints, NDArray[np.int32], Bools]:
        """Return digits of a brick's side, bricks along each axis, their rows, and what is lit."""
        cells = np.array(self._cells, dtype=np.int64)
        return self._digits, cells, self._stored, self._mask.reshape(-1)

    def _split(self, place: Ints) -> tuple[Ints, Ints]:
        digits = 3 * self._digits
        return place >> digits, place & ((1 << digits) - 1)

    def _store(self, bricks: Ints) -> None:
        """Make room for bricks, which may be named several times."""
        bricks = np.sort(bricks)
        fresh = bricks[np.append(True, bricks[1:] != bricks[:-1])]
        need = self._count + len(fresh)
        if need > len(self._mask):
            side = 1 << self._digits
            grown = np.zeros((max(need, 2 * len(self._mask)), side**3), dtype=np.bool_)
            grown[: self._count] = self._mask[: self._count]
            self._mask = grown
        self._stored[fresh] = np.arange(self._count, need)
        self._bricks.append(fresh)
        self._count = need

    def lit(self, place: Ints) -> Bools:
        """Return which places are lit."""
        brick, inner = self._split(place)
        stored = self._stored.take(brick)
        if not self._count:
            return np.zeros(len(place), dtype=bool)
        # Row -1, of bricks that are not stored, is some other brick.
        return np.asarray(self._mask[stored, inner] & (stored >= 0))

    def index(self) -> Ints:
        """Return the scan-order indices of lit voxels, ascending."""
        found = np.flatnonzero(self._mask[: self._count])
        row, inner = self._split(found)
        brick = np.concatenate([*self._bricks, np.empty(0, dtype=np.int64)])[row]
        index = self.scan_index((brick << (3 * self._digits)) + inner)
        index.sort()
        return index

    def scan_index(self, place: Ints) -> Ints:
        """Return the scan-order indices of places."""
        digits, low = self._digits, (1 << self._digits) - 1
        nx, ny, _ = self._cells
        brick, inner = self._split(place)
        rest = brick // nx
        z = rest // ny
        x = ((brick - rest * nx) << digits) + (inner & low)
        y = ((rest - z * ny) << digits) + ((inner >> digits) & low)
        z = (z << digits) + (inner >> (2 * digits))
        return np.asarray(x + self.sides[0] * (y + self.sides[1] * z))


def lit_mask(sides: Triple) -> LitMask:
    """Return an empty set of voxels of a box."""
    size = sides[0] * sides[1] * sides[2]
    return LitMask(sides) if size <= MAX_DENSE else LitBricks(sides)

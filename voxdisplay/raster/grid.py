"""Voxel grid of a display: sizes, scan order, and the change from (x, y, z) to ``[z, y, x]``.

Only this module and `frame` change the order of axes. Must not know curves or colours.
"""

from __future__ import annotations

import math
import re
import reprlib
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from voxdisplay.argument_checks import instance, wrong_kind
from voxdisplay.wire import spec


class Grid(NamedTuple):
    """Size of a display in voxels: nx x ny x nz.

    Voxel (x, y, z) is the cube [x, x+1) x [y, y+1) x [z, z+1); arrays over a grid are indexed
    ``[z, y, x]``, so that a flat array runs along x fastest, which is scan order on the wire
    (protocol.md, section 2).
    """

    nx: int
    ny: int
    nz: int

    @classmethod
    def of(cls, sides: object) -> Grid:
        """Return three whole numbers (nx, ny, nz) as a grid.

        Raises
        ------
        TypeError
            If they are anything else.
        ValueError
            If no display can have these sides.

        """
        listed = list(sides) if isinstance(sides, tuple | list) else []
        if isinstance(sides, np.ndarray) and sides.ndim == 1:
            listed = list(sides)
        if len(listed) != 3 or not all(isinstance(side, int | np.integer) for side in listed):
            raise wrong_kind("grid", "three whole numbers (nx, ny, nz)", sides)
        grid = cls(*map(int, listed))
        if not all(1 <= side <= spec.LIMIT_MAX_SIDE for side in grid):
            raise ValueError(f"grid: sides are 1 to {spec.LIMIT_MAX_SIDE}, not {grid}")
        if grid.voxels > spec.LIMIT_MAX_VOXELS:
            raise ValueError(f"grid: {grid} has more than {spec.LIMIT_MAX_VOXELS} voxels")
        return grid

    @classmethod
    def parse(cls, text: str) -> Grid:
        """Parse ``"17x64x40"`` or ``"17,64,40"``.

        Raises
        ------
        ValueError
            If the text is not three positive whole numbers joined by ``x`` or by commas.

        """
        instance("text", text, str, "a text such as '128x128x128'")
        sides = r"([0-9]{1,5})\s*[x,]\s*([0-9]{1,5})\s*[x,]\s*([0-9]{1,5})"
        match = re.fullmatch(sides, text.strip().lower())
        if not match or "0" in (parts := [part.lstrip("0") or "0" for part in match.groups()]):
            raise ValueError(
                f"{reprlib.repr(text)} is not a size of a display: write it like 128x128x128"
            )
        return cls(*map(int, parts))

    def __str__(self) -> str:
        return f"{self.nx}x{self.ny}x{self.nz}"

    @property
    def voxels(self) -> int:
        """Number of voxels."""
        return math.prod(self)

    @property
    def array_shape(self) -> tuple[int, int, int]:
        """Shape of an array over this grid: (nz, ny, nx)."""
        return self.nz, self.ny, self.nx

    def inside(self, voxels: NDArray[np.integer]) -> NDArray[np.bool_]:
        """Return which voxels are inside the grid.

        Parameters
        ----------
        voxels : (N, 3) integer array
            Columns x, y, z.

        Returns
        -------
        (N,) bool array

        """
        within = np.ones(len(voxels), dtype=np.bool_)
        for column, side in zip(voxels.T, self, strict=True):  # faster than all(axis=1)
            within &= column >= 0
            within &= column < side
        return within

    def index_of(self, voxels: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return the scan-order indices of voxels: x + nx * (y + ny * z).

        Parameters
        ----------
        voxels : (N, 3) integer array
            Columns x, y, z, all inside the grid: numpy would wrap the others silently.

        Returns
        -------
        (N,) int64 array

        """
        x, y, z = np.asarray(voxels, dtype=np.int64).T
        return np.asarray(x + self.nx * (y + self.ny * z))

    def voxels_at(self, index: NDArray[np.integer]) -> NDArray[np.int32]:
        """Return the voxels, (n, 3) int32, columns x, y, z, at scan-order indices, (n,)."""
        # Several times as fast as divmod; no grid has more voxels than 32 bits can number.
        left = np.asarray(index).astype(np.uint32)
        columns = np.empty((3, len(left)), dtype=np.int32)
        for column, side in zip(columns, self[:2], strict=False):
            above = left // np.uint32(side)
            column[:] = left - above * np.uint32(side)
            left = above
        columns[2] = left
        return columns.T

"""Boxes of voxels, to which bodies are clipped. Must not know bodies or displays."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Floats, Ints

Triple = tuple[int, int, int]


class VoxelBox(NamedTuple):
    """The voxels low <= (x, y, z) < high.

    Attributes
    ----------
    low, high : (int, int, int)
        First voxel, and the one after the last, along each axis.

    """

    low: Triple
    high: Triple

    @classmethod
    def of_grid(cls, grid: tuple[int, int, int]) -> VoxelBox:
        """Return the box of a display's grid (nx, ny, nz)."""
        nx, ny, nz = map(int, grid)
        return cls((0, 0, 0), (nx, ny, nz))

    @classmethod
    def around(cls, low: Floats, high: Floats) -> VoxelBox:
        """Return a box that holds all voxels that something between two finite corners lights."""
        x0, y0, z0 = (math.floor(each) - 1 for each in low.tolist())
        x1, y1, z1 = (math.floor(each) + 2 for each in high.tolist())
        return cls((x0, y0, z0), (x1, y1, z1))

    @property
    def sides(self) -> Triple:
        """Number of voxels along x, y and z."""
        (x0, y0, z0), (x1, y1, z1) = self
        return x1 - x0, y1 - y0, z1 - z0

    @property
    def size(self) -> int:
        """Number of voxels."""
        return math.prod(self.sides)

    @property
    def corners(self) -> tuple[Floats, Floats]:
        """Low and high corner, (3,) float64 each."""
        return np.array(self.low, dtype=np.float64), np.array(self.high, dtype=np.float64)

    def expanded(self, margin: int) -> VoxelBox:
        """Return the box with so many more voxels on all sides."""
        (x0, y0, z0), (x1, y1, z1) = self
        return VoxelBox(
            (x0 - margin, y0 - margin, z0 - margin), (x1 + margin, y1 + margin, z1 + margin)
        )

    def inside(self, voxels: NDArray[np.integer]) -> NDArray[np.bool_]:
        """Return which voxels, (N, 3), are in the box: (N,) bool."""
        return np.asarray(((voxels >= self.low) & (voxels < self.high)).all(axis=1))

    def index_of(self, voxels: NDArray[np.integer]) -> Ints:
        """Return the scan-order indices, (N,), of voxels of the box, (N, 3): x runs fastest."""
        nx, ny, _ = self.sides
        x, y, z = (voxels.astype(np.int64) - self.low).T
        return np.asarray(x + nx * (y + ny * z))

    def voxels_at(self, index: Ints) -> NDArray[np.int32]:
        """Return the voxels, (N, 3) int32, columns x, y, z, at ascending scan-order indices."""
        nx, ny, nz = self.sides
        voxels = np.empty((len(index), 3), dtype=np.int32)
        if ny * nz < len(index):  # rows are looked up, which is faster than to divide
            ends = np.searchsorted(index, np.arange(1, ny * nz + 1) * nx)
            row = np.repeat(np.arange(ny * nz), np.diff(ends, prepend=0))
        else:
            row = index // nx
        z = row // ny
        voxels[:, 0] = index - row * nx + self.low[0]
        voxels[:, 1] = row - z * ny + self.low[1]
        voxels[:, 2] = z + self.low[2]
        return voxels

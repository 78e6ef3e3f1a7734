"""Voxel events of curves: candidate voxels in order, with the parameters that call for them.

Integer bookkeeping only. This module must not know curves or the origin of the voxels.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.kernel_backend import with_kernel
from voxdisplay.voxelization.index_ranges import insert_columns

Voxels = NDArray[np.int32]


@dataclass(frozen=True, slots=True)
class VoxelEvents:
    """Voxels along pieces of curves, each with the parameter where the curve calls for it.

    Attributes
    ----------
    piece : (M,) int32 array
        The piece each belongs to, ascending.
    t : (M,) float64 array
        Parameters, ascending within a piece.
    voxels : (3, M) int32 array
        Rows x, y, z.
    heading : (M,) int8 array
        The axis along which the curve passes the voxel's mid-plane and the sense in which it does,
        2 * axis + (1 if it descends). ``NO_HEADING`` for what is not part of such a run. Two
        neighbours of one heading are one apart on its axis.

    """

    piece: NDArray[np.int32]
    t: NDArray[np.float64]
    voxels: Voxels
    heading: NDArray[np.int8]

    def take(self, index: NDArray[np.integer] | NDArray[np.bool_]) -> VoxelEvents:
        """Return the events at an index array or under a mask."""
        if index.dtype == bool:
            (index,) = index.nonzero()
        voxels = self.voxels.take(index, axis=1)
        return VoxelEvents(self.piece[index], self.t[index], voxels, self.heading[index])

    def insert(self, at: NDArray[np.intp], other: VoxelEvents) -> VoxelEvents:
        """Return these events with others before those at the ascending indices ``at``."""
        mine, others = ((each.piece, each.t, each.voxels, each.heading) for each in (self, other))
        return VoxelEvents(*insert_columns(at, mine, others))

    def with_voxels(self, voxels: Voxels) -> VoxelEvents:
        """Return the same events with other voxels."""
        return replace(self, voxels=voxels)

    @property
    def joined(self) -> NDArray[np.bool_]:
        """True for those of the M - 1 steps that stay inside a piece."""
        return np.asarray(self.piece[1:] == self.piece[:-1])

    def gaps(self) -> NDArray[np.intp]:
        """Return the steps within a piece between voxels that are not adjacent: k for k, k + 1."""
        return find_gaps(self.piece, self.voxels)


NO_HEADING = np.int8(-1)


def adjacent(here: Voxels, there: Voxels) -> NDArray[np.bool_]:
    """Return which voxels, (3, n) each, are 26-adjacent or equal."""
    close = np.abs(here - there) <= 1
    return np.asarray(close[0] & close[1] & close[2])


@with_kernel
def find_gaps(piece: NDArray[np.int32], voxels: Voxels) -> NDArray[np.intp]:
    """Return the k, ascending, for which voxels k and k + 1 of one piece are not adjacent."""
    apart = (piece[1:] == piece[:-1]) & ~adjacent(voxels[:, :-1], voxels[:, 1:])
    return np.asarray(apart.nonzero()[0])

"""Compiled kernels of functions of this package: see `voxdisplay.compute.kernel_backend`.

They compute the same in the same order as the numpy functions of the same names, so that all bits
agree; those functions document what and why. One loop takes the place of many array operations.
"""

from voxdisplay.voxelization.kernels.grid_plane import choose_corners, find_gaps
from voxdisplay.voxelization.kernels.index_ranges import insert_columns
from voxdisplay.voxelization.kernels.sampling import (
    guess_crossings,
    rank_corners,
    slopes_at,
    subdivision_counts,
)
from voxdisplay.voxelization.kernels.thinning import thin_events

__all__ = [
    "choose_corners",
    "find_gaps",
    "guess_crossings",
    "insert_columns",
    "rank_corners",
    "slopes_at",
    "subdivision_counts",
    "thin_events",
]

"""The compiled twins of functions of this package: see `voxdisplay.compute.kernel_backend`.

What is computed, and in what order, is what numpy does in their place, so that all bits agree: the
functions of the same name say what and why. One loop takes the place of many array operations, and
looks at nothing twice.
"""

from voxdisplay.voxelization.kernels.sampling import (
    guess_crossings,
    rank_corners,
    slopes_at,
    subdivision_counts,
)
from voxdisplay.voxelization.kernels.thinning import (
    choose_corners,
    find_gaps,
    insert_columns,
    thin_events,
)

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

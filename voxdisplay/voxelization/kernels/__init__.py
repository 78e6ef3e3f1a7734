"""The compiled twins of functions of this package: see `voxdisplay.compute.kernel_backend`.

What is computed, and in what order, is what numpy does in their place, so that all bits agree: the
functions of the same name say what and why. One loop takes the place of many array operations, and
looks at nothing twice.
"""

from voxdisplay.voxelization.kernels.sampling import aim, corners, needed_parts, slopes_at
from voxdisplay.voxelization.kernels.thinning import choose_corners, insert, reduce, torn

__all__ = [
    "aim",
    "choose_corners",
    "corners",
    "insert",
    "needed_parts",
    "reduce",
    "slopes_at",
    "torn",
]

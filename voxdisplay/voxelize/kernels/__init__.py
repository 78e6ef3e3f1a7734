"""The compiled twins of functions of this package: see `voxdisplay.compiled`.

What is computed, and in what order, is what numpy does in their place, so that all bits agree: the
functions of the same name say what and why. One loop takes the place of many array operations, and
looks at nothing twice.
"""

from voxdisplay.voxelize.kernels.events import choose_corners, insert, reduce, torn
from voxdisplay.voxelize.kernels.samples import aim, corners, needed_parts, slopes_at

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

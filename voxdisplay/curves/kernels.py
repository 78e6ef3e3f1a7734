"""Compiled kernels of this package: see `voxdisplay.compute.kernel_backend`.

They compute what the numpy functions of the same name do, in the same order, so that all bits
agree, and may run in several threads at once.
"""

from __future__ import annotations

import numpy as np

from voxdisplay.compute.array_types import Floats, Ints
from voxdisplay.compute.kernel_backend import jit

# Points per inner loop, which stay in the innermost cache.
BLOCK = 128


@jit
def evaluate_beziers(control: Floats, which: Ints, t: Floats) -> Floats:
    """Evaluate Bezier curves as `splines.evaluate_beziers` does."""
    size, order = t.size, control.shape[0]
    points = np.empty((3, size))
    layer, rest = np.empty((order, BLOCK)), np.empty(BLOCK)
    begin = 0
    while begin < size:
        of, end = which[begin], begin + 1
        while end < size and end - begin < BLOCK and which[end] == of:
            end += 1
        count, times = end - begin, t[begin:end]
        for k in range(count):
            rest[k] = 1 - times[k]
        for axis in range(3):
            for j in range(order - 1):
                row, one, other = layer[j], control[j, axis, of], control[j + 1, axis, of]
                for k in range(count):
                    row[k] = one * rest[k] + other * times[k]
            for last in range(order - 2, 0, -1):
                for j in range(last):
                    row, following = layer[j], layer[j + 1]
                    for k in range(count):
                        row[k] = row[k] * rest[k] + following[k] * times[k]
            points[axis, begin:end] = layer[0, :count]
        begin = end
    return points

"""Checks of arguments that are arrays: errors name the argument and what is wanted.

Must not know frames.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from voxdisplay.argument_checks import is_masked_array


def is_array_like(value: object) -> bool:
    """Return whether a value is an array, or a list or tuple of which numpy makes one."""
    is_array = isinstance(value, list | tuple) or hasattr(value, "__array__")
    return is_array and not isinstance(value, type)


def as_array(name: str, value: object) -> NDArray[Any]:
    """Return a value as an array; raise `ValueError` for uneven rows, or if any is masked."""
    if is_masked_array(value) and np.ma.is_masked(value):
        raise ValueError(
            f"{name}: some of it is masked: fill it first, as with array.filled(0), or leave it out"
        )
    try:
        return np.asarray(value)
    except ValueError:
        raise ValueError(f"{name}: its rows have different lengths") from None


def as_voxels(name: str, value: object) -> NDArray[np.int64]:
    """Return voxels as an (N, 3) int64 array, columns x, y, z; raise `ValueError` if not."""
    voxels = as_array(name, value)
    if voxels.ndim != 2 or voxels.shape[1] != 3 or voxels.dtype.kind not in "iu":
        raise ValueError(
            f"{name}: voxels are an (N, 3) array of whole numbers, columns x, y, z; "
            f"this is {voxels.shape} of {voxels.dtype}"
        )
    return voxels.astype(np.int64)

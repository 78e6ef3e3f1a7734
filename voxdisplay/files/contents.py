"""Values that readers of files return: voxels, volumes and meshes, with remarks for people."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MAX_BYTES = 1 << 30
"""Largest file, and most bytes that one may be unpacked to."""
MAX_SAMPLES = 1 << 29
"""Most samples of a volume."""
MAX_LIT = 1 << 25
"""Most voxels of a voxel model."""


@dataclass(frozen=True, slots=True, eq=False)
class ModelVoxels:
    """Voxels of a model.

    Attributes
    ----------
    voxels : (N, 3) int32 array
        Columns x, y, z; z is up.
    colors : (N, 3) uint8 array, optional
    notes : tuple of str
        What was left out or chosen.

    """

    voxels: NDArray[np.int32]
    colors: NDArray[np.uint8] | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class VolumeSamples:
    """Samples of a volume.

    Attributes
    ----------
    values : (nz, ny, nx) array
        Real numbers, indexed [z, y, x]; z is up.
    spacing : tuple of float
        Distances along x, y, z.
    window : tuple of float, optional
        Values to show, low and high, where the file names them.
    notes : tuple of str
        What was left out or chosen.

    """

    values: NDArray[np.generic]
    spacing: tuple[float, float, float] = (1.0, 1.0, 1.0)
    window: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()

"""Independent checks of voxelised surfaces: plain rules, floods, distances. Slow and simple."""

from collections.abc import Callable

import numpy as np

Signed = Callable[[np.ndarray], np.ndarray]
"""Points, (n, 3), to numbers, (n,): negative inside, its magnitude about the distance."""


def mask(voxels: np.ndarray, grid: tuple[int, int, int]) -> np.ndarray:
    """Return voxels, (n, 3), of a grid (nx, ny, nz) as a bool array [z, y, x]."""
    lit = np.zeros(grid[::-1], dtype=bool)
    x, y, z = voxels.T
    lit[z, y, x] = True
    return lit


def centres(grid: tuple[int, int, int]) -> np.ndarray:
    """Return the centres of all voxels of a grid (nx, ny, nz), (n, 3), in scan order."""
    z, y, x = np.indices(grid[::-1])
    return np.stack((x, y, z), axis=-1).reshape(-1, 3) + 0.5


def crossed(signed: Signed, grid: tuple[int, int, int], samples: int = 41) -> np.ndarray:
    """Return the voxels on whose central cross a function changes sign, as bool [z, y, x]."""
    centre = centres(grid)
    found = np.zeros(len(centre), dtype=bool)
    for axis in range(3):
        arm = np.linspace(-0.5, 0.5, samples)
        points = np.repeat(centre[:, None], samples, axis=1)
        points[:, :, axis] += arm
        inside = signed(points.reshape(-1, 3)).reshape(len(centre), samples) < 0
        found |= (inside != inside[:, :1]).any(axis=1)
    return found.reshape(grid[::-1])


def leaks(lit: np.ndarray, inside: np.ndarray) -> int:
    """Return the number of unlit inner voxels that a 6-connected flood reaches from outside."""
    free = np.pad(~lit, 1, constant_values=True)
    inner = np.pad(inside & ~lit, 1, constant_values=False)
    reached = np.zeros_like(free)
    reached[[0, -1]] = reached[:, [0, -1]] = reached[:, :, [0, -1]] = True
    while True:
        grown = reached.copy()
        for axis in range(3):
            for step in (1, -1):
                grown |= np.roll(reached, step, axis)
        grown &= free
        if (grown == reached).all():
            return int((reached & inner).sum())
        reached = grown

"""Order of the axes of scanned volumes: from file axes to x right, y to the front, z up.

Anatomical axes are right, anterior, superior (RAS). The nearest permutation and reversal of axes is
taken; nothing is resampled.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray


def to_canonical(
    values: NDArray[Any], directions: NDArray[np.float64]
) -> tuple[NDArray[Any], tuple[float, float, float], str | None]:
    """Turn a volume so that its axes are right, anterior, superior.

    Parameters
    ----------
    values : (nx, ny, nz) array
        Indexed in the order of the file's axes.
    directions : (3, 3) float64 array
        Columns: the step from one sample to the next along each axis, in right, anterior, superior.

    Returns
    -------
    values : array
        Indexed [z, y, x] of the canonical axes, as a view.
    spacing : tuple of float
        Along x, y, z.
    note : str or None
        That the volume is oblique, and by how much, if so.

    """
    lengths = np.linalg.norm(directions, axis=0)
    if not (np.isfinite(directions).all() and (lengths > 0).all()):
        raise ValueError("the directions of its axes are not finite, or 0")
    units = directions / lengths
    best = max(
        itertools.permutations(range(3)),
        key=lambda order: sum(abs(float(units[axis, order[axis]])) for axis in range(3)),
    )
    turned = values.transpose(best)
    backward = [bool(units[axis, best[axis]] < 0) for axis in range(3)]
    turned = turned[tuple(slice(None, None, -1 if back else 1) for back in backward)]
    cosines = [abs(float(units[axis, best[axis]])) for axis in range(3)]
    angle = float(np.degrees(np.arccos(min(1.0, *cosines))))
    note = f"its axes are oblique by {angle:.0f} degrees: they are taken as straight"
    x, y, z = (float(lengths[axis]) for axis in best)
    return turned.transpose(2, 1, 0), (x, y, z), note if angle > 1 else None

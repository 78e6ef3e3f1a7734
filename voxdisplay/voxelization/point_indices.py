"""Positions of voxels among the points that their curve was made of.

It must not know what the points have: colours, or anything else.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from voxdisplay.compute.array_types import Floats
    from voxdisplay.voxelization.sequence import Sequence


def point_indices(sequence: Sequence) -> Floats:
    """Return the fractional index of each voxel among the points of its curve.

    The voxel of point i has index i; one a third of the way to the next point has i + 1/3. On the
    line of a closed curve from the last point to the first, indices run on to the count of points.

    Returns
    -------
    (N,) float64 array

    Raises
    ------
    ValueError
        If the curve is not made of points: `Curve.point_count`.

    """
    count = sequence.curve.point_count
    if count is None:
        raise ValueError("the curve is not made of points")
    index = np.array(sequence.t)
    order = np.argsort(index, kind="stable")
    points = np.arange(float(count))
    cells = np.floor(sequence.curve.position(points)).T
    behind = np.searchsorted(index[order], points)
    # A voxel near the point in t has the point in it, unless thinning took that one.
    best = np.full(count, np.inf)
    nearest = np.zeros(count, dtype=np.intp)
    for offset in (-1, 0, 1):
        voxel = order[np.clip(behind + offset, 0, len(order) - 1)]
        outside = (sequence.voxels[voxel] != cells).any(axis=1)
        rank = np.abs(sequence.t[voxel] - points) + 1e9 * outside
        nearest = np.where(rank < best, voxel, nearest)
        best = np.minimum(best, rank)
    index[nearest] = points
    return index

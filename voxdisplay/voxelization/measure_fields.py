"""Independent measurement of voxel sets against functions that vanish on a surface.

Distances by Newton's method from numerical gradients: right to second order in curvature, which is
1e-3 voxel for radii of some voxels. Shares no code with the voxelisers that it judges.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from voxdisplay.compute.array_types import Bools, Floats

Field = Callable[[Floats], Floats]
"""Points, (n, 3), to values, (n,); not finite where there are none."""

_STEPS = 30
_H = 1e-5
_CLOSE = 1e-6
_EDGE = 1e-3


@np.errstate(all="ignore")
def field_distances(centers: Floats, fields: Sequence[tuple[Field, Field | None]]) -> Floats:
    """Return the distances of points from the nearest of several surface patches.

    Parameters
    ----------
    centers : (n, 3) float64 array
    fields : sequence of (field, clip)
        Functions that vanish on a surface, and functions that are positive where the patch is not.

    Returns
    -------
    (n,) float64 array
        Infinite where no patch was found.

    """
    best = np.full(len(centers), np.inf)
    for field, clip in fields:
        point = _feet(field, centers)
        size = np.sqrt((_gradient(field, point) ** 2).sum(axis=1))
        good = np.abs(field(point)) <= _CLOSE * np.maximum(size, _CLOSE)
        if clip is not None:
            beyond = np.flatnonzero(~good | (clip(point) > _EDGE))
            point[beyond] = _rim_feet(field, clip, centers[beyond], point[beyond])
            good = np.abs(field(point)) <= _CLOSE * np.maximum(size, 1)
            good &= clip(point) <= _EDGE
        apart = np.sqrt(((point - centers) ** 2).sum(axis=1))
        best = np.where(good & (apart < best), apart, best)
    return best


def _feet(field: Field, centers: Floats) -> Floats:
    """Return the points of a surface that are nearest to others, (n, 3)."""
    point = centers.copy()
    for step in range(_STEPS + 3):
        gradient = _gradient(field, point)
        slope = (gradient**2).sum(axis=1)
        moved = point - (field(point) / slope)[:, None] * gradient
        if step < _STEPS:  # along the tangent plane back below the centre
            normal = gradient / np.sqrt(slope)[:, None]
            aside = centers - moved
            moved += aside - (aside * normal).sum(axis=1)[:, None] * normal
        point = np.where(np.isfinite(moved).all(axis=1)[:, None], moved, point)
    return point


def _rim_feet(field: Field, clip: Field, centers: Floats, start: Floats) -> Floats:
    """Return points where both a surface and its clip are 0, near others, (n, 3)."""
    point = start.copy()
    for step in range(_STEPS + 3):
        one, two = _gradient(field, point), _gradient(clip, point)
        # The shortest step that solves both linear equations.
        p, q, r = ((x * y).sum(axis=1) for x, y in ((one, one), (one, two), (two, two)))
        f, g = field(point), clip(point)
        det = p * r - q * q
        moved = point - ((r * f - q * g) / det)[:, None] * one
        moved -= ((p * g - q * f) / det)[:, None] * two
        if step < _STEPS:
            along = np.cross(one, two)
            along /= np.sqrt((along**2).sum(axis=1))[:, None]
            moved += ((centers - moved) * along).sum(axis=1)[:, None] * along
        point = np.where(np.isfinite(moved).all(axis=1)[:, None], moved, point)
    return point


def _gradient(field: Field, points: Floats) -> Floats:
    columns = []
    for axis in range(3):
        step = _H * (np.arange(3) == axis)
        columns.append((field(points + step) - field(points - step)) / (2 * _H))
    return np.stack(columns, axis=1)


@np.errstate(all="ignore")
def field_tunnels(
    starts: Floats, ends: Floats, fields: Sequence[tuple[Field, Field | None]]
) -> Bools:
    """Return which lines between points, (n, 3), cross one of several patches.

    A function that has the same sign at both ends is taken as not crossed.
    """
    crossed = np.zeros(len(starts), dtype=bool)
    for field, clip in fields:
        one, two = field(starts), field(ends)
        changes = (one < 0) != (two < 0)
        changes &= np.isfinite(one) & np.isfinite(two)
        if clip is not None and changes.any():
            low, high = starts.copy(), ends.copy()
            for _ in range(40):
                middle = (low + high) / 2
                same = ((field(middle) < 0) == (one < 0))[:, None]
                low, high = np.where(same, middle, low), np.where(same, high, middle)
            changes &= clip(low) <= 0
        crossed |= changes
    return crossed

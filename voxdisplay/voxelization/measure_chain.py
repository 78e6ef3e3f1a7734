"""Independent measurement of voxel sets against chains of balls: distances from their union.

Outside of the union the distance is that of the nearest ball. Inside it is the depth in the ball
that reaches furthest out, unless another ball covers the nearest point of that one's surface: near
such creases the distance along the axes is taken, which is never less than the true one. This
module shares no code with the voxeliser that it judges.
"""

from __future__ import annotations

import numpy as np

from voxdisplay.bodies.ball_chain import BallChain
from voxdisplay.compute.array_types import Floats
from voxdisplay.voxelization.measure_fields import field_distances

_COVERED = 1e-6  # depth at which a point of a ball's surface is inside of another
_REACH = 1.5  # of the search along the axes, in voxels
_COARSE, _FINE = 48, 1536  # steps of it, and where the surface may be in a narrow gap
_ROUND = 1e-9


def chain_distances(centers: Floats, chain: BallChain, expected: float = 0.5) -> Floats:
    """Return the distances of points from the surface of a chain of balls.

    Parameters
    ----------
    centers : (n, 3) float64 array
    chain : BallChain
    expected : float
        Where more than this is found inside, the surface is searched in narrower gaps.

    Returns
    -------
    (n,) float64 array
        Infinite where nothing was found.

    """
    gram = chain.metric.T @ chain.metric
    scale = gram[0, 0]
    if np.abs(gram - scale * np.eye(3)).max() > _ROUND * scale:  # balls that are not round
        return field_distances(centers, [(lambda p: chain.nearest(p).distance, None)])
    near = chain.nearest(centers)
    unit = 1 / np.sqrt(scale)
    found = np.abs(near.distance) * unit
    inside = np.flatnonzero(near.distance < 0)
    begin = chain.first[near.part[inside]]
    along = chain.points[begin + 1] - chain.points[begin]
    out = centers[inside] - chain.points[begin] - near.share[inside, None] * along
    size = np.sqrt((out**2).sum(axis=1))
    out /= np.where(size > 0, size, 1)[:, None]
    feet = centers[inside] + found[inside, None] * out
    covered = (chain.nearest(feet).distance < -_COVERED) | (size == 0)
    rows = inside[covered]
    found[rows] = _along_axes(centers[rows], chain, _COARSE)
    rows = rows[found[rows] > expected + 1e-6]
    found[rows] = _along_axes(centers[rows], chain, _FINE)
    return np.asarray(found)


def _along_axes(points: Floats, chain: BallChain, count: int) -> Floats:
    """Return the least distances of points inside from the surface along the axes."""
    step = _REACH / count
    best = np.full(len(points), np.inf)
    for axis in range(3):
        for sign in (-1.0, 1.0):
            direction = sign * np.eye(3)[axis]
            at = np.full(len(points), np.inf)
            for k in range(1, count + 1):
                left = np.flatnonzero(np.isinf(at) & (best > (k - 1) * step))
                if not left.size:
                    break
                path = points[left] + k * step * direction
                at[left[chain.nearest(path).distance >= 0]] = k * step
            best = np.minimum(best, _refined(points, at, direction, step, chain))
    return best


def _refined(
    points: Floats, at: Floats, direction: Floats, step: float, chain: BallChain
) -> Floats:
    """Return where lines from points leave a chain, between ``at`` and a step before."""
    rows = np.flatnonzero(np.isfinite(at))
    low, high = at[rows] - step, at[rows].copy()
    for _ in range(20):
        middle = (low + high) / 2
        inside = chain.nearest(points[rows] + middle[:, None] * direction).distance < 0
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    at[rows] = high
    return at

"""Note that part of a body is outside the box of a display, to which it is clipped.

Must not know how bodies are made and voxelised.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from voxdisplay.bodies.body import Body
    from voxdisplay.bodies.geometry import Bounds, Geometry
    from voxdisplay.voxelization.voxel_box import VoxelBox
    from voxdisplay.voxelization.voxel_set import VoxelSet

_SLACK = 0.5  # voxels: what ends so near behind a side is not missed


def clipping_note(
    geometry: Geometry,
    body: Body,
    inside: VoxelSet,
    voxels_in: Callable[[VoxelBox], NDArray[np.integer]],
) -> str | None:
    """Return a note if part of a body, or all of it, is cut off, for people; else None.

    What goes on for ever in a direction is not missed there.

    Parameters
    ----------
    geometry : Geometry
        The body, or at least what of it is inside the box.
    body : Body
    inside : VoxelSet
        What is inside the box.
    voxels_in : callable
        Return the voxels of the geometry, (n, 3), inside another box.

    """
    # Of a geometry there may be nothing where the body is outside.
    found = _reach(geometry, body, inside.box) if len(inside) else (body.bounds(), True)
    if found is None:
        return None
    (low, high), is_tight = found
    first, end = inside.box.corners
    below = (low < first - _SLACK) & np.isfinite(low)
    above = (high > end + _SLACK) & np.isfinite(high)
    if not (below.any() or above.any()):
        return None
    if not len(inside):
        return "it is outside the display"
    if not is_tight:  # then it may end inside: if not, it has voxels on both sides of a side
        at_sides = (inside.voxels == first) & below | (inside.voxels == end - 1) & above
        if not at_sides.any() or inside.box.inside(voxels_in(inside.box.expanded(1))).all():
            return None
    return "part of it is outside the display"


def _reach(geometry: Any, body: Body, box: VoxelBox) -> tuple[Bounds, bool] | None:
    """Return bounds, and whether they are tight; None if they tell nothing.

    Geometries are told by name, as their classes are imported on first use.
    """
    match type(geometry).__name__:
        case "TriangleMesh":
            low, high = _extent(geometry.vertices)
            if not (low >= box.low).all() or not (high <= box.high).all():
                low, high = _extent(geometry.vertices[geometry.faces.reshape(-1)])
            return (low, high), True
        case "BallChain":
            return geometry.bounds(), True
        case "LitVoxels":
            return body.bounds() if body.kind == "points" else _extent(geometry.voxels), True
        case "QuadricPatches":
            lows, highs = zip(*(patch.bounds for patch in geometry.patches), strict=True)
            return (np.min(lows, axis=0), np.max(highs, axis=0)), False
        case "ImplicitFunction":
            return geometry.bounds, False
        case "HeightFunction":  # heights are not known beforehand
            low = np.append(geometry.low, box.low[2] - 1.0)
            return (low, np.append(geometry.high, box.high[2] + 1.0)), False
    return None


def _extent(points: NDArray[Any]) -> Bounds:
    """Return the corners of points, (n, 3); of none, a box without a point."""
    if not len(points):
        return np.full(3, np.inf), np.full(3, -np.inf)
    return points.min(axis=0).astype(np.float64), points.max(axis=0).astype(np.float64)

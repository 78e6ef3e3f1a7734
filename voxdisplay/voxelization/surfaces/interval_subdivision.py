"""Interval subdivision: the bricks of space that may hold a zero, by bounds of a function.

Must not know what is evaluated inside of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from voxdisplay.expressions.interval import Interval

if TYPE_CHECKING:
    from voxdisplay.bodies.implicit import SpaceFunction
    from voxdisplay.compute.array_types import Bools, Floats, Ints
    from voxdisplay.voxelization.voxel_box import VoxelBox

BRICK = 8
_COARSEST = 64
_BLOCK = 1 << 14  # boxes at a time

Numbers = NDArray[Any]


@dataclass(frozen=True, slots=True, eq=False)
class Bricks:
    """Closed boxes of (BRICK + 1)^3 centres that may hold zeros, and boxes of voxels inside.

    Attributes
    ----------
    origin : (n, 3) int64 array
        First voxel of each brick; a brick reaches to the centre of the voxel BRICK further, and
        some of them beyond the box.
    filled : list of ((3,) int64 array, (3,) int64 array)
        Boxes of voxels, low <= (x, y, z) < high, at all of whose centres f < 0.

    """

    origin: Ints
    filled: list[tuple[Ints, Ints]]


def prune(function: SpaceFunction, box: VoxelBox) -> Bricks | None:
    """Return the bricks of a box that may hold a zero of a function; None without bounds."""
    side, low, high = _COARSEST, np.array(box.low), np.array(box.high)
    while side > BRICK and side >= 2 * max(box.sides):
        side //= 2
    grids = [np.arange(a, b, side) for a, b in zip(box.low, box.high, strict=True)]
    origin = np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1).reshape(-1, 3)
    filled: list[tuple[Ints, Ints]] = []
    while True:
        end = np.minimum(origin + side, high - 1)
        bounds = bounds_over(function, origin + 0.5, end + 0.5)
        if bounds is None:
            return None
        negative = bounds[1] < 0
        inside = zip(origin[negative], np.minimum(origin[negative] + side, high), strict=True)
        filled.extend(inside)
        origin = origin[may_be_zero(bounds)]
        if side == BRICK:
            return Bricks(origin, filled)
        side //= 2
        origin = halve(origin, side)
        # The centre at the far end of a brick is in it.
        origin = origin[((origin >= low) & (origin < high)).all(axis=1)]


def halve(origin: Numbers, side: float) -> Numbers:
    """Return the origins of the eight boxes, ``side`` long, of each box twice as long."""
    corners = np.stack(np.meshgrid((0, 1), (0, 1), (0, 1), indexing="ij"), axis=-1).reshape(-1, 3)
    return np.asarray((origin[:, None] + side * corners).reshape(-1, 3))


def bounds_over(
    function: SpaceFunction, low: Numbers, high: Numbers
) -> tuple[Floats, Floats] | None:
    """Return bounds of a function over boxes, (n, 3) corners each: (n,), (n,); None without."""
    lows, highs = np.empty(len(low)), np.empty(len(low))
    for begin in range(0, len(low), _BLOCK):
        part = slice(begin, begin + _BLOCK)
        axes = [Interval(a, b) for a, b in zip(low[part].T, high[part].T, strict=True)]
        with np.errstate(all="ignore"):
            bounds = function.enclosure(*axes)
        if bounds is None:
            return None
        lows[part], highs[part] = bounds.lo, bounds.hi
    return lows, highs


def may_be_zero(bounds: tuple[Floats, Floats]) -> Bools:
    """Return where bounds do not exclude 0; nan does not."""
    return np.asarray(~((bounds[0] > 0) | (bounds[1] < 0)))

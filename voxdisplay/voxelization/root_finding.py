"""Bracketed root finding for coordinates of curves, many brackets at once.

This module must not know what the values are that coordinates are to take.
"""

from __future__ import annotations

import numpy as np

from voxdisplay.compute.array_types import Bools, Floats, Ints
from voxdisplay.voxelization.curve_batch import CurveBatch

# How far from its mid-plane a crossing may be found, in voxels: sqrt(1/2 + 0.002^2) < 0.7072.
TOLERANCE = 2e-3


@np.errstate(all="ignore")
def find_roots(
    batch: CurveBatch,
    curve: Ints,
    axis: Ints,
    level: Floats,
    bracket: tuple[Floats, Floats],
    ends: tuple[Floats, Floats],
) -> tuple[Floats, Floats, Bools]:
    """Return where coordinates take given values, by bracketed secants (the Illinois rule).

    Parameters
    ----------
    batch : CurveBatch
        The curves.
    curve, axis : (n,) int64 arrays
        Which curve, ascending, and which of its coordinates.
    level : (n,) float64 array
        The value to be taken, in voxels.
    bracket : (n,), (n,) float64 arrays
        Parameters with the crossing between them.
    ends : (n,), (n,) float64 arrays
        Coordinate minus level at the bracket's ends: of opposite sign, or 0.

    Returns
    -------
    t : (n,) float64 array
    points : (3, n) float64 array
    found : (n,) bool array
        False where a coordinate passes the level without taking it, within ``TOLERANCE``; t and
        points are not set there.

    """
    t = np.empty(curve.size)
    points = np.empty((3, curve.size))
    found = np.zeros(curve.size, dtype=bool)
    left = np.arange(curve.size)
    (low, high), (at_low, at_high) = bracket, ends
    side = np.zeros(curve.size, dtype=np.int8)
    for turn in range(60):
        ratio = at_low / (at_low - at_high)
        ratio = np.where(np.isfinite(ratio) & (turn % 4 != 3), ratio, 0.5)
        guess = np.minimum(np.maximum(low + ratio * (high - low), low), high)
        there = batch.evaluate(curve[left], guess)
        value = there[axis[left], np.arange(left.size)] - level[left]
        done = np.abs(value) <= TOLERANCE
        there = there.take(done.nonzero()[0], axis=1)
        hit = left[done]
        t[hit], points[:, hit], found[hit] = guess[done], there, True
        if hit.size == left.size:
            break
        lost = high - low <= batch.resolution[curve[left]] / 4
        on = ~(done | lost)
        if not on.any():
            break
        lower = (value < 0) == (at_low < 0)
        # Illinois: the end that stays put a second time counts for half.
        at_high = np.where(lower, np.where(side == 1, at_high / 2, at_high), value)
        at_low = np.where(lower, value, np.where(side == -1, at_low / 2, at_low))
        low, high = np.where(lower, guess, low), np.where(lower, high, guess)
        side = np.where(lower, 1, -1).astype(np.int8)
        left, low, high, at_low, at_high, side = (
            array[on] for array in (left, low, high, at_low, at_high, side)
        )
    return t, points, found

"""Proof that a sequence shows its curve: coverage, distance and connectivity.

A proof trusts no earlier step, neither sampling nor root finding nor the choice of voxels: it takes
the voxels as they are, with a parameter t_i for each, and boxes that hold the
curve. The curve is that of exact arithmetic; its float64 positions are not used in any argument.
Let c_i be the centre of voxel i.

*Every point of the curve is near a voxel.* The boxes B_k hold the curve from t_k to t_(k+1), and
the intervals make up the range of t. For each some c_i is found such that all of B_k is within
``COVERAGE`` of it in max norm: three subtractions. So is all of the curve.

*Every voxel is near the curve.* For each a parameter s is found such that all of the box that
holds the single point P(s) is within 0.7072 of c_i: ``ERROR``; of the first and the last voxel,
which hold the curve's ends whatever that takes, within 0.8661: ``END_ERROR``; and so of those that
hold the corners of a closed curve, which could begin at any of them. So is P(s).

*The sequence is connected.* Integers.

What may fail is the search for such i and s; then there is no certificate. That leaves the boxes
to be trusted: `expressions.interval` and its assumptions. Why proofs are found, as
a rule: a crossing's voxel is at most sqrt(1/2) from the point where it was found and the two thin
out to neighbours; a box is less than 1 wide, and no part of the curve passes a mid-plane unseen
without coming back within a box.

This module must not know how voxels are chosen or restored.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Floats, Ints
from voxdisplay.curves.curve import Curve

# Proven bounds, in voxels; the first in max norm.
COVERAGE = 2.5
ERROR = 0.7072
END_ERROR = 0.8661
# An upper bound of rounding errors of this module's own sums.
ROUNDING = 1e-9
# For a box nearer than this to a voxel no nearer voxel is searched for.
CLOSE_ENOUGH = 1.4
# Numbers of voxels before and after the one nearest in t that are tried for a box, in turn.
SEARCH_SPANS = (0, 2, 24)
# Parameters tried for a voxel in each round, and rounds.
TRIES, ROUNDS = 17, 3


@dataclass(frozen=True, slots=True)
class Certificate:
    """Proven bounds of a sequence.

    Attributes
    ----------
    coverage : float
        Every point of the curve is within this of a voxel's centre, in max norm, in voxels.
    error : float
        Every voxel's centre is within this of the curve, but for the first and the last, and those
        that hold corners of a closed curve.
    end_error : float
        Those are within this.

    """

    coverage: float
    error: float
    end_error: float


def certify(
    curve: Curve,
    box_ends: tuple[Floats, Floats],
    boxes: tuple[Floats, Floats],
    voxels: NDArray[np.int32],
    t: Floats,
    *,
    closed: bool,
) -> Certificate | str:
    """Return the certificate of a sequence, or the reason why there is none.

    Parameters
    ----------
    curve : Curve
        With an enclosure.
    box_ends : (n,), (n,) float64 arrays
        Parameters t_k and t_(k+1) that boxes hold the curve between, all of it.
    boxes : (3, n), (3, n) float64 arrays
        Their bounds.
    voxels : (N, 3) int32 array
        A sequence in one piece.
    t : (N,) float64 array
        A parameter for each, ascending.
    closed : bool
        Whether the last voxel is followed by the first.

    """
    centres = voxels.T.astype(np.float64) + 0.5
    following = np.roll(centres, -1, axis=1) if closed else centres[:, 1:]
    if (np.abs(following - centres[:, : following.shape[1]]) > 1).any():
        return "the voxels are not connected"
    far = box_distances(box_ends, boxes, centres, t, closed=closed)
    coverage = float(far.max(initial=0.0)) + ROUNDING
    if not coverage <= COVERAGE:
        where = float(box_ends[0][np.argmax(far)])
        return f"near t = {where!r} the curve may be {coverage:.3g} voxels from the nearest voxel"
    off = _voxel_errors(curve, centres, t)
    ends = np.zeros(t.size, dtype=bool)
    ends[0] = True
    ends[-1] |= not closed or off[-1] > ERROR
    if closed and curve.breaks.size:
        ends |= _holds_any(voxels, curve.position(np.asarray(curve.breaks)))
    error = float(off[~ends].max(initial=0.0)) + ROUNDING
    end_error = float(off[ends].max()) + ROUNDING
    if not (error <= ERROR and end_error <= END_ERROR):
        worst = int(np.argmax(np.where(ends, off - END_ERROR, off - ERROR)))
        return f"voxel {worst} may be {off[worst]:.4g} voxels from the curve"
    return Certificate(coverage, error, end_error)


def box_distances(
    box_ends: tuple[Floats, Floats],
    boxes: tuple[Floats, Floats],
    centres: Floats,
    t: Floats,
    *,
    closed: bool,
) -> Floats:
    """Return, for each box, a bound of its points' distance from some centre, in max norm: (n,).

    Parameters are those of `certify`, but for ``centres``, (3, N): any with parameters t, (N,).
    """
    middle = (boxes[0] + boxes[1]) / 2
    # All of a box is within |c - middle| + half its width, on each axis.
    half = np.maximum(boxes[1] - middle, middle - boxes[0])
    nearest = np.searchsorted(t, (box_ends[0] + box_ends[1]) / 2)
    best = np.full(nearest.size, np.inf)
    todo = np.arange(nearest.size)
    for reach in SEARCH_SPANS:
        for shift in range(-reach - 1, reach + 1):
            index = nearest[todo] + shift
            index = index % t.size if closed else np.clip(index, 0, t.size - 1)
            far = (np.abs(centres[:, index] - middle[:, todo]) + half[:, todo]).max(axis=0)
            best[todo] = np.minimum(best[todo], far)
        todo = todo[~(best[todo] <= CLOSE_ENOUGH)]
        if not todo.size:
            break
    return best


def _voxel_errors(curve: Curve, centres: Floats, t: Floats) -> Floats:
    """Return bounds of the distances of centres, (3, N), from the curve: (N,)."""
    off = _distances(curve, centres, t)
    # Where the point at t will not do, another one may: the foot of a perpendicular.
    far = np.flatnonzero(~(off <= ERROR - ROUNDING))
    if far.size:
        first, last = curve.t_range
        low = np.where(far >= 2, t[np.maximum(far - 2, 0)], first)
        high = np.where(far < t.size - 2, t[np.minimum(far + 2, t.size - 1)], last)
        other = _nearest(curve, centres[:, far], low, high)
        off[far] = np.fmin(off[far], _distances(curve, centres[:, far], other))
    return off


def _holds_any(voxels: NDArray[np.int32], points: Floats) -> NDArray[np.bool_]:
    """Return which voxels, (N, 3), hold any of some points, (3, n)."""
    held = set(zip(*np.floor(points).astype(np.int64).tolist(), strict=True))
    return np.array([tuple(voxel) in held for voxel in voxels.tolist()])


def _distances(curve: Curve, centres: Floats, t: Floats) -> Floats:
    """Return bounds of the distances of centres, (3, m), from P(t), (m,); nan if unknown."""
    with np.errstate(all="ignore"):
        box = curve.enclosure(t, t)
    if box is None:
        return np.full(t.size, np.nan)
    apart = np.maximum(np.abs(centres - box[0]), np.abs(centres - box[1]))
    return np.asarray(np.sqrt((apart * apart).sum(axis=0)))


def _nearest(curve: Curve, centres: Floats, low: Floats, high: Floats) -> Floats:
    """Return parameters, (m,), of points near centres, (3, m), between others. No proof."""
    share = np.linspace(0.0, 1.0, TRIES)
    each: Ints = np.arange(low.size)
    t = low
    for _ in range(ROUNDS):
        tries = low[:, None] + (high - low)[:, None] * share
        with np.errstate(all="ignore"):
            points = curve.position(tries.reshape(-1)).reshape(3, *tries.shape)
        apart = points - centres[:, :, None]
        best = (apart * apart).sum(axis=0).argmin(axis=1)
        t = tries[each, best]
        low = tries[each, np.maximum(best - 1, 0)]
        high = tries[each, np.minimum(best + 1, TRIES - 1)]
    return t

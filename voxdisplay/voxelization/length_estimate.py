"""Lower bounds of curve lengths, by which curves that are too long are refused early.

The length of a curve is at least the sum of its chords over any partition of its range, so also
the mean of that sum over all offsets of a partition of step d: the integral of
|P(t + d) - P(t)| / d. A few random t estimate it for many d at once, whatever the frequency of an
oscillation. The longest chords are left out, so that a pole or a jump alone does not decide.

Must not know how curves are sampled or voxelised.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from voxdisplay.curves.curve import Curve

# Chords for each step, and the share of them, the shortest ones, that count.
_CHORDS, _SHARE = 128, 0.8
# Steps, as shares of the range: two halvings apart, from 1/64 to the resolution of parameters.
_STEPS = 0.5 ** np.arange(6, 48, 2)


@np.errstate(all="ignore")
def estimated_min_length(curve: Curve) -> tuple[float, float]:
    """Return an estimate, from below, of a curve's length in max norm, and of what it consists.

    Returns
    -------
    length : float
        In voxels.
    chord : float
        Mean chord of the widest steps that show a quarter of it: a curve that is long by chords
        of less than a voxel is rough.

    """
    first, last = curve.t_range
    length = last - first
    resolution = 64 * float(np.spacing(max(abs(first), abs(last))))
    steps = length * _STEPS
    steps = steps[steps > resolution]
    if not steps.size or not np.isfinite(length):
        return 0.0, 0.0
    # The same offsets every time: the same curve is always judged alike.
    random = np.random.default_rng(0)
    share = (np.arange(_CHORDS) + random.random((steps.size, _CHORDS))) / _CHORDS
    begin = first + (length - steps[:, None]) * share
    end = np.minimum(begin + steps[:, None], last)
    t = np.concatenate((begin.ravel(), end.ravel()))
    points = np.asarray(curve.position(t), dtype=float).reshape(3, 2, steps.size, _CHORDS)
    chords = np.abs(points[:, 1] - points[:, 0]).max(axis=0)
    chords = np.sort(np.where(np.isfinite(chords), chords, 0.0), axis=1)
    counted = chords[:, : int(_SHARE * _CHORDS)].sum(axis=1) / _CHORDS
    lengths = counted * length / steps
    most = lengths.max()
    return float(most), float(counted[lengths >= most / 4].max())

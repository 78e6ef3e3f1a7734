"""Numerical one-sided limits of a function at a parameter where it has no value.

The function is sampled at distances h_k = reach 2^-k from the parameter. If its values there
follow L + c h^p, as those of every function do that has a one-sided Taylor or Puiseux series,
Aitken's process removes the power exactly (Atkinson, *An Introduction to Numerical Analysis*,
section 2.6). A limit is accepted where four extrapolations in a row agree to `AGREEMENT`; the
widest such distances are taken, because rounding grows as h falls: (1 - cos t) / t**2 is 0 in
float64 for every t below 1e-8, though it tends to 1/2.

Accepted values may still diverge further in. That is a pole, unless growth is so slow in coming
that rounding explains it: c / h**p with a c below `ROUNDING` of the values' size.

Knows nothing of curves.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from voxdisplay.compute.array_types import Bools, Floats

AGREEMENT = 1e-4
"""Extrapolations that differ by less, in voxels, agree."""
PLATEAU = 1e-3
"""Values that move away from their limit by less, in voxels, are not spoiled by rounding."""
# Extrapolations that have to agree, and values that a window of them is made from.
_WINDOW = 4
_VALUES = _WINDOW + 2
# A sequence of values that shrinks more slowly than this per halving is not taken to converge.
_SLOWEST = 0.97
# Differences below this many voxels are constant.
_CONSTANT = 1e-7
# How far growing values are followed, and how fast they must grow per halving to be a pole.
_TAIL, _GROWTH = 8, 1.2
ROUNDING = 1e-12
"""Poles of a lesser coefficient, relative to the size of the values, are rounding errors."""


@dataclass(frozen=True, slots=True)
class Limit:
    """Outcome of one coordinate on one side.

    Attributes
    ----------
    value : float
        The limit, nan if there is none.
    settled : int
        Index of the innermost sample that rounding has not spoiled.
    diverges : bool
        True if there is none because the values grow without bound.

    """

    value: float
    settled: int
    diverges: bool = False


@np.errstate(all="ignore")
def limit(values: Floats) -> Limit:
    """Return the limit of values at distances that halve from one to the next.

    Parameters
    ----------
    values : (n,) float64 array
        In voxels; outermost first. Those from the first that is not finite on are left out.

    """
    finite = np.isfinite(values)
    count = values.size if finite.all() else int(np.argmin(finite))
    values = values[:count]
    if count < _VALUES + 1:
        return Limit(np.nan, 0, diverges=bool(count) and _grows(np.abs(values)))
    step = np.diff(values)
    ratio = step[1:] / step[:-1]
    # Extrapolation from values j, j + 1, j + 2.
    aitken = values[2:] - step[1:] * step[1:] / (step[1:] - step[:-1])
    constant = np.abs(step) <= _CONSTANT + 8 * np.spacing(np.abs(values[1:]))
    level = constant[1:] & constant[:-1]
    aitken = np.where(level, values[2:], aitken)
    good = level | (np.abs(ratio) <= _SLOWEST)
    windows = np.lib.stride_tricks.sliding_window_view
    spread = windows(aitken, _WINDOW)
    agree = windows(good, _WINDOW).all(axis=1)
    agree &= spread.max(axis=1) - spread.min(axis=1) <= AGREEMENT
    if not agree.any():
        return Limit(np.nan, 0, diverges=_grows(np.abs(values)))
    first = int(np.argmax(agree)) + _WINDOW + 1
    value = float(aitken[first - 2])
    # On the way in, values come ever nearer to the limit, until rounding takes over.
    apart = np.abs(values[first:] - value)
    spoiled = apart > np.minimum.accumulate(apart) + PLATEAU
    settled = first + (int(np.argmax(spoiled)) - 1 if spoiled.any() else apart.size - 1)
    if spoiled.any() and _grows(apart):
        grown = apart[-_TAIL:]
        halvings = grown.size - 1
        order = np.log2(grown[-1] / grown[0]) / halvings
        coefficient = grown[-1] * 2.0 ** (-order * (count - 1))
        if coefficient > ROUNDING * (1 + np.abs(values).min()):
            return Limit(np.nan, 0, diverges=True)
    return Limit(value, settled)


def _grows(sizes: Floats) -> bool:
    """Return whether sizes grow steadily over the last halvings: at a pole, or a logarithm's."""
    tail = sizes[-_TAIL:]
    if tail.size < 3:
        return False
    steadily: Bools = tail[1:] > tail[:-1]
    return bool(steadily.all() and tail[-1] > _GROWTH ** (tail.size - 1) * tail[0])

"""Interval enclosures of trigonometric functions: sine, cosine, tangent and their reciprocals.

As in `interval`: bounds of the exact result for all real operands within their bounds. Where an
interval may hold a pole, nothing is known.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from voxdisplay.compute.array_types import Floats
from voxdisplay.expressions.interval import (
    ASSUMED_ULPS,
    ULP,
    Interval,
    divide,
    interval,
    ordered,
    widen,
)

# Sines and cosines are moved by 16 ulp of 1: nothing rests on how exact they are near 0.
_WAVE = ASSUMED_ULPS * ULP


def sin(a: Interval) -> Interval:
    """Return the sine."""
    return _sinusoid(np.sin, a, 0.25)


def cos(a: Interval) -> Interval:
    """Return the cosine."""
    return _sinusoid(np.cos, a, 0.0)


def _sinusoid(function: Callable[[Floats], Floats], a: Interval, crest: float) -> Interval:
    """Bound sine or cosine: 1 at the angle ``crest``, in turns, and -1 half a turn later.

    Between crests and troughs it is monotone, and so is least and greatest at the ends.
    """
    if a.is_point:
        there = function(a.lo)
        lo, hi = there - _WAVE, there + _WAVE
    else:
        lo, hi = ordered(function(a.lo), function(a.hi))
        lo = np.where(_may_contain_integer(a, 2 * np.pi, crest + 0.5), -1.0, lo - _WAVE)
        hi = np.where(_may_contain_integer(a, 2 * np.pi, crest), 1.0, hi + _WAVE)
    return Interval(np.maximum(lo, -1.0), np.minimum(hi, 1.0), a.may_be_undefined)


def tan(a: Interval) -> Interval:
    """Return the tangent; nothing is known where a may have a pole inside."""
    lo, hi = np.tan(a.lo), np.tan(a.hi)
    pole = _may_contain_integer(a, np.pi, 0.5)
    return widen(
        np.where(pole, np.nan, lo), np.where(pole, np.nan, hi), a.may_be_undefined, ASSUMED_ULPS
    )


def sec(a: Interval) -> Interval:
    """Return 1 / cos(a); nothing is known where a may have a pole inside."""
    return divide(interval(1.0), cos(a))


def csc(a: Interval) -> Interval:
    """Return 1 / sin(a); nothing is known where a may have a pole inside."""
    return divide(interval(1.0), sin(a))


def cot(a: Interval) -> Interval:
    """Return the cotangent; nothing is known where a may have a pole inside."""
    lo, hi = 1.0 / np.tan(a.hi), 1.0 / np.tan(a.lo)
    pole = _may_contain_integer(a, np.pi, 0.0)
    lo, hi = np.where(pole, np.nan, lo), np.where(pole, np.nan, hi)
    return widen(lo, hi, a.may_be_undefined, ASSUMED_ULPS)


def _may_contain_integer(a: Interval, period: float, shift: float) -> Any:
    """Return where a / period - shift may hold a whole number; period is 2 pi or pi.

    The quotient's error is under (|q| + 1) 2^-52 for a quotient q: half an ulp each for the
    period and the division, and for taking off a shift of at most 3/4. Where that comes near 1
    the result is True.
    """
    begin, end = a.lo / period - shift, a.hi / period - shift
    begin -= (np.abs(begin) + 1.0) * (4 * ULP)
    end += (np.abs(end) + 1.0) * (4 * ULP)
    return np.floor(end) >= np.ceil(begin)  # False for nan, which stays

"""Interval enclosures of blending functions: clamp, mix, smoothstep.

As in `interval`: bounds of the exact result for all real operands within their bounds.
"""

from __future__ import annotations

import numpy as np

from voxdisplay.expressions.interval import (
    EXACT_ULPS,
    Interval,
    divide,
    interval,
    maximum,
    minimum,
    widen,
)


def clamp(x: Interval, low: Interval, high: Interval) -> Interval:
    """Return min(max(x, low), high)."""
    return minimum(maximum(x, low), high)


def mix(a: Interval, b: Interval, x: Interval) -> Interval:
    """Return a (1 - x) + b x.

    It is linear in x for any a and b, so that it is least and greatest at the ends of x.
    """
    ends = [a * (1.0 - end) + b * end for end in map(interval, (x.lo, x.hi))]
    return Interval(
        np.minimum(ends[0].lo, ends[1].lo),
        np.maximum(ends[0].hi, ends[1].hi),
        a.may_be_undefined | b.may_be_undefined | x.may_be_undefined,
    )


def smoothstep(low: Interval, high: Interval, x: Interval) -> Interval:
    """Return s^2 (3 - 2 s) of the share s that x has of the way from low to high.

    Nothing is known where low and high may be equal. It rises with s throughout.
    """
    share = divide(x - low, high - low)
    # Numbers from 0 to 1 and their products: each of four roundings is below an ulp of 3.
    s_lo, s_hi = np.clip(share.lo, 0.0, 1.0), np.clip(share.hi, 0.0, 1.0)
    out = widen(
        s_lo * s_lo * (3 - 2 * s_lo),
        s_hi * s_hi * (3 - 2 * s_hi),
        share.may_be_undefined,
        8 * EXACT_ULPS,
    )
    return Interval(np.maximum(out.lo, 0.0), np.minimum(out.hi, 1.0), out.may_be_undefined)

"""Interval enclosures of discontinuous functions: rounding, sign, remainder, comparisons, choice.

As in `interval`: bounds of the exact result for all real operands within their bounds. A step
inside an interval widens the bounds; it does not make them unknown.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from voxdisplay.expressions.interval import Interval, divide

if TYPE_CHECKING:
    from collections.abc import Callable

    from voxdisplay.compute.array_types import Bools, Floats


def _exact_increasing(function: Callable[[Floats], Floats], a: Interval) -> Interval:
    """Bound a function that never falls and is computed without rounding."""
    return Interval(function(a.lo), function(a.hi), a.may_be_undefined)


def sign(a: Interval) -> Interval:
    """Return -1, 0 or 1."""
    return _exact_increasing(np.sign, a)


def floor(a: Interval) -> Interval:
    """Return the greatest whole number that is not above a."""
    return _exact_increasing(np.floor, a)


def ceil(a: Interval) -> Interval:
    """Return the least whole number that is not below a."""
    return _exact_increasing(np.ceil, a)


def round_half_even(a: Interval) -> Interval:
    """Return the nearest whole number, of two the even one."""
    return _exact_increasing(np.rint, a)


def mod(a: Interval, b: Interval) -> Interval:
    """Return a - b floor(a / b), of the sign of b; nothing is known where b has 0 inside."""
    quotient = divide(a, b)
    low, high = np.floor(quotient.lo), np.floor(quotient.hi)
    # Without a step inside, this is the remainder itself; with one, it reaches from 0 to b and on.
    inside = a - b * Interval(low, high)
    unknown = np.isnan(low + high)
    lo = np.maximum(inside.lo, np.minimum(b.lo, 0.0))
    hi = np.minimum(inside.hi, np.maximum(b.hi, 0.0))
    undefined = a.may_be_undefined | b.may_be_undefined
    return Interval(np.where(unknown, np.nan, lo), np.where(unknown, np.nan, hi), undefined)


# ------------------------------------------------------------------- truth: 0, 1, or either


def _truth(yes: Bools, no: Bools, a: Interval, b: Interval) -> Interval:
    unknown = np.isnan(a.lo + a.hi) | np.isnan(b.lo + b.hi)
    # Infinite bounds of opposite signs add up to nan, and are known.
    unknown &= np.isnan(a.lo) | np.isnan(a.hi) | np.isnan(b.lo) | np.isnan(b.hi)
    lo = np.where(unknown, np.nan, np.where(yes, 1.0, 0.0))
    hi = np.where(unknown, np.nan, np.where(no, 0.0, 1.0))
    return Interval(lo, hi, a.may_be_undefined | b.may_be_undefined)


def less(a: Interval, b: Interval) -> Interval:
    """Return whether a < b."""
    return _truth(a.hi < b.lo, a.lo >= b.hi, a, b)


def less_equal(a: Interval, b: Interval) -> Interval:
    """Return whether a <= b."""
    return _truth(a.hi <= b.lo, a.lo > b.hi, a, b)


def greater(a: Interval, b: Interval) -> Interval:
    """Return whether a > b."""
    return less(b, a)


def greater_equal(a: Interval, b: Interval) -> Interval:
    """Return whether a >= b."""
    return less_equal(b, a)


def equal(a: Interval, b: Interval) -> Interval:
    """Return whether a == b."""
    same = (a.lo == a.hi) & (b.lo == b.hi) & (a.lo == b.lo)
    return _truth(same, (a.hi < b.lo) | (b.hi < a.lo), a, b)


def not_equal(a: Interval, b: Interval) -> Interval:
    """Return whether a != b."""
    same = (a.lo == a.hi) & (b.lo == b.hi) & (a.lo == b.lo)
    return _truth((a.hi < b.lo) | (b.hi < a.lo), same, a, b)


def select(condition: Interval, a: Interval, b: Interval) -> Interval:
    """Return a where a condition holds, else b; the hull of both where it may or may not."""
    yes, no = condition.lo > 0, condition.hi <= 0
    unknown = np.isnan(condition.lo) | np.isnan(condition.hi)

    def chosen(of_a: Floats, of_b: Floats, both: Floats) -> Any:
        return np.where(unknown, np.nan, np.where(yes, of_a, np.where(no, of_b, both)))

    undefined = condition.may_be_undefined | (a.may_be_undefined & ~no)
    return Interval(
        chosen(a.lo, b.lo, np.minimum(a.lo, b.lo)),
        chosen(a.hi, b.hi, np.maximum(a.hi, b.hi)),
        undefined | (b.may_be_undefined & ~yes),
    )

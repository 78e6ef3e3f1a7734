"""Interval arithmetic with outward rounding: bounds of formulas over ranges of their variable.

Every operation here returns bounds of the *exact* result for all real operands within their bounds
(Moore, *Interval Analysis*, 1966), for arrays of intervals at once. What float64 gets wrong is
made up for by rounding outward:

- ``+ - * /`` and ``sqrt`` are correctly rounded (IEEE 754, section 5.4): off by half a unit in
  the last place (ulp). Bounds are moved by one ulp or more.
- Of other functions nobody promises that. They are assumed to be off by at most 4 ulp: that is
  what the vector library inside numpy is built for, and more than what is known of C libraries
  (GNU C library manual, "Known Maximum Errors in Math Functions"; Zimmermann et al., "Accuracy of
  Mathematical Functions in Single, Double, Double Extended, and Quadruple Precision"). Bounds are
  moved by 16 ulp or more. The tests measure the errors with multiple precision.

So bounds hold what numpy evaluates within them, as well: 16 ulp are more than twice 4.

If either bound is not a number, nothing is known, as after a division by an interval with 0
inside; that spreads to all that is computed from it. numpy's warnings on the way have no meaning:
callers silence them (``np.errstate``). This module must not know expressions or curves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from voxdisplay.compute.array_types import Floats

ULP = 2.0**-52  # |x| * ULP is from one to two ulp of x
_TINY = 5e-324  # the ulp of numbers so small that the product above is 0
_LARGEST = np.finfo(np.float64).max
EXACT_ULPS, ASSUMED_ULPS = 1, 16  # ulp to move bounds by: see above
_PI = 3.1415926535897936  # the float64 above pi


@dataclass(frozen=True, slots=True, eq=False)
class Interval:
    """Real numbers from ``lo`` to ``hi``, or arrays of such.

    Attributes
    ----------
    lo, hi : float64 arrays
        Of shapes that broadcast; possibly infinite, but lo never inf nor hi -inf. One of them nan
        where nothing is known.
    partial : bool array, or False
        True where some operands within their bounds have no result, such as square roots of
        intervals that begin below 0: the bounds are of the results there are.

    """

    lo: Floats
    hi: Floats
    may_be_undefined: Any = False

    __array_ufunc__ = None  # so that arrays leave operations with intervals to the intervals

    @property
    def is_point(self) -> bool:
        """True if it was made of numbers: both bounds are the same array."""
        return self.lo is self.hi

    def __add__(self, other: Interval | ArrayLike) -> Interval:
        return add(self, interval(other))

    def __radd__(self, other: ArrayLike) -> Interval:
        return add(interval(other), self)

    def __sub__(self, other: Interval | ArrayLike) -> Interval:
        return subtract(self, interval(other))

    def __rsub__(self, other: ArrayLike) -> Interval:
        return subtract(interval(other), self)

    def __mul__(self, other: Interval | ArrayLike) -> Interval:
        return multiply(self, interval(other))

    def __rmul__(self, other: ArrayLike) -> Interval:
        return multiply(interval(other), self)

    def __truediv__(self, other: Interval | ArrayLike) -> Interval:
        return divide(self, interval(other))


def interval(value: Interval | ArrayLike) -> Interval:
    """Return the degenerate interval of numbers; an interval stays what it is."""
    if isinstance(value, Interval):
        return value
    number = np.asarray(value, dtype=np.float64)
    return Interval(number, number)


def widen(lo: Floats, hi: Floats, partial: Any, ulps: int) -> Interval:
    """Move bounds outward by some ulp. An overflowed lower bound is the largest finite number."""
    lo, hi = np.minimum(lo, _LARGEST), np.maximum(hi, -_LARGEST)
    return Interval(
        lo - (np.abs(lo) * (ulps * ULP) + ulps * _TINY),
        hi + (np.abs(hi) * (ulps * ULP) + ulps * _TINY),
        partial,
    )


# ---------------------------------------------------------------------------- arithmetic


def negate(a: Interval) -> Interval:
    """Return -a."""
    return Interval(-a.hi, -a.lo, a.may_be_undefined)


def _sum(lo: Floats, hi: Floats, partial: Any) -> Interval:
    # Sums too small for a normal exponent are exact (Hauser 1996), 0 above all.
    lo, hi = np.minimum(lo, _LARGEST), np.maximum(hi, -_LARGEST)
    return Interval(lo - np.abs(lo) * ULP, hi + np.abs(hi) * ULP, partial)


def add(a: Interval, b: Interval) -> Interval:
    """Return a + b."""
    return _sum(a.lo + b.lo, a.hi + b.hi, a.may_be_undefined | b.may_be_undefined)


def subtract(a: Interval, b: Interval) -> Interval:
    """Return a - b."""
    return _sum(a.lo - b.hi, a.hi - b.lo, a.may_be_undefined | b.may_be_undefined)


def multiply(a: Interval, b: Interval) -> Interval:
    """Return a b. An interval times itself (the same object) is its square."""
    if a is b:
        return _whole_power(a, 2.0)
    if a.is_point:
        a, b = b, a
    lo, hi = ordered(a.lo * b.lo, a.hi * b.lo)
    if not b.is_point:
        others = ordered(a.lo * b.hi, a.hi * b.hi)
        lo, hi = np.minimum(lo, others[0]), np.maximum(hi, others[1])
    return widen(lo, hi, a.may_be_undefined | b.may_be_undefined, EXACT_ULPS)


def divide(a: Interval, b: Interval) -> Interval:
    """Return a / b; nothing is known where b has 0 inside."""
    bottom = np.where((b.lo > 0) | (b.hi < 0), b.lo, np.nan)
    lo, hi = ordered(a.lo / bottom, a.hi / bottom)
    if not b.is_point:
        others = ordered(a.lo / b.hi, a.hi / b.hi)
        lo, hi = np.minimum(lo, others[0]), np.maximum(hi, others[1])
    return widen(lo, hi, a.may_be_undefined | b.may_be_undefined, EXACT_ULPS)


def ordered(one: Floats, other: Floats) -> tuple[Floats, Floats]:
    """Return the lesser and the greater of two arrays, elementwise."""
    return np.minimum(one, other), np.maximum(one, other)


def absolute(a: Interval) -> Interval:
    """Return |a|."""
    return Interval(_least_magnitude(a), np.maximum(np.abs(a.lo), np.abs(a.hi)), a.may_be_undefined)


def _least_magnitude(a: Interval) -> Floats:
    """Return the least |x| of the x in a."""
    return np.maximum(np.maximum(a.lo, -a.hi), 0.0)


def minimum(a: Interval, b: Interval) -> Interval:
    """Return the smaller of a and b."""
    return Interval(
        np.minimum(a.lo, b.lo), np.minimum(a.hi, b.hi), a.may_be_undefined | b.may_be_undefined
    )


def maximum(a: Interval, b: Interval) -> Interval:
    """Return the greater of a and b."""
    return Interval(
        np.maximum(a.lo, b.lo), np.maximum(a.hi, b.hi), a.may_be_undefined | b.may_be_undefined
    )


# ---------------------------------------------------------------------------- powers


def power(a: Interval, b: Interval) -> Interval:
    """Return a to the power of b, with 0**0 = 1, as numpy does.

    A whole constant exponent takes any base, though a negative one none with 0 inside. With other
    exponents there is a value only for bases above 0, and for 0 if the exponent is positive;
    bases below 0 under a varying exponent have values here and there, of which nothing is known.
    """
    if b.is_point and b.lo.ndim == 0:
        exponent = float(b.lo)
        if exponent.is_integer():
            return _whole_power(a, exponent)
        a = _clip_to_domain(a, 0.0, np.inf)
    # The power is monotone in base and exponent, each if the other is held: so it is least and
    # greatest at corners. To numpy nan**0 and 1**nan are 1: what is unknown must be kept out.
    known = ((a.lo > 0) | ((a.lo == 0) & (b.lo > 0))) & ~np.isnan(b.lo + a.hi + b.hi)
    lo, hi = ordered(a.lo**b.lo, a.hi**b.lo)
    if not b.is_point:
        others = ordered(a.lo**b.hi, a.hi**b.hi)
        lo, hi = np.minimum(lo, others[0]), np.maximum(hi, others[1])
    lo, hi = np.where(known, lo, np.nan), np.where(known, hi, np.nan)
    out = widen(lo, hi, a.may_be_undefined | b.may_be_undefined, ASSUMED_ULPS)
    return Interval(np.maximum(out.lo, 0.0), out.hi, out.may_be_undefined)


def _whole_power(a: Interval, exponent: float) -> Interval:
    if exponent == 0:
        one = np.where(np.isnan(a.lo), np.nan, 1.0)
        return Interval(one, one, a.may_be_undefined)
    if exponent < 0:
        return divide(interval(1.0), _whole_power(a, -exponent))
    if exponent % 2 == 1:
        return widen(a.lo**exponent, a.hi**exponent, a.may_be_undefined, ASSUMED_ULPS)
    size = absolute(a)
    if exponent == 2:  # a product
        out = widen(size.lo * size.lo, size.hi * size.hi, a.may_be_undefined, EXACT_ULPS)
    else:
        out = widen(size.lo**exponent, size.hi**exponent, a.may_be_undefined, ASSUMED_ULPS)
    return Interval(np.maximum(out.lo, 0.0), out.hi, out.may_be_undefined)


def sqrt(a: Interval) -> Interval:
    """Return the square root of what is not negative in a."""
    a = _clip_to_domain(a, 0.0, np.inf)
    out = widen(np.sqrt(a.lo), np.sqrt(a.hi), a.may_be_undefined, EXACT_ULPS)
    return Interval(np.maximum(out.lo, 0.0), out.hi, out.may_be_undefined)


def _clip_to_domain(a: Interval, low: float, high: float) -> Interval:
    """Cut a down to what is from low to high; nothing is known where there is nothing left."""
    outside = (a.lo < low) | (a.hi > high)
    if not outside.any():
        return a
    empty = (a.hi < low) | (a.lo > high)
    lo = np.where(empty, np.nan, np.clip(a.lo, low, high))
    hi = np.where(empty, np.nan, np.clip(a.hi, low, high))
    return Interval(lo, hi, a.may_be_undefined | outside)


# ---------------------------------------------------------------------------- functions


def _increasing(
    function: Callable[[Floats], Floats], a: Interval, low: float = -np.inf, high: float = np.inf
) -> Interval:
    """Bound an increasing function whose values are from low to high."""
    out = widen(function(a.lo), function(a.hi), a.may_be_undefined, ASSUMED_ULPS)
    return Interval(np.maximum(out.lo, low), np.minimum(out.hi, high), out.may_be_undefined)


def exp(a: Interval) -> Interval:
    """Return e**a."""
    return _increasing(np.exp, a, low=0.0)


def log(a: Interval) -> Interval:
    """Return the natural logarithm of what is positive in a."""
    return _increasing(np.log, _clip_to_domain(a, 0.0, np.inf))


def log10(a: Interval) -> Interval:
    """Return the logarithm of base 10 of what is positive in a."""
    return _increasing(np.log10, _clip_to_domain(a, 0.0, np.inf))


def log2(a: Interval) -> Interval:
    """Return the logarithm of base 2 of what is positive in a."""
    return _increasing(np.log2, _clip_to_domain(a, 0.0, np.inf))


def cbrt(a: Interval) -> Interval:
    """Return the cube root."""
    return _increasing(np.cbrt, a)


def sinh(a: Interval) -> Interval:
    """Return the hyperbolic sine."""
    return _increasing(np.sinh, a)


def cosh(a: Interval) -> Interval:
    """Return the hyperbolic cosine."""
    return _increasing(np.cosh, absolute(a), low=1.0)


def tanh(a: Interval) -> Interval:
    """Return the hyperbolic tangent."""
    return _increasing(np.tanh, a, -1.0, 1.0)


def asinh(a: Interval) -> Interval:
    """Return the inverse hyperbolic sine."""
    return _increasing(np.arcsinh, a)


def acosh(a: Interval) -> Interval:
    """Return the inverse hyperbolic cosine of what is at least 1 in a."""
    return _increasing(np.arccosh, _clip_to_domain(a, 1.0, np.inf), low=0.0)


def atanh(a: Interval) -> Interval:
    """Return the inverse hyperbolic tangent of what is from -1 to 1 in a."""
    return _increasing(np.arctanh, _clip_to_domain(a, -1.0, 1.0))


def asin(a: Interval) -> Interval:
    """Return the arc sine of what is from -1 to 1 in a."""
    return _increasing(np.arcsin, _clip_to_domain(a, -1.0, 1.0))


def acos(a: Interval) -> Interval:
    """Return the arc cosine of what is from -1 to 1 in a."""
    a = _clip_to_domain(a, -1.0, 1.0)
    out = widen(np.arccos(a.hi), np.arccos(a.lo), a.may_be_undefined, ASSUMED_ULPS)
    return Interval(np.maximum(out.lo, 0.0), out.hi, out.may_be_undefined)


def atan(a: Interval) -> Interval:
    """Return the arc tangent."""
    return _increasing(np.arctan, a)


def hypot(a: Interval, b: Interval) -> Interval:
    """Return sqrt(a**2 + b**2)."""
    a, b = absolute(a), absolute(b)
    out = widen(
        np.hypot(a.lo, b.lo),
        np.hypot(a.hi, b.hi),
        a.may_be_undefined | b.may_be_undefined,
        ASSUMED_ULPS,
    )
    return Interval(np.maximum(out.lo, 0.0), out.hi, out.may_be_undefined)


def atan2(y: Interval, x: Interval) -> Interval:
    """Return the angle of (x, y), from -pi to pi.

    Seen from outside a rectangle, the greatest and the least angle are those of corners. If the
    rectangle reaches the half line where the angle jumps, or the origin, the angle is anything.
    """
    corners = [np.arctan2(b, a) for a in (x.lo, x.hi) for b in (y.lo, y.hi)]
    lo, hi = corners[0], corners[0]
    for corner in corners[1:]:
        lo, hi = np.minimum(lo, corner), np.maximum(hi, corner)
    jumps = (y.lo <= 0) & (y.hi >= 0) & (x.lo <= 0)
    out = widen(
        np.where(jumps, -_PI, lo),
        np.where(jumps, _PI, hi),
        y.may_be_undefined | x.may_be_undefined,
        ASSUMED_ULPS,
    )
    # The comparisons above are False for nan; corners are nan then.
    unknown = np.isnan(lo)
    if not unknown.any():
        return out
    return Interval(
        np.where(unknown, np.nan, out.lo), np.where(unknown, np.nan, out.hi), out.may_be_undefined
    )

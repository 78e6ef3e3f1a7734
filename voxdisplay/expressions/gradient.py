"""Interval enclosures of gradients: forward-mode differentiation over intervals.

By the mean value theorem, a function whose gradient has bounds over a box differs there from a
linear one by no more than they allow. At kinks, as of ``abs``, bounds hold the slopes of both
sides; across steps, as of ``floor``, and where a function may lack a value, nothing is known. Must
not know what is bounded.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from voxdisplay.expressions import interval as arithmetic
from voxdisplay.expressions import step_intervals as steps
from voxdisplay.expressions import trigonometric_intervals as waves
from voxdisplay.expressions.interval import Interval, divide, interval, multiply, negate
from voxdisplay.expressions.operations import IF, Operation
from voxdisplay.expressions.program import Expression

_Partial = Callable[..., Interval]
# A value and its derivatives; None is an exact zero.
_Dual = tuple[Interval, tuple[Interval | None, ...]]

_ONE, _MINUS_ONE = interval(1.0), interval(-1.0)
_UNKNOWN = Interval(np.array(np.nan), np.array(np.nan))


def gradient_enclosure(
    expression: Expression, *variables: Interval
) -> tuple[Interval, tuple[Interval, ...]]:
    """Return bounds of an expression, and of its derivatives by its variables, over boxes.

    Parameters
    ----------
    expression : Expression
    *variables : Interval
        Of (n,) arrays each.

    Returns
    -------
    Interval, tuple of Interval
        Of (n,) arrays; nan where nothing is known, as where there may be no value.

    """
    duals: list[_Dual] = [
        (each, tuple(_ONE if i == j else None for j in range(len(variables))))
        for i, each in enumerate(variables)
    ]
    nothing = (None,) * len(variables)
    with np.errstate(all="ignore"):
        value, slopes = expression.fold(
            duals, lambda number: (interval(number), nothing), _chain_rule
        )
    shape = variables[0].lo.shape
    lost = np.broadcast_to(value.may_be_undefined, shape)
    return _spread(value, shape, lost), tuple(
        _spread(interval(0.0) if slope is None else slope, shape, lost) for slope in slopes
    )


def _spread(bounds: Interval, shape: tuple[int, ...], lost: Any) -> Interval:
    return Interval(np.where(lost, np.nan, bounds.lo) + np.zeros(shape),
                    np.where(lost, np.nan, bounds.hi) + np.zeros(shape))  # fmt: skip


def _chain_rule(operation: Operation, operands: tuple[_Dual, ...]) -> _Dual:
    values = [value for value, _ in operands]
    result = operation.enclosure(*values)
    if operation is IF:
        return result, _of_choice(values[0], *(slopes for _, slopes in operands[1:]))
    partials = _PARTIALS.get((operation.name, operation.arity))
    factors: dict[int, Interval] = {}
    slopes: list[Interval | None] = []
    for row in zip(*(slopes for _, slopes in operands), strict=True):
        total: Interval | None = None
        for k, slope in enumerate(row):
            if slope is None:
                continue
            if k not in factors:
                factors[k] = _UNKNOWN if partials is None else partials[k](result, *values)
            term = _times(factors[k], slope)
            total = term if total is None else total + term
        slopes.append(total)
    return result, tuple(slopes)


def _times(factor: Interval, slope: Interval) -> Interval:
    if factor is _ONE:
        return slope
    if slope is _ONE:
        return factor
    if factor is _MINUS_ONE:
        return negate(slope)
    return multiply(factor, slope)


# ------------------------------------------------------- derivatives by single operands


def _one(*_: Interval) -> Interval:
    return _ONE


def _minus_one(*_: Interval) -> Interval:
    return _MINUS_ONE


def _square(a: Interval) -> Interval:
    return multiply(a, a)


def _sign(_: Interval, a: Interval) -> Interval:
    """Return the slope of |a|: at its kink, both sides'."""
    return steps.sign(a)


def _flat_between_steps(result: Interval, *_: Interval) -> Interval:
    """Return 0 where a function with steps has none inside; else nothing is known."""
    still = np.where(result.lo == result.hi, 0.0, np.nan)
    return Interval(still, still)


def _mod_by_dividend(_: Interval, a: Interval, b: Interval) -> Interval:
    quotient = divide(a, b)
    still = np.where(np.floor(quotient.lo) == np.floor(quotient.hi), 1.0, np.nan)
    return Interval(still, still)


def _mod_by_divisor(_: Interval, a: Interval, b: Interval) -> Interval:
    quotient = divide(a, b)
    low, high = np.floor(quotient.lo), np.floor(quotient.hi)
    still = np.where(low == high, -low, np.nan)
    return Interval(still, still)


def _where_less(_: Interval, a: Interval, b: Interval) -> Interval:
    return _share(steps.less(a, b))


def _where_not_less(_: Interval, a: Interval, b: Interval) -> Interval:
    return _share(steps.greater_equal(a, b))


def _share(truth: Interval) -> Interval:
    """Return from 0 to 1: the slopes of both sides of a kink, and all between."""
    return Interval(truth.lo, truth.hi)


def _power_by_base(result: Interval, a: Interval, b: Interval) -> Interval:
    del result
    if b.is_point and b.lo.ndim == 0:
        exponent = float(b.lo)
        if exponent == 0:
            return interval(0.0)
        if exponent == 1:
            return _ONE
        return interval(exponent) * arithmetic.power(a, interval(exponent - 1))
    return b * arithmetic.power(a, b - 1.0)


def _power_by_exponent(result: Interval, a: Interval, _: Interval) -> Interval:
    return result * arithmetic.log(a)


def _towards(result: Interval, a: Interval) -> Interval:
    """Return a / hypot(a, b), which is from -1 to 1 wherever it is defined, and near the origin."""
    ratio = divide(a, result)
    return Interval(np.fmax(ratio.lo, -1.0), np.fmin(ratio.hi, 1.0))


def _angle(numerator: Interval, y: Interval, x: Interval) -> Interval:
    """Return a derivative of atan2; nothing is known across the half line where it jumps."""
    found = divide(numerator, _square(x) + _square(y))
    jumps = (y.lo <= 0) & (y.hi >= 0) & (x.lo <= 0)
    return Interval(np.where(jumps, np.nan, found.lo), np.where(jumps, np.nan, found.hi))


def _of_choice(
    condition: Interval, a: tuple[Interval | None, ...], b: tuple[Interval | None, ...]
) -> tuple[Interval | None, ...]:
    """Return the slopes of what is chosen; nothing is known where it may be either."""
    either = condition.lo != condition.hi
    slopes: list[Interval | None] = []
    for pair in zip(a, b, strict=True):
        if pair == (None, None):
            slopes.append(None if not either.any() else _UNKNOWN)
            continue
        one, other = (interval(0.0) if each is None else each for each in pair)
        chosen = steps.select(condition, one, other)
        slopes.append(
            Interval(np.where(either, np.nan, chosen.lo), np.where(either, np.nan, chosen.hi))
        )
    return tuple(slopes)


def _clamp_by_value(_: Interval, x: Interval, low: Interval, high: Interval) -> Interval:
    inside, outside = (x.lo >= low.hi) & (x.hi <= high.lo), (x.hi < low.lo) | (x.lo > high.hi)
    return Interval(np.where(inside, 1.0, 0.0), np.where(outside, 0.0, 1.0))


def _zero_to_one(*_: Interval) -> Interval:
    return Interval(np.array(0.0), np.array(1.0))


def _smoothstep_by_value(_: Interval, low: Interval, high: Interval, x: Interval) -> Interval:
    share = divide(x - low, high - low)
    s = Interval(np.clip(share.lo, 0.0, 1.0), np.clip(share.hi, 0.0, 1.0))
    rise = 6.0 * (s * (1.0 - s))
    return divide(Interval(np.maximum(rise.lo, 0.0), np.minimum(rise.hi, 1.5 + 1e-9)), high - low)


def _unknown(*_: Interval) -> Interval:
    return _UNKNOWN


def _reciprocal(a: Interval) -> Interval:
    return divide(_ONE, a)


def _over_log(base: float) -> _Partial:
    return lambda _, a: divide(interval(1 / np.log(base)), a)


def _arc(sign: float) -> _Partial:
    return lambda _, a: divide(interval(sign), arithmetic.sqrt(1.0 - _square(a)))


_PARTIALS: dict[tuple[str, int], tuple[_Partial, ...]] = {
    ("-", 1): (_minus_one,),
    ("+", 2): (_one, _one),
    ("-", 2): (_one, _minus_one),
    ("*", 2): (lambda _r, _a, b: b, lambda _r, a, _b: a),
    ("/", 2): (lambda _r, _a, b: _reciprocal(b), lambda r, _a, b: negate(divide(r, b))),
    ("**", 2): (_power_by_base, _power_by_exponent),
    ("sin", 1): (lambda _, a: waves.cos(a),),
    ("cos", 1): (lambda _, a: negate(waves.sin(a)),),
    ("tan", 1): (lambda r, _: 1.0 + _square(r),),
    ("sec", 1): (lambda r, a: r * waves.tan(a),),
    ("csc", 1): (lambda r, a: negate(divide(r, waves.tan(a))),),
    ("cot", 1): (lambda r, _: -1.0 - _square(r),),
    ("asin", 1): (_arc(1.0),),
    ("acos", 1): (_arc(-1.0),),
    ("atan", 1): (lambda _, a: _reciprocal(1.0 + _square(a)),),
    ("atan2", 2): (
        lambda _, y, x: _angle(x, y, x),
        lambda _, y, x: _angle(negate(y), y, x),
    ),
    ("sinh", 1): (lambda _, a: arithmetic.cosh(a),),
    ("cosh", 1): (lambda _, a: arithmetic.sinh(a),),
    ("tanh", 1): (lambda r, _: 1.0 - _square(r),),
    ("asinh", 1): (lambda _, a: _reciprocal(arithmetic.hypot(a, _ONE)),),
    ("acosh", 1): (lambda _, a: _reciprocal(arithmetic.sqrt(_square(a) - 1.0)),),
    ("atanh", 1): (lambda _, a: _reciprocal(1.0 - _square(a)),),
    ("exp", 1): (lambda r, _: r,),
    ("log", 1): (lambda _, a: _reciprocal(a),),
    ("ln", 1): (lambda _, a: _reciprocal(a),),
    ("log10", 1): (_over_log(10.0),),
    ("log2", 1): (_over_log(2.0),),
    ("sqrt", 1): (lambda r, _: divide(interval(0.5), r),),
    ("cbrt", 1): (lambda r, _: _reciprocal(3.0 * _square(r)),),
    ("hypot", 2): (lambda r, a, _: _towards(r, a), lambda r, _, b: _towards(r, b)),
    ("abs", 1): (_sign,),
    ("sign", 1): (_flat_between_steps,),
    ("floor", 1): (_flat_between_steps,),
    ("ceil", 1): (_flat_between_steps,),
    ("round", 1): (_flat_between_steps,),
    ("mod", 2): (_mod_by_dividend, _mod_by_divisor),
    ("min", 2): (_where_less, _where_not_less),
    ("max", 2): (_where_not_less, _where_less),
    ("clamp", 3): (_clamp_by_value, _zero_to_one, _zero_to_one),
    ("smoothstep", 3): (_unknown, _unknown, _smoothstep_by_value),
    ("mix", 3): (
        lambda _r, _a, _b, x: 1.0 - x,
        lambda _r, _a, _b, x: x,
        lambda _r, a, b, _x: b - a,
    ),
} | {(name, 2): (_flat_between_steps,) * 2 for name in ("<", "<=", ">", ">=", "==", "!=")}

"""Operations of expressions: value, enclosure and derivative of each.

One row per operation, so that another way of computing is another column. Knows numpy's functions
and those of intervals; must not know how expressions are written or stored.

Everything is float64 and nothing raises: ``9**9**9`` is inf, ``log(-1)`` is nan.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from voxdisplay.expressions import blend_intervals, interval, step_intervals
from voxdisplay.expressions import trigonometric_intervals as trigonometric

if TYPE_CHECKING:
    from collections.abc import Callable

    from voxdisplay.expressions.interval import Interval


def _never(_: float) -> bool:
    return False


@dataclass(frozen=True, slots=True, eq=False)
class Operation:
    """One operation on float64 arrays.

    Attributes
    ----------
    name : str
        Its name in messages and, if it is a function, in expressions.
    value : callable
        ``value(*operands)``, elementwise.
    enclosure : callable
        ``enclosure(*operands)``, of and to `Interval`: bounds of the values, elementwise.
    partials : tuple of callables
        One for each operand: ``partial(result, *operands)`` is the derivative of the result with
        respect to it, elementwise. Not finite where there is none.
    variadic : bool
        An associative operation of two operands, which may be written with more.
    singular : bool
        True if it may have no value, or an infinite one, at single operands: a divisor of 0.
    defined_for : callable
        Of a singular operation: whether a constant last operand keeps it from that.
    arity : int
        Number of operands.

    """

    name: str
    value: Callable[..., Any]
    enclosure: Callable[..., Interval]
    partials: tuple[Callable[..., Any], ...]
    variadic: bool = False
    singular: bool = False
    defined_for: Callable[[float], bool] = _never
    arity: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "arity", len(self.partials))

    def __reduce__(self) -> tuple[Callable[[str, int], Operation], tuple[str, int]]:
        return _operation, (self.name, self.arity)


def _operation(name: str, arity: int) -> Operation:
    """Return an operation by its name: what pickles hold of it."""
    return _BY_NAME[name, arity]


def _zero(*_: Any) -> float:
    return 0.0


def _clamp(x: Any, low: Any, high: Any) -> Any:
    return np.minimum(np.maximum(x, low), high)


def _mix(a: Any, b: Any, x: Any) -> Any:
    return a * (1 - x) + b * x  # exact at both ends, which a + (b - a)*x is not


def _share(low: Any, high: Any, x: Any) -> Any:
    return _clamp((x - low) / (high - low), 0.0, 1.0)


def _smoothstep(low: Any, high: Any, x: Any) -> Any:
    share = _share(low, high, x)
    return share * share * (3 - 2 * share)


def _smoothstep_slope(low: Any, high: Any, x: Any) -> Any:
    share = _share(low, high, x)
    return 6 * share * (1 - share) / (high - low)


def _power_by_base(_: Any, a: Any, b: Any) -> Any:
    return np.where(b == 0, 0.0, b * a ** (b - 1))  # at a == 0, b == 0 the product is 0 * inf


def _power_by_exponent(r: Any, a: Any, _: Any) -> Any:
    return np.where(a == 0, 0.0, r * np.log(a))  # 0**b is flat wherever it is finite


NEGATE = Operation("-", np.negative, interval.negate, (lambda _r, _a: -1.0,))
ADD = Operation("+", np.add, interval.add, (lambda _r, _a, _b: 1.0, lambda _r, _a, _b: 1.0))
SUBTRACT = Operation(
    "-", np.subtract, interval.subtract, (lambda _r, _a, _b: 1.0, lambda _r, _a, _b: -1.0)
)
MULTIPLY = Operation(
    "*", np.multiply, interval.multiply, (lambda _r, _a, b: b, lambda _r, a, _b: a)
)
DIVIDE = Operation(
    "/",
    np.divide,
    interval.divide,
    (lambda _r, _a, b: 1 / b, lambda r, _a, b: -r / b),
    singular=True,
    defined_for=lambda divisor: divisor != 0,
)
# The operator, not np.power: it takes squares and roots by the faster and exacter route.
POWER = Operation(
    "**",
    lambda a, b: a**b,
    interval.power,
    (_power_by_base, _power_by_exponent),
    singular=True,
    defined_for=lambda exponent: exponent >= 0,
)
IF = Operation(
    "if",
    np.where,
    step_intervals.select,
    (
        _zero,
        lambda _, condition, _a, _b: np.where(condition, 1.0, 0.0),
        lambda _, condition, _a, _b: np.where(condition, 0.0, 1.0),
    ),
)

COMPARISONS = {
    operation.name: operation
    for operation in (
        Operation("<", np.less, step_intervals.less, (_zero, _zero)),
        Operation("<=", np.less_equal, step_intervals.less_equal, (_zero, _zero)),
        Operation(">", np.greater, step_intervals.greater, (_zero, _zero)),
        Operation(">=", np.greater_equal, step_intervals.greater_equal, (_zero, _zero)),
        Operation("==", np.equal, step_intervals.equal, (_zero, _zero)),
        Operation("!=", np.not_equal, step_intervals.not_equal, (_zero, _zero)),
    )
}

FUNCTIONS = {
    operation.name: operation
    for operation in (
        Operation("sin", np.sin, trigonometric.sin, (lambda _, a: np.cos(a),)),
        Operation("cos", np.cos, trigonometric.cos, (lambda _, a: -np.sin(a),)),
        Operation("tan", np.tan, trigonometric.tan, (lambda r, _: 1 + r * r,), singular=True),
        Operation(
            "sec",
            lambda a: 1 / np.cos(a),
            trigonometric.sec,
            (lambda r, a: r * np.tan(a),),
            singular=True,
        ),
        Operation(
            "csc",
            lambda a: 1 / np.sin(a),
            trigonometric.csc,
            (lambda r, a: -r / np.tan(a),),
            singular=True,
        ),
        Operation(
            "cot",
            lambda a: 1 / np.tan(a),
            trigonometric.cot,
            (lambda r, _: -1 - r * r,),
            singular=True,
        ),
        Operation("asin", np.arcsin, interval.asin, (lambda _, a: 1 / np.sqrt(1 - a * a),)),
        Operation("acos", np.arccos, interval.acos, (lambda _, a: -1 / np.sqrt(1 - a * a),)),
        Operation("atan", np.arctan, interval.atan, (lambda _, a: 1 / (1 + a * a),)),
        Operation(
            "atan2",
            np.arctan2,
            interval.atan2,
            (lambda _, y, x: x / (x * x + y * y), lambda _, y, x: -y / (x * x + y * y)),
        ),
        Operation("sinh", np.sinh, interval.sinh, (lambda _, a: np.cosh(a),)),
        Operation("cosh", np.cosh, interval.cosh, (lambda _, a: np.sinh(a),)),
        Operation("tanh", np.tanh, interval.tanh, (lambda r, _: 1 - r * r,)),
        Operation("asinh", np.arcsinh, interval.asinh, (lambda _, a: 1 / np.hypot(a, 1.0),)),
        Operation("acosh", np.arccosh, interval.acosh, (lambda _, a: 1 / np.sqrt(a * a - 1),)),
        Operation(
            "atanh", np.arctanh, interval.atanh, (lambda _, a: 1 / (1 - a * a),), singular=True
        ),
        Operation("exp", np.exp, interval.exp, (lambda r, _: r,)),
        Operation("log", np.log, interval.log, (lambda _, a: 1 / a,), singular=True),
        Operation("ln", np.log, interval.log, (lambda _, a: 1 / a,), singular=True),
        Operation(
            "log10",
            np.log10,
            interval.log10,
            (lambda _, a: 1 / (a * np.log(10.0)),),
            singular=True,
        ),
        Operation(
            "log2", np.log2, interval.log2, (lambda _, a: 1 / (a * np.log(2.0)),), singular=True
        ),
        Operation("sqrt", np.sqrt, interval.sqrt, (lambda r, _: 0.5 / r,)),
        Operation("cbrt", np.cbrt, interval.cbrt, (lambda r, _: 1 / (3 * r * r),)),
        Operation(
            "hypot",
            np.hypot,
            interval.hypot,
            (lambda r, a, _: a / r, lambda r, _, b: b / r),
            variadic=True,
        ),
        Operation("abs", np.abs, interval.absolute, (lambda _, a: np.sign(a),)),
        Operation("sign", np.sign, step_intervals.sign, (_zero,)),
        Operation("floor", np.floor, step_intervals.floor, (_zero,)),
        Operation("ceil", np.ceil, step_intervals.ceil, (_zero,)),
        Operation("round", np.rint, step_intervals.round_half_even, (_zero,)),
        Operation(
            "mod",
            np.mod,
            step_intervals.mod,
            (lambda _r, _a, _b: 1.0, lambda _, a, b: -np.floor(a / b)),
            singular=True,
            defined_for=lambda divisor: divisor != 0,
        ),
        Operation(
            "min",
            np.minimum,
            interval.minimum,
            (
                lambda _, a, b: np.where(a <= b, 1.0, 0.0),
                lambda _, a, b: np.where(a <= b, 0.0, 1.0),
            ),
            variadic=True,
        ),
        Operation(
            "max",
            np.maximum,
            interval.maximum,
            (
                lambda _, a, b: np.where(a >= b, 1.0, 0.0),
                lambda _, a, b: np.where(a >= b, 0.0, 1.0),
            ),
            variadic=True,
        ),
        Operation(
            "clamp",
            _clamp,
            blend_intervals.clamp,
            (
                lambda _, x, low, high: np.where((low <= x) & (x <= high), 1.0, 0.0),
                lambda _, x, low, high: np.where((x < low) & (low <= high), 1.0, 0.0),
                lambda _, x, low, high: np.where(np.maximum(x, low) > high, 1.0, 0.0),
            ),
        ),
        Operation(
            "mix",
            _mix,
            blend_intervals.mix,
            (lambda _r, _a, _b, x: 1 - x, lambda _r, _a, _b, x: x, lambda _r, a, b, _x: b - a),
        ),
        Operation(
            "smoothstep",
            _smoothstep,
            blend_intervals.smoothstep,
            (
                lambda _, a, b, x: _smoothstep_slope(a, b, x) * (_share(a, b, x) - 1),
                lambda _, a, b, x: -_smoothstep_slope(a, b, x) * _share(a, b, x),
                lambda _, a, b, x: _smoothstep_slope(a, b, x),
            ),
            singular=True,
        ),
        IF,
    )
}

_BY_NAME = {
    (operation.name, operation.arity): operation
    for operation in (
        NEGATE,
        ADD,
        SUBTRACT,
        MULTIPLY,
        DIVIDE,
        POWER,
        *COMPARISONS.values(),
        *FUNCTIONS.values(),
    )
}

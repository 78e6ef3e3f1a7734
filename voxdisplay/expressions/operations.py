"""What an expression can compute: each operation's value, its bounds, its partial derivatives.

One row per operation, so that another way of computing is another column. Knows numpy's functions
and those of intervals; does not know how expressions are written or stored.

Everything happens in float64 and nothing raises: ``9**9**9`` is inf, ``log(-1)`` is nan.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from voxdisplay.expressions import interval

if TYPE_CHECKING:
    from collections.abc import Callable

    from voxdisplay.expressions.interval import Interval


@dataclass(frozen=True, slots=True, eq=False)
class Operation:
    """One operation on float64 arrays.

    Attributes
    ----------
    name : str
        What it is called in messages and, if it is a function, in expressions.
    value : callable
        ``value(*operands)``, elementwise.
    enclosure : callable
        ``enclosure(*operands)``, of and to `Interval`: bounds of the values, elementwise.
    partials : tuple of callables
        One for each operand: ``partial(result, *operands)`` is the derivative of the result with
        respect to it, elementwise. Not finite where there is none.
    variadic : bool
        An associative operation of two operands, which may be written with more.
    arity : int
        Number of operands: 1 or 2.

    """

    name: str
    value: Callable[..., Any]
    enclosure: Callable[..., Interval]
    partials: tuple[Callable[..., Any], ...]
    variadic: bool = False
    arity: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "arity", len(self.partials))


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
    "/", np.divide, interval.divide, (lambda _r, _a, b: 1 / b, lambda r, _a, b: -r / b)
)
# The operator, not np.power: it takes squares and roots by the faster and exacter route.
POWER = Operation("**", lambda a, b: a**b, interval.power, (_power_by_base, _power_by_exponent))

FUNCTIONS = {
    operation.name: operation
    for operation in (
        Operation("sin", np.sin, interval.sin, (lambda _, a: np.cos(a),)),
        Operation("cos", np.cos, interval.cos, (lambda _, a: -np.sin(a),)),
        Operation("tan", np.tan, interval.tan, (lambda r, _: 1 + r * r,)),
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
        Operation("exp", np.exp, interval.exp, (lambda r, _: r,)),
        Operation("log", np.log, interval.log, (lambda _, a: 1 / a,)),
        Operation("sqrt", np.sqrt, interval.sqrt, (lambda r, _: 0.5 / r,)),
        Operation(
            "hypot",
            np.hypot,
            interval.hypot,
            (lambda r, a, _: a / r, lambda r, _, b: b / r),
            variadic=True,
        ),
        Operation("abs", np.abs, interval.absolute, (lambda _, a: np.sign(a),)),
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
    )
}

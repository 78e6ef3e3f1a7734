"""What an expression can compute: each operation's value and its partial derivatives.

One row per operation, so that another way of computing (an interval enclosure, say) is another
column. Knows numpy's functions; does not know how expressions are written or stored.

Everything happens in float64 and nothing raises: ``9**9**9`` is inf, ``log(-1)`` is nan.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable


@dataclass(frozen=True, slots=True)
class Operation:
    """One operation on float64 arrays.

    Attributes
    ----------
    name : str
        What it is called in messages and, if it is a function, in expressions.
    value : callable
        ``value(*operands)``, elementwise.
    partials : tuple of callables
        One for each operand: ``partial(result, *operands)`` is the derivative of the result with
        respect to it, elementwise. Not finite where there is none.
    variadic : bool
        An associative operation of two operands, which may be written with more.

    """

    name: str
    value: Callable[..., Any]
    partials: tuple[Callable[..., Any], ...]
    variadic: bool = False

    @property
    def arity(self) -> int:
        """Number of operands."""
        return len(self.partials)


def _power_by_base(_: Any, a: Any, b: Any) -> Any:
    return np.where(b == 0, 0.0, b * a ** (b - 1))  # at a == 0, b == 0 the product is 0 * inf


def _power_by_exponent(r: Any, a: Any, _: Any) -> Any:
    return np.where(a == 0, 0.0, r * np.log(a))  # 0**b is flat wherever it is finite


NEGATE = Operation("-", np.negative, (lambda _r, _a: -1.0,))
ADD = Operation("+", np.add, (lambda _r, _a, _b: 1.0, lambda _r, _a, _b: 1.0))
SUBTRACT = Operation("-", np.subtract, (lambda _r, _a, _b: 1.0, lambda _r, _a, _b: -1.0))
MULTIPLY = Operation("*", np.multiply, (lambda _r, _a, b: b, lambda _r, a, _b: a))
DIVIDE = Operation("/", np.divide, (lambda _r, _a, b: 1 / b, lambda r, _a, b: -r / b))
# The operator, not np.power: it takes squares and roots by the faster and exacter route.
POWER = Operation("**", lambda a, b: a**b, (_power_by_base, _power_by_exponent))

FUNCTIONS = {
    operation.name: operation
    for operation in (
        Operation("sin", np.sin, (lambda _, a: np.cos(a),)),
        Operation("cos", np.cos, (lambda _, a: -np.sin(a),)),
        Operation("tan", np.tan, (lambda r, _: 1 + r * r,)),
        Operation("asin", np.arcsin, (lambda _, a: 1 / np.sqrt(1 - a * a),)),
        Operation("acos", np.arccos, (lambda _, a: -1 / np.sqrt(1 - a * a),)),
        Operation("atan", np.arctan, (lambda _, a: 1 / (1 + a * a),)),
        Operation(
            "atan2",
            np.arctan2,
            (lambda _, y, x: x / (x * x + y * y), lambda _, y, x: -y / (x * x + y * y)),
        ),
        Operation("sinh", np.sinh, (lambda _, a: np.cosh(a),)),
        Operation("cosh", np.cosh, (lambda _, a: np.sinh(a),)),
        Operation("tanh", np.tanh, (lambda r, _: 1 - r * r,)),
        Operation("exp", np.exp, (lambda r, _: r,)),
        Operation("log", np.log, (lambda _, a: 1 / a,)),
        Operation("sqrt", np.sqrt, (lambda r, _: 0.5 / r,)),
        Operation("hypot", np.hypot, (lambda r, a, _: a / r, lambda r, _, b: b / r), variadic=True),
        Operation("abs", np.abs, (lambda _, a: np.sign(a),)),
        Operation(
            "min",
            np.minimum,
            (
                lambda _, a, b: np.where(a <= b, 1.0, 0.0),
                lambda _, a, b: np.where(a <= b, 0.0, 1.0),
            ),
            variadic=True,
        ),
        Operation(
            "max",
            np.maximum,
            (
                lambda _, a, b: np.where(a >= b, 1.0, 0.0),
                lambda _, a, b: np.where(a >= b, 0.0, 1.0),
            ),
            variadic=True,
        ),
    )
}

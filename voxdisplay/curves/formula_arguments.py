"""Formulas and parameter ranges as arguments of curves and bodies. Must not know either."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from voxdisplay.curves import arguments
from voxdisplay.errors import CurveError
from voxdisplay.expressions.parse import constant, excerpt, parse
from voxdisplay.expressions.program import VARIABLE, Expression

Formula = str | float | Expression
Bounds = Sequence[str | float]


def parse_formula(
    name: str,
    formula: Formula,
    values: Mapping[str, float],
    *,
    variables: tuple[str, ...] = (VARIABLE,),
    axis: str | None = None,
) -> Expression:
    """Return an expression, or raise CurveError with the name of the argument."""
    if isinstance(formula, Expression):
        return formula
    try:
        return parse(formula, values, variables=variables)
    except CurveError as error:
        raise CurveError(f"{name}: {error}", axis=axis, hint=error.hint) from None


def parse_range(name: str, bounds: Bounds, values: Mapping[str, float]) -> tuple[float, float]:
    """Return the numbers (a, b), a < b, of a range of numbers or expressions without variables."""
    is_pair = isinstance(bounds, Sequence | np.ndarray) and not isinstance(bounds, str | bytes)
    if not is_pair or getattr(bounds, "ndim", 1) != 1 or len(bounds) != 2:
        raise arguments.ArgumentError(name, f"must be two numbers (a, b), not {excerpt(bounds)}")
    low, high = (constant(bound, values) for bound in bounds)
    return arguments.parameter_range(name, low, high)

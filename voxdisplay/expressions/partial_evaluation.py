"""Partial evaluation: expressions of which some variables get their values long before others.

A formula of t in a moving scene depends on the time as well. Its parts without t are expressions of
their own, evaluated for many times at once; a formula of t alone is what remains at each time.
Must not know what the variables are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from voxdisplay.errors import CurveError
from voxdisplay.expressions.operations import Operation
from voxdisplay.expressions.parse import excerpt
from voxdisplay.expressions.program import Expression, Step

if TYPE_CHECKING:
    from collections.abc import Sequence


@dataclass(frozen=True, slots=True)
class PartialExpression:
    """An expression in which the largest parts without late variables are left open.

    Attributes
    ----------
    source : str
        The text it was parsed from.
    parts : tuple of Expression
        The open parts, of early variables alone.
    late : tuple of str
        The late variables, as of `Expression.variables`.

    """

    source: str
    parts: tuple[Expression, ...]
    late: tuple[str, ...]
    _program: tuple[Step | int, ...]  # an int is the number of a part

    def bind(self, values: Sequence[float]) -> Expression:
        """Return the expression of the late variables, for values of all parts.

        It is the very program that `parse` makes of the text where these are params.

        Raises
        ------
        CurveError
            If no late variable occurs, and the value is inf or nan.

        """
        program = tuple([values[step] if type(step) is int else step for step in self._program])
        expression = Expression(self.source, program, self.late)
        if expression.constant is not None and not math.isfinite(expression.constant):
            raise CurveError(f"{excerpt(self.source)} is not finite: {expression.constant}")
        return expression


@dataclass(frozen=True, slots=True)
class _Operand:
    program: tuple[Step | int, ...]
    late: bool


def split(expression: Expression, late: tuple[str, ...]) -> PartialExpression:
    """Return an expression with its parts that do not depend on late variables set apart.

    Parameters
    ----------
    expression : Expression
        Of any variables.
    late : tuple of str
        Those of its variables that get their values last.

    """
    parts: list[Expression] = []
    early = tuple(name for name in expression.variables if name not in late)

    def opened(operand: _Operand) -> tuple[Step | int, ...]:
        if operand.late or (len(operand.program) == 1 and isinstance(operand.program[0], float)):
            return operand.program
        steps = tuple(step for step in operand.program if not isinstance(step, int))
        parts.append(Expression(expression.source, steps, early))
        return (len(parts) - 1,)

    stack: list[_Operand] = []
    for step in expression.program:
        if not isinstance(step, Operation):
            stack.append(_Operand((step,), isinstance(step, str) and step in late))
            continue
        operands = stack[-step.arity :]
        del stack[-step.arity :]
        is_late = any(operand.late for operand in operands)
        programs = [opened(each) if is_late else each.program for each in operands]
        stack.append(_Operand((*(s for program in programs for s in program), step), is_late))
    (result,) = stack
    program = result.program if result.late else opened(result)
    return PartialExpression(expression.source, tuple(parts), late, program)

"""Postfix programs of expressions: evaluation, exact derivative and enclosure.

A program runs over any kind of value: arrays, intervals, values with their derivatives; one
program, or many of one template together. Must not know text: that is `parse`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from voxdisplay.expressions.interval import Interval, interval
from voxdisplay.expressions.operations import IF, POWER, Operation

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from voxdisplay.compute.array_types import Evaluate, Floats, Ints

V = TypeVar("V")
Step = float | str | Operation
"""One step of a postfix program: push a number or a variable (its name), or apply an operation."""

VARIABLE = "t"
"""Name of the variable of curves."""


@dataclass(frozen=True, slots=True)
class Expression:
    """A parsed expression: a postfix program, operands before their operation.

    Parts that do not depend on a variable are computed once, on parsing.

    Attributes
    ----------
    source : str
        The text it was parsed from.
    program : tuple of Step
        The steps, for `fold`.
    variables : tuple of str
        Names of the variables, in the order in which their values are passed.

    """

    source: str
    program: tuple[Step, ...]
    variables: tuple[str, ...] = (VARIABLE,)

    @property
    def template(self) -> tuple[Step | None, ...]:
        """The program without its numbers but exponents, which decide how ``**`` computes."""
        following = (*self.program[1:], None)
        return tuple(
            None if isinstance(step, float) and after is not POWER else step
            for step, after in zip(self.program, following, strict=True)
        )

    @property
    def always_defined(self) -> bool:
        """True if no operation may lack a value, or be infinite, at single operands."""
        return not any(
            isinstance(step, Operation)
            and step.singular
            and not (isinstance(last, float) and step.defined_for(last))
            for last, step in pairwise((None, *self.program))
        )

    @property
    def constant(self) -> float | None:
        """The value if it does not depend on a variable, else None."""
        (first, *rest) = self.program
        return first if not rest and isinstance(first, float) else None

    def fold(
        self,
        variables: Sequence[V],
        constant: Callable[[float], V],
        apply: Callable[[Operation, tuple[V, ...]], V],
    ) -> V:
        """Run the program over any kind of value.

        Parameters
        ----------
        variables : sequence
            The values of the variables.
        constant : callable
            Makes a value of a number.
        apply : callable
            Applies an operation to a tuple of its operands' values.

        """
        value_of = dict(zip(self.variables, variables, strict=True))
        stack: list[V] = []
        for step in self.program:
            if isinstance(step, Operation):
                operands = tuple(stack[-step.arity :])
                del stack[-step.arity :]
                stack.append(apply(step, operands))
            else:
                stack.append(value_of[step] if isinstance(step, str) else constant(step))
        (result,) = stack
        return result

    def value(self, *variables: Floats) -> Floats:
        """Evaluate at arrays that broadcast; not finite where there is no value.

        Returns
        -------
        float64 array
            Of the shape to which the variables broadcast.

        """
        out = np.empty(np.broadcast_shapes(*(each.shape for each in variables)))
        with np.errstate(all="ignore"):
            out[...] = _run(_flatten(self), variables)
        return out

    def derivative(self, t: Floats) -> Floats:
        """Return the derivative at t, (n,) float64; not finite where the rules find none.

        At a kink of ``abs``, ``min`` and ``max`` it is that of one side, or 0; at a step of
        ``floor``, ``sign`` and their like it is 0.
        """
        out = np.empty_like(t, dtype=np.float64)
        variable: _Dual = (t, np.float64(1))
        with np.errstate(all="ignore"):
            _, slope = self.fold([variable], lambda value: (np.float64(value), None), _chain_rule)
        out[...] = 0.0 if slope is None else slope
        return out

    def enclosure(self, *variables: Interval) -> Interval:
        """Return bounds of the exact values of the program for all real variables in intervals.

        Its numbers, float64, are taken as they are.
        """
        with np.errstate(all="ignore"):
            return self.fold(variables, interval, lambda operation, x: operation.enclosure(*x))


def compile_rows(expressions: Sequence[Expression]) -> Callable[..., Floats]:
    """Return an evaluator of k expressions of the same variables.

    Returns
    -------
    callable
        Takes the variables, (n,) float64 each, and returns the values, (k, n), as
        `Expression.value`.

    """
    programs = [_flatten(each) for each in expressions]

    @np.errstate(all="ignore")
    def evaluate(*variables: Floats) -> Floats:
        out = np.empty((len(programs), variables[0].size))
        for row, program in zip(out, programs, strict=True):
            row[:] = _run(program, variables)
        return out

    return evaluate


def batch_evaluator(expressions: Sequence[Expression]) -> Evaluate:
    """Return an evaluator of expressions of one template in one variable.

    Returns
    -------
    callable
        ``(which, t)`` -> (n,) values: for each of n parameters, that of the expression with that
        index, (n,) int64; to the bit what its ``value`` gives.

    """
    columns = _number_columns(expressions)
    plain = _flatten(expressions[0])

    @np.errstate(all="ignore")
    def evaluate(which: Ints, t: Floats) -> Floats:
        values = iter([column[which] if column.ndim else column for column in columns])
        program = [(0, next(values)) if arity == 0 else (arity, step) for arity, step in plain]
        out = np.empty_like(t, dtype=np.float64)
        out[...] = _run(program, (t,))
        return out

    return evaluate


_ROW = 64  # values: a multiple of the lanes of all vector units
_TOGETHER = 256  # expressions, of which the values stay in a processor's cache


def values_of_template(expressions: Sequence[Expression], variables: Sequence[Floats]) -> Floats:
    """Evaluate expressions of one template and the same variables at n values of these.

    Vectorised functions may round a value otherwise at the end of an array, where there are fewer
    than a processor takes together. Where n is a multiple of 64, no row begins or ends within such
    a group; for any other n the expressions are evaluated one by one.

    Parameters
    ----------
    expressions : sequence of Expression
        k of them.
    variables : sequence of (n,) float64 arrays

    Returns
    -------
    (k, n) float64 array
        To the bit the `Expression.value` of each.

    """
    if len(expressions) == 1 or variables[0].size % _ROW:
        return np.array([each.value(*variables) for each in expressions])
    plain, columns = _flatten(expressions[0]), _number_columns(expressions)
    found = np.empty((len(expressions), variables[0].size))
    for first in range(0, len(expressions), _TOGETHER):
        rows = slice(first, first + _TOGETHER)
        values = iter([x[rows, None] if x.ndim else x for x in columns])
        program = [(0, next(values)) if arity == 0 else (arity, step) for arity, step in plain]
        with np.errstate(all="ignore"):
            found[rows] = _run(program, variables)
    return found


def _number_columns(expressions: Sequence[Expression]) -> list[Floats]:
    """Return the numbers of k expressions of one template, (k,) each, in the program's order.

    Numbers that are the same in all, as exponents are, stay scalars: ().
    """
    rows = [[x for x in each.program if isinstance(x, float)] for each in expressions]
    numbers = np.array(rows, dtype=np.float64)
    bits = numbers.view(np.int64)
    same = (bits == bits[0]).all(axis=0)
    return [np.array(x[0]) if once else x for x, once in zip(numbers.T, same, strict=True)]


def _flatten(expression: Expression) -> list[tuple[int, Any]]:
    """Return the steps of a program as `_run` takes them.

    Arity and function of operations; -1 and the index of variables; 0 and the value of numbers.
    """
    return [
        (step.arity, step.value)
        if isinstance(step, Operation)
        else (-1, expression.variables.index(step))
        if isinstance(step, str)
        else (0, np.array(step))  # which numpy takes in half the time of a float
        for step in expression.program
    ]


def _run(program: list[tuple[int, Any]], variables: Sequence[Floats]) -> Any:
    """Run a program over arrays, as `Expression.fold` does but with less overhead per step."""
    stack: list[Any] = []
    for arity, step in program:
        if arity == 2:
            last = stack.pop()
            stack[-1] = step(stack[-1], last)
        elif arity == 1:
            stack[-1] = step(stack[-1])
        elif arity == 3:
            last, middle = stack.pop(), stack.pop()
            stack[-1] = step(stack[-1], middle, last)
        else:
            stack.append(variables[step] if arity else step)
    (result,) = stack
    return result


# A value and its derivative by t. None is an exact zero, so that what does not depend on t cannot
# turn a derivative into 0 * inf.
_Dual = tuple[Any, Any]


def _chain_rule(operation: Operation, operands: tuple[_Dual, ...]) -> _Dual:
    values = [value for value, _ in operands]
    result = operation.value(*values)
    if operation is IF:  # the branch that is not taken may have no slope, nor a finite one
        condition, *slopes = values[0], *(0.0 if s is None else s for _, s in operands[1:])
        return result, np.where(condition, *slopes)
    terms = [
        partial(result, *values) * slope
        for partial, (_, slope) in zip(operation.partials, operands, strict=True)
        if slope is not None
    ]
    return result, sum(terms[1:], start=terms[0]) if terms else None

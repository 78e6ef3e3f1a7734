"""Safe expressions: text -> a numpy function of t, with its exact derivative and its bounds.

::

    expression = sum of terms        a + b, a - b
    term       = product of factors  a * b, a / b
    factor     = -a, +a, power
    power      = atom ** factor      right associative; -2**2 is -(2**2), as in Python
    atom       = number, name, function(expression, ...), (expression)

Nothing else parses, and Python is never asked to parse or run the text. The length, the nesting
and the number of steps are limited, and evaluation is float64 throughout, so that hostile text
costs no more than a long expression does. Knows no curves, and nothing of where the text came
from: an error names the column, the caller adds the place.
"""

from __future__ import annotations

import math
import re
import reprlib
from dataclasses import dataclass
from textwrap import shorten
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn, TypeVar, cast

import numpy as np

from voxdisplay.curves.interval import Interval, interval
from voxdisplay.curves.operations import (
    ADD,
    DIVIDE,
    FUNCTIONS,
    MULTIPLY,
    NEGATE,
    POWER,
    SUBTRACT,
    Operation,
)
from voxdisplay.errors import CurveError, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from voxdisplay.curves.curve import Evaluate, Floats, Ints

MAX_LENGTH = 4096
"""Longest text of an expression, in characters."""
MAX_DEPTH = 100
"""Deepest nesting of brackets, signs and right operands; bounds the parser's recursion."""
MAX_STEPS = 1024
"""Most numbers, names and operations in one expression."""

CONSTANTS = {"pi": math.pi, "tau": math.tau, "e": math.e, "deg": math.pi / 180}
VARIABLE = "t"

V = TypeVar("V")
Step = float | str | Operation
"""One step of a postfix program: push a number, push t (its name), or apply an operation."""


@dataclass(frozen=True, slots=True)
class Expression:
    """A parsed expression: a postfix program, operands before their operation.

    Parts that do not depend on t are computed once, on parsing.

    Attributes
    ----------
    source : str
        The text it was parsed from.
    program : tuple of Step
        The steps, for `fold`.

    """

    source: str
    program: tuple[Step, ...]

    @property
    def template(self) -> tuple[Step | None, ...]:
        """The program without its numbers, but with exponents: they decide how ``**`` computes."""
        following = (*self.program[1:], None)
        return tuple(
            None if isinstance(step, float) and after is not POWER else step
            for step, after in zip(self.program, following, strict=True)
        )

    @property
    def constant(self) -> float | None:
        """The value, when it does not depend on t."""
        (first, *rest) = self.program
        return first if not rest and isinstance(first, float) else None

    def fold(
        self,
        variable: V,
        constant: Callable[[float], V],
        apply: Callable[[Operation, tuple[V, ...]], V],
    ) -> V:
        """Run the program over any kind of value.

        Parameters
        ----------
        variable : V
            What t is.
        constant : callable
            Makes a value of a number.
        apply : callable
            Applies an operation to a tuple of its operands' values.

        """
        stack: list[V] = []
        for step in self.program:
            if isinstance(step, Operation):
                last = stack.pop()
                stack.append(apply(step, (last,) if step.arity == 1 else (stack.pop(), last)))
            else:
                stack.append(variable if isinstance(step, str) else constant(step))
        (result,) = stack
        return result

    def value(self, t: Floats) -> Floats:
        """Evaluate at t, (n,) float64, to (n,) float64; not finite where there is no value."""
        return rows([self])(t).ravel()

    def derivative(self, t: Floats) -> Floats:
        """Give the derivative at t, (n,) float64; not finite where the rules find none.

        At a kink of ``abs``, ``min`` and ``max`` it is that of one side, or 0.
        """
        out = np.empty_like(t, dtype=np.float64)
        variable: _Dual = (t, np.float64(1))
        with np.errstate(all="ignore"):
            _, slope = self.fold(variable, lambda value: (np.float64(value), None), _chain_rule)
        out[...] = 0.0 if slope is None else slope
        return out

    def enclosure(self, t: Interval) -> Interval:
        """Bound the exact values of the program for all real t in intervals.

        Its numbers, float64, are taken as they are.
        """
        with np.errstate(all="ignore"):
            return self.fold(t, interval, lambda operation, x: operation.enclosure(*x))


def rows(expressions: Sequence[Expression]) -> Callable[[Floats], Floats]:
    """Prepare to evaluate k expressions at t, (n,) float64, to (k, n): as `Expression.value`."""
    programs = [_plain(each.program) for each in expressions]

    @np.errstate(all="ignore")
    def evaluate(t: Floats) -> Floats:
        out = np.empty((len(programs), t.size))
        for row, program in zip(out, programs, strict=True):
            row[:] = _run(program, t)
        return out

    return evaluate


def together(expressions: Sequence[Expression]) -> Evaluate:
    """Prepare to evaluate expressions of one template at once.

    Returns
    -------
    callable
        ``(which, t)`` -> (n,) values: for each of n parameters, that of the expression with that
        index, (n,) int64; to the bit what its ``value`` gives.

    """
    programs = [each.program for each in expressions]
    numbers = np.array([[x for x in program if isinstance(x, float)] for program in programs])
    bits = numbers.view(np.int64)
    # Numbers that all have in common, as exponents are, stay scalars.
    columns = [
        column[0] if same else column
        for column, same in zip(numbers.T, (bits == bits[0]).all(axis=0), strict=True)
    ]
    plain = _plain(programs[0])

    @np.errstate(all="ignore")
    def evaluate(which: Ints, t: Floats) -> Floats:
        values = iter([column[which] if column.ndim else column for column in columns])
        program = [(0, next(values)) if arity == 0 else (arity, step) for arity, step in plain]
        out = np.empty_like(t, dtype=np.float64)
        out[...] = _run(program, t)
        return out

    return evaluate


def _plain(program: tuple[Step, ...]) -> list[tuple[int, Any]]:
    """Give the steps of a program as `_run` takes them: how many operands, and what to do."""
    return [
        (step.arity, step.value)
        if isinstance(step, Operation)
        else (-1, None)
        if isinstance(step, str)
        else (0, np.array(step))  # which numpy takes in half the time of a float
        for step in program
    ]


def _run(program: list[tuple[int, Any]], t: Floats) -> Any:
    """Do what `Expression.fold` does with arrays, but faster: small ones take no longer than it."""
    stack: list[Any] = []
    for arity, step in program:
        if arity == 2:
            last = stack.pop()
            stack[-1] = step(stack[-1], last)
        elif arity == 1:
            stack[-1] = step(stack[-1])
        else:
            stack.append(t if arity else step)
    (result,) = stack
    return result


# A value and its derivative by t. None is an exact zero, so that what does not depend on t cannot
# turn a derivative into 0 * inf.
_Dual = tuple[Any, Any]


def _chain_rule(operation: Operation, operands: tuple[_Dual, ...]) -> _Dual:
    values = [value for value, _ in operands]
    result = operation.value(*values)
    terms = [
        partial(result, *values) * slope
        for partial, (_, slope) in zip(operation.partials, operands, strict=True)
        if slope is not None
    ]
    return result, sum(terms[1:], start=terms[0]) if terms else None


def parse(
    source: str | float, names: Mapping[str, float] | None = None, *, variable: bool = True
) -> Expression:
    """Parse an expression.

    Parameters
    ----------
    source : str or float
        The text; a number stands for itself.
    names : mapping of str to float, optional
        The values of params.
    variable : bool
        Whether t may occur.

    Raises
    ------
    CurveError
        If the text is not an expression, or too long, too deep or of too many steps: the message
        names the column, counted from 1, and what was found there. If it does not depend on t
        and its value is inf or nan.

    """
    if isinstance(source, str):
        expression = _Parser(source, names or {}, variable=variable).parse()
    else:
        expression = Expression(str(source), (float(source),))
    if expression.constant is not None and not math.isfinite(expression.constant):
        raise CurveError(f"{excerpt(source)} is not finite: {expression.constant}")
    return expression


def constant(source: str | float, names: Mapping[str, float] | None = None) -> float:
    """Parse an expression without t and give its value; raise CurveError as `parse` does."""
    (value,) = parse(source, names, variable=False).program
    return cast("float", value)


def excerpt(value: object) -> str:
    """Quote a value of any length, of any characters, in an error message."""
    return _EXCERPT.repr(value)


_EXCERPT = reprlib.Repr()
_EXCERPT.maxstring = 60


class _Token(NamedTuple):
    kind: str  # "number", "name", "symbol", "end", or "other": no part of any expression
    text: str
    column: int


_TOKEN = re.compile(
    r"""(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)
      | (?P<name>[A-Za-z_][A-Za-z0-9_]*)
      | (?P<symbol>\*\*|[-+*/(),])
      | (?P<other>\S)""",
    re.VERBOSE,
)
_SPELLINGS = {
    "^": "**",
    "\N{MINUS SIGN}": "-",
    "\N{MULTIPLICATION SIGN}": "*",
    "\N{MIDDLE DOT}": "*",
    "\N{DIVISION SIGN}": "/",
    "\N{GREEK SMALL LETTER PI}": "pi",
    "\N{DEGREE SIGN}": "*deg",
    "\N{SQUARE ROOT}": "sqrt",
}
"""What people write for what is written otherwise here."""


def _tokens(source: str) -> Iterator[_Token]:
    for match in _TOKEN.finditer(source):
        yield _Token(match.lastgroup or "other", match.group(), match.start() + 1)
    yield _Token("end", "", len(source) + 1)


def names_in(source: str) -> list[str]:
    """Give the names in a text, in order, whether it parses or not."""
    return [token.text for token in _tokens(source[:MAX_LENGTH]) if token.kind == "name"]


class _Infix(NamedTuple):
    operation: Operation
    left: int  # how tightly it binds what stands before it
    right: int  # and what stands after it


_INFIX = {
    "+": _Infix(ADD, 10, 10),
    "-": _Infix(SUBTRACT, 10, 10),
    "*": _Infix(MULTIPLY, 20, 20),
    "/": _Infix(DIVIDE, 20, 20),
    "**": _Infix(POWER, 40, 39),
}
_SIGN = 30
_PRODUCT_HINT = "a product is written with *"


class _Parser:
    """Pratt parser, writing the postfix program as it goes."""

    def __init__(self, source: str, names: Mapping[str, float], *, variable: bool) -> None:
        self.source = source
        self.names = names
        self.variable = variable
        self.program: list[Step] = []
        self.steps = 0
        if len(source) > MAX_LENGTH:
            self.fail(f"{len(source)} characters are more than {MAX_LENGTH}: {excerpt(source)}")
        self.tokens = _tokens(source)
        self.token = next(self.tokens)

    def parse(self) -> Expression:
        if self.token.kind == "end":
            self.fail("the expression is empty")
        self.expression(0, 0)
        if self.token.kind != "end":
            another = self.token.kind in {"name", "number"} or self.token.text == "("
            hint = _PRODUCT_HINT if another else None
            self.unexpected("an operator or the end", hint=hint)
        return Expression(self.source, tuple(self.program))

    def expression(self, binding: int, depth: int) -> None:
        if depth > MAX_DEPTH:
            self.fail(f"nested more than {MAX_DEPTH} deep {self.place()}")
        self.operand(depth)
        while (infix := _INFIX.get(self.token.text)) and infix.left > binding:
            self.advance()
            self.expression(infix.right, depth + 1)
            self.emit(infix.operation)

    def operand(self, depth: int) -> None:
        token = self.token
        if token.kind == "number":
            self.number(token)
        elif token.kind == "name":
            self.name(token, depth)
        elif token.text in {"+", "-"}:
            self.advance()
            self.expression(_SIGN, depth + 1)
            if token.text == "-":
                self.emit(NEGATE)
        elif token.text == "(":
            self.advance()
            self.expression(0, depth + 1)
            self.expect(")")
        else:
            self.unexpected("a value")

    def number(self, token: _Token) -> None:
        value = float(token.text)
        if not math.isfinite(value):
            self.fail(f"the number {self.place(token)} is too large")
        self.advance()
        self.emit(value)

    def name(self, token: _Token, depth: int) -> None:
        name = token.text
        self.advance()
        called = self.token.text == "("
        if name in FUNCTIONS:
            if not called:
                self.fail(f"the function {name!r} {self.place(token)} needs an argument in ( )")
            self.call(token, FUNCTIONS[name], depth)
            return
        meaning: Step | None = CONSTANTS.get(name, self.names.get(name))
        if name == VARIABLE and self.variable:
            meaning = VARIABLE
        if meaning is None:
            self.unknown(token, called=called)
        if called:
            self.fail(f"{name!r} {self.place(token)} is not a function", hint=_PRODUCT_HINT)
        self.emit(meaning)

    def unknown(self, token: _Token, *, called: bool) -> NoReturn:
        name = token.text
        if name == VARIABLE:
            self.fail(
                f"'t' {self.place(token)} has no value here",
                hint="t runs only in x, y, z, dx, dy, dz of a parametric curve",
            )
        known = [*CONSTANTS, *self.names, *FUNCTIONS] + [VARIABLE] * self.variable
        what, like = ("function", list(FUNCTIONS)) if called else ("name", known)
        hint = did_you_mean(name, like) or f"known: {shorten(', '.join(like), 200)}"
        self.fail(f"unknown {what} {excerpt(name)} {self.place(token)}", hint=hint)

    def call(self, token: _Token, function: Operation, depth: int) -> None:
        count = 0
        while count == 0 or self.token.text == ",":
            self.advance()
            if count == 0 and self.token.text == ")":
                break
            self.expression(0, depth + 1)
            count += 1
            if count == function.arity or (function.variadic and count > function.arity):
                self.emit(function)
        self.expect(")")
        if count < function.arity or (count > function.arity and not function.variadic):
            wanted = f"{function.arity}{' or more' if function.variadic else ''}"
            plural = "" if wanted == "1" else "s"
            self.fail(
                f"{token.text} takes {wanted} argument{plural}, not {count}, {self.place(token)}"
            )

    def emit(self, step: Step) -> None:
        """Append a step, computing at once what does not depend on t."""
        self.steps += 1
        if self.steps > MAX_STEPS:
            self.fail(f"more than {MAX_STEPS} numbers, names and operations")
        if isinstance(step, Operation):
            # An operand that ends in a number is that number: everything else ends in t or in an
            # operation on it.
            operands = [x for x in self.program[-step.arity :] if isinstance(x, float)]
            if len(operands) == step.arity:
                with np.errstate(all="ignore"):
                    value = float(step.value(*map(np.float64, operands)))
                self.program[-step.arity :] = [value]
                return
        self.program.append(step)

    def advance(self) -> None:
        self.token = next(self.tokens)

    def expect(self, symbol: str) -> None:
        if self.token.text != symbol:
            self.unexpected(f"{symbol!r} or an operator")
        self.advance()

    def place(self, token: _Token | None = None) -> str:
        return f"at column {(token or self.token).column} of {excerpt(self.source)}"

    def unexpected(self, wanted: str, hint: str | None = None) -> NoReturn:
        if self.token.text in _SPELLINGS:
            hint = f"write {_SPELLINGS[self.token.text]!r}"
        found = "the end" if self.token.kind == "end" else excerpt(self.token.text)
        self.fail(f"expected {wanted}, found {found} {self.place()}", hint=hint)

    def fail(self, message: str, hint: str | None = None) -> NoReturn:
        raise CurveError(message, hint=hint)

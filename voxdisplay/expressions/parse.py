"""Parser of expressions: safe text to a postfix program, see `program`.

::

    expression = sum of terms        a + b, a - b
    term       = product of factors  a * b, a / b
    factor     = -a, +a, power
    power      = atom ** factor      right associative; -2**2 is -(2**2), as in Python
    atom       = number, name, function(expression, ...), (expression),
                 if(expression < expression, expression, expression)

A condition compares by one of < <= > >= == !=. Nothing else parses, and Python is never asked to
parse or run the text. The length, the nesting and the number of steps are limited, and evaluation
is float64 throughout, so that hostile text costs no more than a long expression does. Must not
know curves, nor where the text came from: an error names the column, the caller adds the place.
"""

from __future__ import annotations

import math
import re
import reprlib
from textwrap import shorten
from typing import TYPE_CHECKING, NamedTuple, NoReturn, cast

import numpy as np

from voxdisplay.argument_checks import described, number
from voxdisplay.errors import CurveError
from voxdisplay.expressions.operations import (
    ADD,
    COMPARISONS,
    DIVIDE,
    FUNCTIONS,
    IF,
    MULTIPLY,
    NEGATE,
    POWER,
    SUBTRACT,
    Operation,
)
from voxdisplay.expressions.program import VARIABLE, Expression, Step
from voxdisplay.expressions.suggestions import ARGUMENT_HINTS, SYNONYMS, suggest

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping


MAX_LENGTH = 4096
"""Longest text of an expression, in characters."""
MAX_DEPTH = 100
"""Deepest nesting of brackets, signs and right operands; bounds the parser's recursion."""
MAX_STEPS = 1024
"""Most numbers, names and operations in one expression."""

TIME = "time"
"""Name of the seconds since a moving scene began."""
CONSTANTS = {"pi": math.pi, "tau": math.tau, "e": math.e, "deg": math.pi / 180}


def parse(
    source: str | float,
    names: Mapping[str, float] | None = None,
    *,
    variables: tuple[str, ...] = (VARIABLE,),
) -> Expression:
    """Parse an expression.

    Parameters
    ----------
    source : str or float
        The text, or a number.
    names : mapping of str to float, optional
        The values of params.
    variables : tuple of str
        Names of the variables that may occur; they go before params of the same name.

    Raises
    ------
    CurveError
        If the text is not an expression, or too long, too deep or of too many steps: the message
        names the column, counted from 1, and what was found there. If it depends on no
        variable and its value is inf or nan.

    """
    if isinstance(source, str):
        expression = _Parser(source, names or {}, variables).parse()
    else:
        try:
            value = number("", source)
        except (TypeError, ValueError):
            raise CurveError(
                f"an expression is a text or a finite number, not {described(source)}"
            ) from None
        expression = Expression(str(source), (value,), variables)
    if expression.constant is not None and not math.isfinite(expression.constant):
        raise CurveError(f"{excerpt(source)} is not finite: {expression.constant}")
    return expression


def constant(source: str | float, names: Mapping[str, float] | None = None) -> float:
    """Return the value of an expression without variables; raise CurveError as `parse` does."""
    (value,) = parse(source, names, variables=()).program
    return cast("float", value)


def excerpt(value: object) -> str:
    """Return a short quotation of a value of any length and characters, for error messages."""
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
      | (?P<symbol>\*\*|[<>=!]=|[-+*/(),<>])
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
    "\N{SUPERSCRIPT TWO}": "**2",
    "\N{SUPERSCRIPT THREE}": "**3",
    "\N{LESS-THAN OR EQUAL TO}": "<=",
    "\N{GREATER-THAN OR EQUAL TO}": ">=",
    "\N{NOT EQUAL TO}": "!=",
    "%": "mod(a, b)",
    "=": "==",
    "|": "abs(x)",
    "?": "if(condition, a, b)",
    "&": "if(a, if(b, x, y), y)",
}
"""Spellings of other notations and languages, and how the same is written here."""


def _tokens(source: str) -> Iterator[_Token]:
    for match in _TOKEN.finditer(source):
        yield _Token(match.lastgroup or "other", match.group(), match.start() + 1)
    yield _Token("end", "", len(source) + 1)


def names_in(source: str) -> list[str]:
    """Return the names in a text, in order, whether it parses or not."""
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
_NUMBER_HINT = "a number is written like 1000 or 0.5, without gaps; a product with *"
_NUMBER_BEFORE = re.compile(r"(?:^|[^\w.])[0-9.]+\s*$")
_OTHER_BASE = re.compile(r"(?:^|[^\w.])0[xXoObB]\w*$")
_INFIX_WORDS = {
    "and": SYNONYMS["and"],
    "or": SYNONYMS["or"],
    "mod": "write mod(a, b)",
    "div": "write floor(a / b) for the whole quotient",
    "if": "write if(condition, a, b)",
    "else": "write if(condition, a, b)",
}
"""Operators here for words between two operands in other languages."""


class _Parser:
    """Pratt parser that appends to the postfix program as it goes."""

    def __init__(self, source: str, names: Mapping[str, float], variables: tuple[str, ...]) -> None:
        self.source = source
        self.names = names
        self.variables = variables
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
            hint = self.hint_for_operand()
            if self.token.text == "," and _NUMBER_BEFORE.search(
                self.source[: self.token.column - 1]
            ):
                hint = "decimals are written with a point: 0.5"
            if self.token.text in COMPARISONS:
                hint = "a comparison belongs into the condition of if(condition, a, b)"
            self.unexpected("an operator or the end", hint=hint)
        return Expression(self.source, tuple(self.program), self.variables)

    def hint_for_operand(self) -> str | None:
        """Return a hint for an operand that follows another one without an operator."""
        word, kind = self.token.text, self.token.kind
        begin = self.token.column - 1
        called = self.source.startswith("(", begin + len(word))
        if word in _INFIX_WORDS and word not in self.names and not called:
            return _INFIX_WORDS[word]
        if _OTHER_BASE.search(self.source[:begin] + word):
            return "whole numbers are written in decimal: 16, not 0x10"
        goes_on = kind == "number" or word.strip("0123456789") == "_"
        if goes_on and _NUMBER_BEFORE.search(self.source[:begin]):
            return _NUMBER_HINT
        return _PRODUCT_HINT if kind in {"name", "number"} or word == "(" else None

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
        if name in FUNCTIONS and (called or name not in self.names):
            if not called:
                raised = self.token.text in {"^", "**"}
                hint = f"write {name}(x)**n for its power" if raised else None
                self.fail(
                    f"the function {name!r} {self.place(token)} needs an argument in ( )", hint
                )
            if FUNCTIONS[name] is IF:
                self.choice(depth)
            else:
                self.call(token, FUNCTIONS[name], depth)
            return
        meaning: Step | None = CONSTANTS.get(name, self.names.get(name))
        if name in self.variables:
            meaning = name
        if meaning is None:
            self.unknown(token, called=called)
        if called:
            empty = next(self.tokens).text == ")"
            hint = f"write {name} without ( )" if empty else _PRODUCT_HINT
            self.fail(f"{name!r} {self.place(token)} is not a function", hint=hint)
        self.emit(meaning)

    def unknown(self, token: _Token, *, called: bool) -> NoReturn:
        name = token.text
        if name == VARIABLE:
            self.fail(
                f"'t' {self.place(token)} has no value here",
                hint=f"the variables here are {' and '.join(self.variables)}"
                if self.variables
                else "t runs only in x, y, z, dx, dy, dz of a parametric curve",
            )
        if name == TIME:
            problem = f"{name!r} {self.place(token)} has no value here"
            self.fail(problem, hint='it runs in scenes that have a "duration"')
        known = [*CONSTANTS, *self.names, *FUNCTIONS, *self.variables]
        what, like = ("function", list(FUNCTIONS)) if called else ("name", known)
        if self.token.text.startswith("."):  # math.sin, np.pi
            self.fail(
                f"unknown name {excerpt(name)} {self.place(token)}",
                hint="write the names of functions and constants alone: sin(t), pi",
            )
        hint = suggest(name, like) or f"known: {shorten(', '.join(like), 300)}"
        self.fail(f"unknown {what} {excerpt(name)} {self.place(token)}", hint=hint)

    def choice(self, depth: int) -> None:
        """Parse the arguments of ``if``: a comparison, and two expressions."""
        self.advance()
        self.expression(0, depth + 1)
        comparison = COMPARISONS.get(self.token.text)
        if comparison is None:
            self.unexpected(
                "a comparison",
                hint="a condition compares two values by < <= > >= == or !=: if(t < 1, a, b)",
            )
        self.advance()
        self.expression(0, depth + 1)
        if self.token.text in COMPARISONS:
            self.unexpected(
                "','", hint="one comparison in each condition: if(0 < t, if(t < 1, a, b), b)"
            )
        self.emit(comparison)
        for closing in (",", ",", ")"):
            if self.token.text != closing:
                self.unexpected(f"{closing!r}", hint="write if(condition, a, b)")
            self.advance()
            if closing == ",":
                self.expression(0, depth + 1)
        self.emit(IF)

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
                f"{token.text} takes {wanted} argument{plural}, not {count}, {self.place(token)}",
                hint=ARGUMENT_HINTS.get((token.text, count)),
            )

    def emit(self, step: Step) -> None:
        """Append a step; fold operations on constants."""
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
            comparison = self.token.text in COMPARISONS
            hint = "a comparison belongs into the condition of if(condition, a, b)"
            self.unexpected(f"{symbol!r} or an operator", hint=hint if comparison else None)
        self.advance()

    def place(self, token: _Token | None = None) -> str:
        return f"at column {(token or self.token).column} of {excerpt(self.source)}"

    def unexpected(self, wanted: str, hint: str | None = None) -> NoReturn:
        if self.token.text in _SPELLINGS:
            hint = f"write {_SPELLINGS[self.token.text]!r}"
        elif self.token.text == "/" and self.source[self.token.column - 2] == "/":
            hint = "write floor(a / b) for the whole quotient"
        found = "the end" if self.token.kind == "end" else excerpt(self.token.text)
        self.fail(f"expected {wanted}, found {found} {self.place()}", hint=hint)

    def fail(self, message: str, hint: str | None = None) -> NoReturn:
        raise CurveError(message, hint=hint)

"""Params: named values that the expressions of a scene or a curve share.

Each is a number, or an expression in constants and other params. Must not know curves.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from graphlib import CycleError, TopologicalSorter

from voxdisplay.argument_checks import described
from voxdisplay.errors import CurveError
from voxdisplay.expressions.operations import FUNCTIONS
from voxdisplay.expressions.parse import CONSTANTS, constant, excerpt, names_in
from voxdisplay.expressions.program import VARIABLE

MAX_PARAMS = 1000
"""Most params of one scene or curve."""

# Functions that came later may still name a param: a call is told by its bracket.
_LATER = {"ln", "log10", "log2", "sign", "floor", "ceil", "round", "mod", "cbrt", "sec", "csc"}
_LATER |= {"cot", "asinh", "acosh", "atanh", "clamp", "mix", "smoothstep"}
RESERVED = ({*FUNCTIONS} - _LATER) | {*CONSTANTS, VARIABLE}
"""Names that a param cannot have."""

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_NAME_HINT = "a name is letters a-z A-Z, digits and _, and does not begin with a digit"


def check_name(name: object, what: str) -> None:
    """Raise CurveError if a name cannot be used in expressions, or has another meaning there.

    Parameters
    ----------
    name : object
    what : str
        What it is a name of: ``"a param"``.

    """
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise CurveError(f"{excerpt(name)} cannot be the name of {what}", hint=_NAME_HINT)
    if name in RESERVED:
        raise CurveError(f"{what} cannot be called {name!r}: that has a meaning already")


def param_order(params: Mapping[str, str | float | Sequence[str | float]]) -> tuple[str, ...]:
    """Return the names of params in an order in which each uses only earlier ones.

    Parameters
    ----------
    params : mapping of str to str, float or sequence of these
        An expression, or all that the value of the param depends on.

    Raises
    ------
    CurveError
        If a name cannot be used in expressions or has another meaning there, or if params depend
        on each other in a circle.

    """
    if not isinstance(params, Mapping):
        raise CurveError(f"params are a mapping of names to values, not {described(params)}")
    if len(params) > MAX_PARAMS:
        raise CurveError(f"{len(params)} params are more than {MAX_PARAMS}")
    for name in params:
        check_name(name, "a param")
    uses = {
        name: [
            word
            for text in ([source] if isinstance(source, str | float | int) else source)
            for word in names_in(str(text))
            if word in params
        ]
        for name, source in params.items()
    }
    try:
        return tuple(TopologicalSorter(uses).static_order())
    except CycleError as error:
        circle = " -> ".join(reversed(error.args[1]))
        raise CurveError(f"params go in a circle: {excerpt(circle)}") from None


def resolve_params(params: Mapping[str, str | float]) -> dict[str, float]:
    """Return the values of params, which are numbers or expressions in constants and other params.

    Raises
    ------
    CurveError
        As `param_order` and `constant`; the message begins with the param's name.

    """
    values: dict[str, float] = {}
    for name in param_order(params):
        try:
            values[name] = constant(params[name], values)
        except CurveError as error:
            raise CurveError(f"param {name}: {error}", hint=error.hint) from None
    return values

"""Random expressions: values against numpy, derivatives against differences, any text."""

from __future__ import annotations

import numpy as np
from functions_in_numpy import IN_NUMPY
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from voxdisplay.errors import CurveError
from voxdisplay.expressions.operations import FUNCTIONS
from voxdisplay.expressions.parse import constant, parse
from voxdisplay.expressions.program import Expression

COMPARED = {
    "<": np.less,
    "<=": np.less_equal,
    ">": np.greater,
    ">=": np.greater_equal,
    "==": np.equal,
    "!=": np.not_equal,
}
SMOOTH = ("sin", "cos", "atan", "tanh", "exp", "sinh", "cosh", "asinh")
T = np.linspace(-2.0, 2.0, 9)

Tree = tuple[object, ...]

leaves = st.one_of(
    st.just(("t",)),
    st.floats(0.25, 4).map(lambda x: ("number", round(x, 3))),
    st.sampled_from(["pi", "e", "tau", "deg"]).map(lambda name: ("constant", name)),
)


def trees(functions: tuple[str, ...], operators: tuple[str, ...]) -> st.SearchStrategy[Tree]:
    def grow(children: st.SearchStrategy[Tree]) -> st.SearchStrategy[Tree]:
        calls = st.sampled_from(functions).flatmap(
            lambda name: st.tuples(
                st.just("call"), st.just(name), *[children] * FUNCTIONS[name].arity
            )
        )
        infix = st.tuples(st.just("infix"), st.sampled_from(operators), children, children)
        negative = st.tuples(st.just("negative"), children)
        choice = st.tuples(st.just("if"), st.sampled_from(sorted(COMPARED)), *[children] * 4)
        return st.one_of(calls, infix, negative, *[choice] * ("floor" in functions))

    return st.recursive(leaves, grow, max_leaves=12)


def printed(tree: Tree, binding: int = 0) -> str:
    """Print a tree with no more brackets than Python's precedence needs."""
    match tree:
        case ("t",):
            return "t"
        case ("number" | "constant", x):
            return str(x)
        case ("call", name, *operands):
            return f"{name}({', '.join(printed(x) for x in operands)})"  # type: ignore[arg-type]
        case ("negative", x):
            text, own = "-" + printed(x, 3), 3  # type: ignore[arg-type]
        case ("if", operator, *operands):
            left, right, a, b = (printed(x) for x in operands)  # type: ignore[arg-type]
            return f"if({left} {operator} {right}, {a}, {b})"
        case ("infix", operator, a, b):
            own = {"+": 1, "-": 1, "*": 2, "/": 2, "**": 4}[operator]  # type: ignore[index]
            left, right = (5, 3) if operator == "**" else (own, own + 1)
            text = f"{printed(a, left)} {operator} {printed(b, right)}"  # type: ignore[arg-type]
    return f"({text})" if own < binding else text


def evaluated(tree: Tree) -> np.ndarray:
    match tree:
        case ("t",):
            return T
        case ("number", x):
            return np.full_like(T, x)
        case ("constant", name):
            return np.full_like(
                T, {"pi": np.pi, "e": np.e, "tau": 2 * np.pi, "deg": np.pi / 180}[name]
            )
        case ("call", name, *operands):
            return np.asarray(IN_NUMPY[name](*map(evaluated, operands)))
        case ("if", operator, *operands):
            left, right, a, b = map(evaluated, operands)
            return np.where(COMPARED[operator](left, right), a, b)
        case ("negative", x):
            return -evaluated(x)
        case ("infix", operator, a, b):
            functions = {"+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide}
            functions["**"] = np.power
            return functions[operator](evaluated(a), evaluated(b))
    raise AssertionError(tree)


@settings(deadline=None)
@given(trees(tuple(IN_NUMPY), ("+", "-", "*", "/", "**")))
def test_printed_and_parsed_expressions_evaluate_like_numpy(tree: Tree) -> None:
    with np.errstate(all="ignore"):
        expected = evaluated(tree)
        assume(np.isfinite(expected).any())
        assume(np.nanmax(np.abs(expected)) < 1e12)
        # Powers may differ in the last place; do not let that be blown up.
        nudged = parse(printed(tree)).value(T * (1 + 1e-13))
    computed = parse(printed(tree)).value(T)
    steady = np.isclose(computed, nudged, rtol=1e-9, atol=1e-9) & np.isfinite(expected)
    np.testing.assert_allclose(computed[steady], expected[steady], rtol=1e-9, atol=1e-9)


@settings(deadline=None)
@given(trees(SMOOTH, ("+", "-", "*")))
def test_derivatives_are_the_limit_of_differences(tree: Tree) -> None:
    expression = parse_or_reject(printed(tree))
    h = 1e-4
    around = [expression.value(T + k * h) for k in (-2, -1, 1, 2)]
    assume(all(np.isfinite(x).all() and np.abs(x).max() < 1e4 for x in around))
    far, near = (around[3] - around[0]) / (4 * h), (around[2] - around[1]) / (2 * h)
    # Where the two differ little, Richardson's extrapolation is far better than either.
    smooth = np.abs(far - near) < 1e-4 * (1 + np.abs(near))
    limit = near + (near - far) / 3
    np.testing.assert_allclose(
        expression.derivative(T)[smooth], limit[smooth], rtol=1e-4, atol=1e-4
    )


def parse_or_reject(text: str) -> Expression:
    try:
        return parse(text)
    except CurveError:
        assume(condition=False)
        raise


@settings(deadline=None)
@given(st.text() | st.text("t0123456789.e+-*/(),^ \0sincoxpf<>=!if[]'_", max_size=60))
def test_any_text_is_an_expression_or_a_curve_error(text: str) -> None:
    try:
        expression = parse(text)
    except CurveError as error:
        message = str(error)
        assert len(message.encode()) < 500
    else:
        expression.value(T)
        expression.derivative(T)


@settings(deadline=None)
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_are_read_exactly(number: float) -> None:
    assert constant(repr(number)) == number
    assert constant(number) == number

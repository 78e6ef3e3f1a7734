"""Expression language: values, derivatives, limits and syntax errors."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
from functions_in_numpy import IN_NUMPY

from voxdisplay.errors import CurveError
from voxdisplay.expressions.interval import Interval
from voxdisplay.expressions.operations import FUNCTIONS
from voxdisplay.expressions.params import MAX_PARAMS, param_order, resolve_params
from voxdisplay.expressions.parse import MAX_DEPTH, MAX_LENGTH, MAX_STEPS, constant, parse
from voxdisplay.expressions.program import values_of_template

T = np.array([0.25, 0.5, 2.0])


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1 + 2*3", 7),
        ("(1 + 2)*3", 9),
        ("8 - 4 - 2", 2),
        ("8 / 4 / 2", 1),
        ("2**3**2", 512),
        ("-2**2", -4),
        ("(-2)**2", 4),
        ("2**-1", 0.5),
        ("2**-1*3", 1.5),
        ("2**-2**2", 1 / 16),
        ("-2*-3", 6),
        ("--+-1", -1),
        ("2*-3 + 1", -5),
        (".5 + 1. + 1e1 + 2.5E-1", 11.75),
        (" \t1\n+ 1 ", 2),
        ("pi + tau + e", math.pi + math.tau + math.e),
        ("180*deg", math.pi),
        ("max(1, 2, 3) + min(3, 2, 1)", 4),
        ("hypot(1, 2, 2)", 3),
        ("atan2(1, -1)", 3 * math.pi / 4),
        ("abs(-3) + sqrt(16) + log(e)", 8),
    ],
)
def test_constant_expressions_mean_what_they_mean_in_python(text: str, value: float) -> None:
    assert constant(text) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("name", sorted(FUNCTIONS.keys() - {"if"}))
def test_every_function_of_t_agrees_with_numpy(name: str) -> None:
    function = IN_NUMPY[name]
    arguments = (T / 3, 0.3 + 0 * T, 1.7 + 0 * T)[: FUNCTIONS[name].arity]
    text = f"{name}({', '.join(('t/3', '0.3', '1.7')[: FUNCTIONS[name].arity])})"
    with np.errstate(all="ignore"):
        np.testing.assert_allclose(parse(text).value(T), function(*arguments), rtol=2e-15)


def test_values_have_the_shape_of_t() -> None:
    for n in (0, 1, 5):
        for text in ("7", "t", "t + 1"):
            expression = parse(text)
            assert expression.value(np.ones(n)).shape == (n,)
            assert expression.derivative(np.ones(n)).shape == (n,)


def test_a_value_is_never_the_callers_array() -> None:
    t = T.copy()
    parse("t").value(t)[:] = 0
    np.testing.assert_array_equal(t, T)


def test_params_are_names_with_values() -> None:
    expression = parse("o + R*cos(t)", {"o": 50, "R": 40})
    np.testing.assert_array_equal(expression.value(T), 50 + 40 * np.cos(T))


def test_what_does_not_depend_on_t_is_computed_once() -> None:
    assert parse("2*3 + sin(pi/2)").constant == 7
    assert parse("2*t").constant is None
    assert len(parse("(2*3 - 1)*t").program) == 3


@pytest.mark.parametrize(
    ("text", "slope"),
    [
        ("7", lambda t: 0 * t),
        ("t", lambda t: 0 * t + 1),
        ("t**2", lambda t: 2 * t),
        ("2**t", lambda t: 2**t * np.log(2)),
        ("t**t", lambda t: t**t * (np.log(t) + 1)),
        ("1/t", lambda t: -1 / t**2),
        ("cos(3*t)", lambda t: -3 * np.sin(3 * t)),
        ("t - -t", lambda t: 0 * t + 2),
        ("atan2(sin(t), cos(t))", lambda t: 0 * t + 1),
        ("max(t, 1, 2 - t)", lambda t: np.where(t > 1, 1.0, np.where(t < 1, -1.0, 0.0))),
    ],
)
def test_derivatives(text: str, slope: object) -> None:
    np.testing.assert_allclose(parse(text).derivative(T), slope(T), atol=1e-12)  # type: ignore[operator]


def test_the_derivative_of_a_power_is_finite_where_it_exists() -> None:
    zero = np.zeros(1)
    assert parse("t**2").derivative(zero) == 0
    assert parse("t**1").derivative(zero) == 1
    assert parse("t**0").derivative(zero) == 0
    assert parse("(t - 1)**3").derivative(zero) == 3
    assert not np.isfinite(parse("sqrt(t)").derivative(zero))


def test_what_has_no_value_is_not_finite_and_says_nothing() -> None:
    t = np.array([-1.0, 0.0, 1e300])
    for text in ("log(t)", "1/(t*0)", "t**0.5*0 + sqrt(t)*exp(t)", "asin(2 + abs(t))"):
        assert not np.isfinite(parse(text).value(t)).all()
        parse(text).derivative(t)


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        ("1 + sine(t)", r"unknown function 'sine' at column 5 of '1 \+ sine\(t\)'", "'sin'"),
        ("arccos(t)", "unknown function 'arccos' at column 1", "'acos'"),
        ("2*RR", "unknown name 'RR' at column 3", "pi"),
        ("__import__('os')", "unknown function '__import__' at column 1", "sin"),
        ("t.real", "found '.' at column 2", None),
        ("t[0]", r"found '\[' at column 2", None),
        ("t if t else 1", "found 'if' at column 3", None),
        ("lambda: 1", "unknown name 'lambda' at column 1", None),
        ("'a'", "expected a value, found .'. at column 1", None),
        ("t = 1", "found '=' at column 3", None),
        ("1 < 2", "found '<' at column 3", None),
        ("7 // 2", "expected a value, found '/' at column 4", None),
        ("7 % 2", "found '%' at column 3", None),
        ("t^2", r"found '\^' at column 2", "**"),
        ("2\u00d7t", "found '\u00d7' at column 2", "*"),
        ("2t", "found 't' at column 2", "product"),
        ("2(t)", r"found '\(' at column 2", "product"),
        ("pi(2)", "'pi' at column 1 of .* is not a function", "product"),
        ("sin", "function 'sin' at column 1 .* needs an argument", None),
        ("sin t", "function 'sin' at column 1 .* needs an argument", None),
        ("sin()", "sin takes 1 argument, not 0", None),
        ("sin(1, 2)", "sin takes 1 argument, not 2", None),
        ("atan2(1)", "atan2 takes 2 arguments, not 1", None),
        ("atan2(1, 2, 3)", "atan2 takes 2 arguments, not 3", None),
        ("max(1)", "max takes 2 or more arguments, not 1", None),
        ("sin(t,)", "expected a value", None),
        ("sin(,t)", "expected a value", None),
        ("(t", r"expected '\)' or an operator, found the end at column 3", None),
        ("t)", r"found '\)' at column 2", None),
        ("t +", "expected a value, found the end at column 4", None),
        ("* t", "expected a value", None),
        ("", "is empty", None),
        ("  ", "is empty", None),
        ("1e999", "too large", None),
        ("1_000", "found '_000' at column 2", None),
        ("0x10", "found 'x10' at column 2", None),
        ("1j", "found 'j' at column 2", None),
        ("t\0", "found '.x00' at column 2", None),
        ("\u0661", "expected a value", None),
        ("9**9**9", "is not finite: inf", None),
        ("0/0", "is not finite: nan", None),
    ],
)
def test_what_is_wrong_is_said_with_its_column(text: str, message: str, hint: str | None) -> None:
    with pytest.raises(CurveError, match=message) as caught:
        parse(text)
    if hint:
        assert hint in str(caught.value.hint)


@pytest.mark.parametrize(
    "text",
    [
        "(" * 3000,
        "-" * 3000 + "t",
        "2**" * 1000 + "t",
        "sin(" * 900 + "t" + ")" * 900,
        "t" + "+t" * 2000,
        "1" * 10_000_000,
        "9**" * 30 + "9",
        "max(" + "t," * 2000 + "t)",
    ],
)
def test_hostile_text_is_refused_at_once(text: str) -> None:
    start = time.perf_counter()
    with pytest.raises(CurveError) as caught:
        parse(text)
    assert time.perf_counter() - start < 0.2
    assert len(str(caught.value)) < 300


def test_limits_are_generous_to_people() -> None:
    assert constant("(" * (MAX_DEPTH - 1) + "1" + ")" * (MAX_DEPTH - 1)) == 1
    assert parse("+".join(["t"] * (MAX_STEPS // 2))).value(T).tolist() == (T * 512).tolist()
    assert constant(" " * (MAX_LENGTH - 1) + "1") == 1


def test_t_has_no_value_outside_of_formulas() -> None:
    with pytest.raises(CurveError, match=r"'t' at column 3 of '2\*t' has no value here"):
        constant("2*t")


def test_numbers_stand_for_themselves() -> None:
    assert constant(3) == 3
    with pytest.raises(CurveError, match="not finite"):
        constant(math.nan)


def test_params_may_use_each_other_in_any_order() -> None:
    params = {"c": "a + b", "a": "2*b", "b": 3, "angle": "90*deg"}
    assert resolve_params(params) == {"c": 9, "a": 6, "b": 3, "angle": math.pi / 2}


def test_a_long_chain_of_params_is_no_recursion() -> None:
    chain: dict[str, str | float] = {f"p{i}": f"p{i + 1}" for i in range(MAX_PARAMS - 1)}
    assert resolve_params(chain | {f"p{MAX_PARAMS - 1}": 1})["p0"] == 1


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"a": "a"}, "circle: 'a -> a'"),
        ({"a": "b", "b": "2*c", "c": "a"}, "circle"),
        ({"sin": 1}, "'sin'"),
        ({"pi": 1}, "'pi'"),
        ({"t": 1}, "'t'"),
        ({"2a": 1}, "'2a'"),
        ({"": 1}, "''"),
        ({"a b": 1}, "'a b'"),
        ({"a": "2*zz"}, "param a: unknown name 'zz'"),
        ({"a": "t"}, "param a: 't'"),
        ({f"p{i}": 1 for i in range(MAX_PARAMS + 1)}, "1001 params"),
    ],
)
def test_wrong_params(params: dict[str, str | float], message: str) -> None:
    with pytest.raises(CurveError, match=message):
        resolve_params(params)


def test_param_order_is_that_of_the_file_where_it_can_be() -> None:
    assert param_order({"b": 1, "a": 2, "c": "a"}) == ("b", "a", "c")


def test_fold_runs_over_any_kind_of_value() -> None:
    def enclose(operation: object, x: tuple[tuple[float, float], ...]) -> tuple[float, float]:
        assert operation.name == "+"  # type: ignore[attr-defined]
        (a, b), (c, d) = x
        return a + c, b + d

    assert parse("t + 1 + t").fold([(0.0, 1.0)], lambda x: (x, x), enclose) == (1.0, 3.0)


def test_expressions_of_several_variables_broadcast() -> None:
    expression = parse("u - 10*v + k", {"k": 0.5, "u": 7.0}, variables=("u", "v"))
    u, v = np.arange(3.0)[:, None], np.arange(2.0)
    assert np.array_equal(expression.value(u, v), u - 10 * v + 0.5)
    bounds = expression.enclosure(Interval(u, u + 1), Interval(v, v))
    assert (bounds.lo <= u - 10 * v + 0.5).all()
    assert (bounds.hi >= u - 10 * v + 1.5).all()
    assert parse("3", variables=("u", "v")).value(u, v).shape == (3, 2)


def test_other_variables_than_those_named_are_unknown() -> None:
    with pytest.raises(CurveError, match="unknown name 'w' at column 5"):
        parse("u + w", variables=("u", "v"))
    with pytest.raises(CurveError, match="'t' at column 1") as caught:
        parse("t", variables=("u", "v"))
    assert caught.value.hint == "the variables here are u and v"


@pytest.mark.parametrize(
    ("operation", "times"),
    [*((each, 64) for each in (*sorted(FUNCTIONS), *"+-*/", "**")), ("exp", 50), ("**", 50)],
)
def test_values_of_a_template_are_those_of_each_expression(operation: str, times: int) -> None:
    """To the bit: a frame of a scene must not depend on how many objects there are."""
    rng = np.random.default_rng(8)
    time_s = np.linspace(-3, 9, times)
    speed = rng.uniform(0, 1, times)

    def text() -> str:
        operands = [f"({x:.5f} + {y:.5f}*time)" for x, y in rng.uniform(-2, 2, (3, 2))]
        if operation == "**":
            return f"{abs(rng.normal()):.4f}**time + abs(time)**2 + speed**{operands[0]}"
        if operation == "if":
            return f"if(time < {rng.normal():.4f}, {operands[0]}, {operands[1]})"
        if operation in FUNCTIONS:
            arity = FUNCTIONS[operation].arity
            return f"{rng.normal():.4f}*{operation}({', '.join(operands[:arity])}) + speed"
        return f"2*({operands[0]} {operation} {operands[1]}) + {rng.normal():.4f}"

    expressions = [parse(text(), variables=("time", "speed")) for _ in range(260)]
    assert len({each.template for each in expressions}) == 1
    together = values_of_template(expressions, (time_s, speed))
    alone = np.array([each.value(time_s, speed) for each in expressions])
    assert together.shape == (260, times)
    assert np.array_equal(together.view(np.int64), alone.view(np.int64))

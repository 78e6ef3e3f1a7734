"""Conditions, functions with steps, and hints for functions of other languages."""

from __future__ import annotations

import math
import pickle
import re

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.errors import CurveError
from voxdisplay.expressions.interval import Interval
from voxdisplay.expressions.operations import FUNCTIONS
from voxdisplay.expressions.params import resolve_params
from voxdisplay.expressions.parse import constant, parse

T = np.linspace(-3, 3, 25)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("ln(e)", 1),
        ("log10(1000)", 3),
        ("log2(8)", 3),
        ("sign(-4) + 10*sign(0) + 100*sign(7)", 99),
        ("floor(-1.5)", -2),
        ("ceil(-1.5)", -1),
        ("round(2.5) + 10*round(3.5) + 100*round(-0.4)", 42),
        ("mod(7, 3)", 1),
        ("mod(-7, 3)", 2),
        ("mod(7, -3)", -2),
        ("cbrt(-27)", -3),
        ("sec(pi/3)", 2),
        ("csc(pi/6)", 2),
        ("cot(pi/4)", 1),
        ("asinh(sinh(2))", 2),
        ("acosh(cosh(2))", 2),
        ("atanh(tanh(0.5))", 0.5),
        ("if(1 < 2, 10, 20)", 10),
        ("if(2 <= 1, 10, 20)", 20),
        ("if(2 > 1, 10, 20)", 10),
        ("if(1 >= 1, 10, 20)", 10),
        ("if(1 == 2, 10, 20)", 20),
        ("if(1 != 2, 10, 20)", 10),
        ("if(1 + 1 == 4/2, 2*5, 1/0)", 10),
        ("2*if(if(1 < 2, 0, 1) < 1, 3, 4) + 1", 7),
    ],
)
def test_constants(text: str, value: float) -> None:
    assert constant(text) == pytest.approx(value, rel=1e-14)


def test_a_condition_on_t() -> None:
    expression = parse("if(t < 1, t, 2 - t)")
    np.testing.assert_array_equal(expression.value(T), np.where(T < 1, T, 2 - T))
    np.testing.assert_array_equal(expression.derivative(T), np.where(T < 1, 1.0, -1.0))


def test_the_branch_that_is_not_taken_may_have_no_value() -> None:
    expression = parse("if(t <= 0, 0, sqrt(t))")
    assert np.isfinite(expression.value(T)).all()
    slopes = expression.derivative(T)
    assert (slopes[T <= 0] == 0).all()
    np.testing.assert_allclose(slopes[T > 0], 0.5 / np.sqrt(T[T > 0]))


@pytest.mark.parametrize("name", sorted(set(FUNCTIONS) - {"if", "min", "max", "abs"}))
def test_derivatives_are_limits_of_differences(name: str) -> None:
    function, h = FUNCTIONS[name], 1e-6
    inner = "t/8 + 1.3" if name == "acosh" else "t/8 + 0.5"
    text = f"{name}({', '.join((inner, 'cos(t)/9 + 2', '3 - sin(t)/7')[: function.arity])})"
    expression = parse(text)
    near = (expression.value(T + h) - expression.value(T - h)) / (2 * h)
    smooth = np.isfinite(near) & (np.abs(near) < 1e3)  # not across a step
    assert smooth.any()
    np.testing.assert_allclose(expression.derivative(T)[smooth], near[smooth], atol=1e-6)


BOUNDED = [
    "floor(2*t)",
    "ceil(t/2) + t",
    "round(t)",
    "sign(t - 0.3)",
    "mod(3*t, 2)",
    "mod(t, -1.5)",
    "mod(2, 3 + t/2)",
    "if(t < 0.7, t*t, 3 - t)",
    "if(t*t >= 1, t, if(t == 0, 5, 1/t))",
    "if(t != 1, 2, 3)",
    "cbrt(t)",
    "sec(t/3)",
    "csc(t + 4)",
    "cot(t + 4)",
    "asinh(t)",
    "acosh(2 + t*t)",
    "atanh(t/4)",
    "log10(4 + t)",
    "log2(4 + t)",
    "ln(4 + t)",
    "clamp(2*t, -1, t/3)",
    "mix(t, 3 - t, sin(t))",
    "mix(1, 4, t)",
    "smoothstep(-1, 1, t)",
    "smoothstep(1, -1, t)",
    "smoothstep(sin(t) - 5, 2, t*t)",
]


@pytest.mark.parametrize("text", BOUNDED)
def test_values_are_enclosed(text: str) -> None:
    expression = parse(text)
    random = np.random.default_rng(5)
    middle, half = random.uniform(-2.5, 2.5, 400), 10 ** random.uniform(-12, -0.3, 400)
    low, high = middle - half, middle + half
    box = expression.enclosure(Interval(low, high))
    assert np.isfinite(box.lo + box.hi).mean() > 0.4
    for share in (0.0, 0.3, 0.5, 0.9, 1.0):
        values = expression.value(np.clip(low + share * (high - low), low, high))
        known = ~np.isnan(box.lo + box.hi) & np.isfinite(values)
        assert (box.lo[known] <= values[known]).all()
        assert (values[known] <= box.hi[known]).all()


@pytest.mark.parametrize(
    ("text", "low", "high", "bounds"),
    [
        ("floor(t)", 0.2, 0.8, (0, 0)),
        ("floor(t)", 0.2, 1.0, (0, 1)),
        ("sign(t)", 0.0, 1.0, (0, 1)),
        ("if(t < 1, 5, 7)", 0.0, 0.9, (5, 5)),
        ("if(t < 1, 5, 7)", 1.0, 2.0, (7, 7)),
        ("if(t < 1, 5, 7)", 0.5, 1.0, (5, 7)),
        ("if(t > 1, 5, 7)", 0.0, 1.0, (7, 7)),
        ("if(t == 3, 5, 7)", 3.0, 3.0, (5, 5)),
        ("if(t == 3, 5, 7)", 3.0, 4.0, (5, 7)),
        ("if(t != 3, 5, 7)", 4.0, 5.0, (5, 5)),
        ("mod(t, 2)", 1.5, 2.5, (0, 2)),
        ("clamp(t, 1, 2)", 0.5, 1.5, (1, 1.5)),
        ("clamp(t, 1, 2)", 3.0, 4.0, (2, 2)),
    ],
)
def test_bounds_are_as_narrow_as_they_can_be(
    text: str, low: float, high: float, bounds: tuple[float, float]
) -> None:
    box = parse(text).enclosure(Interval(np.array([low]), np.array([high])))
    assert (float(box.lo[0]), float(box.hi[0])) == bounds


@pytest.mark.parametrize("text", ["mod(1, t)", "if(1/t < 1, 2, 3)", "if(t < 1, 1/t, 3)"])
def test_nothing_is_known_where_a_divisor_may_be_0(text: str) -> None:
    box = parse(text).enclosure(Interval(np.array([-1.0]), np.array([1.0])))
    assert np.isnan(box.lo[0] + box.hi[0])


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        ("arctan(t)", "unknown function 'arctan'", "write 'atan'"),
        ("lg(t)", "unknown function 'lg'", "write 'log10'"),
        ("pow(t, 2)", "unknown function 'pow'", r"write a\*\*b"),
        ("sgn(t)", "unknown function 'sgn'", "write 'sign'"),
        ("Sin(t)", "unknown function 'Sin'", "did you mean 'sin'"),
        ("sqtr(t)", "unknown function 'sqtr'", "did you mean 'sqrt'"),
        ("hypott(t, 1)", "unknown function", "did you mean 'hypot'"),
        ("inf", "unknown name 'inf'", "numbers are finite"),
        ("t % 2", "found '%'", r"write 'mod\(a, b\)'"),
        ("t // 2", "found '/'", r"write floor\(a / b\)"),
        ("t < 2", "found '<'", r"condition of if\(condition, a, b\)"),
        ("2*(t < 2)", "found '<'", r"condition of if\(condition, a, b\)"),
        ("if(t, 1, 2)", "expected a comparison, found ','", r"if\(t < 1, a, b\)"),
        ("if(t = 1, 1, 2)", "found '='", "write '=='"),
        ("if(0 < t < 1, 1, 2)", "found '<'", "one comparison in each condition"),
        ("if(t < 1, 1)", r"expected ',', found '\)'", r"if\(condition, a, b\)"),
        ("if(t < 1, 1, 2, 3)", r"expected '\)', found ','", r"if\(condition, a, b\)"),
        ("log(8, 2)", "log takes 1 argument, not 2", r"log\(x\) / log\(base\)"),
        ("t\N{SUPERSCRIPT TWO}", "found", r"\*\*2"),
        ("t and 1", "found 'and'", r"if\(a, if\(b, x, y\), y\)"),
        ("t mod 2", "found 'mod'", r"write mod\(a, b\)"),
        ("t if 1 else 2", "found 'if'", r"write if\(condition, a, b\)"),
        ("2 if(t < 1, 1, 2)", "found 'if'", "a product is written"),
        ("1 000", "found '000'", "without gaps"),
        ("1_000", "found '_000'", "without gaps"),
        ("1.2.3 + t", "found '.3'", "without gaps"),
        ("t 2", "found '2'", "a product is written"),
        ("0,5", "found ','", "decimals are written with a point"),
        ("t,5", "found ','", "None"),
        ("0x10", "found 'x10'", "in decimal: 16, not 0x10"),
        ("1 + 0b1", "found 'b1'", "in decimal"),
        ("10x", "found 'x'", "a product is written"),
        ("pi()", "'pi' at column 1 of .* is not a function", "write pi without"),
        ("pi(2)", "'pi' at column 1 of .* is not a function", "a product is written"),
        ("sin^2(t)", "needs an argument", r"write sin\(x\)\*\*n for its power"),
        ("sin**2", "needs an argument", r"write sin\(x\)\*\*n for its power"),
        ("sin t", "needs an argument", "None"),
        ("np.sin(t)", "unknown name 'np'", "names of functions and constants alone"),
        ("Math.PI", "unknown name 'Math'", "names of functions and constants alone"),
    ],
)
def test_hints_name_what_is_meant(text: str, message: str, hint: str) -> None:
    with pytest.raises(CurveError, match=message) as caught:
        parse(text)
    assert re.search(hint, str(caught.value.hint)), caught.value.hint


@pytest.mark.parametrize(
    "text", ["erf(t)", "gamma(t)", "sinc(t)", "besselj(t)", "foo(t)", "x(t)", "ta(t)"]
)
def test_no_hint_is_better_than_a_wrong_one(text: str) -> None:
    with pytest.raises(CurveError, match="unknown function") as caught:
        parse(text)
    assert str(caught.value.hint).startswith("known: ")


def test_functions_that_came_later_may_still_name_a_param() -> None:
    values = resolve_params({"sec": 3, "mod": "sec + 1"})
    assert parse("sec + mod(7, mod)", values).constant == 6
    with pytest.raises(CurveError, match="a param cannot be called 'sin'"):
        resolve_params({"sin": 1})
    with pytest.raises(CurveError, match="a param cannot be called 'if'"):
        resolve_params({"if": 1})


@pytest.mark.parametrize("certified", [False, True])
@pytest.mark.parametrize(
    ("text", "levels"),
    [
        ("10.5 + 5*floor(t)", [0, 5, 10, 15]),
        ("10.5 + 5*sign(t + 0.5)", [5, 15]),
        ("if(t < 0.3, 4.5, 12.5)", [4, 12]),
        ("10*round(t) + 0.5", [-20, -10, 0, 10, 20]),
        ("20*if(mod(t, 1) < 0.5, 0, 1) + 0.5", [0, 20]),
    ],
)
def test_curves_with_steps_are_split_there(text: str, levels: list[int], certified: bool) -> None:
    sequence = vd.voxelize(vd.Parametric("20 + 9*t", text, "5", t=(-1.9, 1.9)), certified=certified)
    assert sorted(set(sequence.voxels[:, 1].tolist())) == levels
    report = sequence.report
    assert report.pieces == len(report.jumps) + 1 > 1
    assert report.gaps == 0
    assert report.e_max < 0.8661
    for start in sequence.starts[1:]:
        assert abs(int(np.diff(sequence.voxels[start - 1 : start + 1, 1])[0])) > 1


def test_expressions_survive_pickling() -> None:
    for text in BOUNDED:
        expression = pickle.loads(pickle.dumps(parse(text)))  # noqa: S301 - its own
        np.testing.assert_array_equal(expression.value(T), parse(text).value(T))
        assert all(math.isfinite(step) for step in expression.program if isinstance(step, float))

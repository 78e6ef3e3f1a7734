"""Interval enclosures against multiple precision, special cases included."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from voxdisplay.expressions import interval as iv
from voxdisplay.expressions.interval import Interval
from voxdisplay.expressions.operations import FUNCTIONS
from voxdisplay.expressions.parse import parse

EXACT = {
    "sin": mpmath.sin, "cos": mpmath.cos, "tan": mpmath.tan, "asin": mpmath.asin,
    "acos": mpmath.acos, "atan": mpmath.atan, "atan2": mpmath.atan2, "sinh": mpmath.sinh,
    "cosh": mpmath.cosh, "tanh": mpmath.tanh, "exp": mpmath.exp, "log": mpmath.log,
    "sqrt": mpmath.sqrt, "hypot": mpmath.hypot, "abs": abs, "min": min, "max": max,
    "ln": mpmath.log, "log10": mpmath.log10, "log2": lambda x: mpmath.log(x, 2),
    "cbrt": lambda x: mpmath.sign(x) * mpmath.cbrt(abs(x)), "asinh": mpmath.asinh,
    "acosh": mpmath.acosh, "atanh": mpmath.atanh, "sec": mpmath.sec, "csc": mpmath.csc,
    "cot": mpmath.cot, "sign": mpmath.sign, "floor": mpmath.floor, "ceil": mpmath.ceil,
    "round": mpmath.nint, "mod": lambda a, b: a - b * mpmath.floor(a / b),
    "clamp": lambda x, a, b: min(max(x, a), b), "mix": lambda a, b, x: a * (1 - x) + b * x,
    "smoothstep": lambda a, b, x: smoothstep(min(max((x - a) / (b - a), 0), 1)),
}  # fmt: skip


def smoothstep(share):
    return share * share * (3 - 2 * share)


RANGES = {"asin": 1, "acos": 1, "exp": 700, "sinh": 700, "cosh": 700, "tan": 1e6, "sin": 1e9}
RANGES |= {"atanh": 1}
POSITIVE = {"log", "ln", "log10", "log2", "sqrt", "acosh"}
INF = math.inf


@pytest.fixture(autouse=True)
def _many_digits():
    with mpmath.workdps(60), np.errstate(all="ignore"):
        yield


def spread(lo, hi):
    return Interval(np.array([lo], dtype=float), np.array([hi], dtype=float))


def bounds(box):
    return float(box.lo[0]), float(box.hi[0])


def enclosed(source, lo, hi):
    return bounds(parse(source).enclosure(spread(lo, hi)))


def known(box):
    return not (np.isnan(box.lo) | np.isnan(box.hi)).any()


def test_every_function_has_an_exact_counterpart_here():
    assert set(EXACT) == set(FUNCTIONS) - {"if"}


@pytest.mark.parametrize("name", sorted(EXACT))
def test_numpy_is_as_exact_as_assumed_and_points_are_enclosed(name):
    rng = np.random.default_rng(7)
    size, reach = 1500, RANGES.get(name, 50)
    low = {"asin": -6, "acos": -6, "atanh": -6, "acosh": 1e-9}.get(name, -12)
    sizes = 10 ** rng.uniform(low, math.log10(reach), (FUNCTIONS[name].arity, size))
    operands = sizes * (1 if name in POSITIVE else rng.choice([-1, 1], sizes.shape))
    floats = FUNCTIONS[name].value(*operands)
    boxes = FUNCTIONS[name].enclosure(*map(iv.interval, operands))
    for i in range(size):
        exact = EXACT[name](*(mpmath.mpf(x[i]) for x in operands))
        # Sines and cosines need not be exact in their own last place, only in that of 1.
        unit = np.spacing(1.0 if name in {"sin", "cos"} else abs(float(exact)))
        if name == "mix":  # two terms, which may cancel
            a, b, x = operands[:, i]
            unit = np.spacing(abs(a * (1 - x)) + abs(b * x))
        assert abs(exact - mpmath.mpf(floats[i])) <= 4 * mpmath.mpf(float(unit))
        assert mpmath.mpf(boxes.lo[i]) <= exact <= mpmath.mpf(boxes.hi[i])
        assert boxes.lo[i] <= floats[i] <= boxes.hi[i]


FINITE = st.floats(-1e6, 1e6) | st.integers(-20, 20).map(float)
PAIRS = st.tuples(FINITE, FINITE | st.floats(0, 1e-3)).map(
    lambda pair: (min(pair), max(pair)) if pair[0] <= pair[1] else (pair[1], pair[0])
)
SHARES = st.lists(st.floats(0, 1), min_size=3, max_size=3).map(lambda s: [0.0, 1.0, *s])
BINARY = ["+", "-", "*", "/", "atan2", "hypot", "min", "max"]


def inside(pair, share):
    return min(max(pair[0] + share * (pair[1] - pair[0]), pair[0]), pair[1])


@given(st.sampled_from(BINARY), PAIRS, PAIRS, SHARES)
@settings(max_examples=250, deadline=None)
def test_binary_operations(name, a, b, shares):
    exact = {
        "+": lambda x, y: x + y,
        "-": lambda x, y: x - y,
        "*": lambda x, y: x * y,
        "/": lambda x, y: x / y,
    }.get(name) or EXACT[name]
    operation = {"+": iv.add, "-": iv.subtract, "*": iv.multiply, "/": iv.divide}.get(name)
    box = (operation or FUNCTIONS[name].enclosure)(spread(*a), spread(*b))
    if name == "/" and b[0] <= 0 <= b[1]:
        assert not known(box)
        return
    assert known(box)
    lo, hi = (mpmath.mpf(end) for end in bounds(box))
    for x in shares:
        for y in shares:
            p, q = mpmath.mpf(inside(a, x)), mpmath.mpf(inside(b, y))
            if name != "atan2" or p or q:
                assert lo <= exact(p, q) <= hi


@given(
    st.sampled_from(["sin", "cos", "tan", "atan", "exp", "sinh", "cosh", "tanh", "abs"]),
    st.floats(-30, 30) | st.floats(-1e15, 1e15),
    st.floats(0, 8) | st.floats(0, 1e-9),
    SHARES,
)
@settings(max_examples=250, deadline=None)
def test_functions(name, start, width, shares):
    if name in RANGES and name != "sin":
        start = math.fmod(start, 300)
    pair = (start, start + width)
    box = FUNCTIONS[name].enclosure(spread(*pair))
    if name == "tan" and not known(box):
        poles = [mpmath.ceil(mpmath.mpf(x) / mpmath.pi - 0.5) for x in pair]
        near = min(abs(mpmath.cos(x)) for x in pair) < 1e-9 * (1 + abs(start))
        assert poles[0] != poles[1] or near
        return
    lo, hi = (mpmath.mpf(end) for end in bounds(box))
    for share in shares:
        assert lo <= EXACT[name](mpmath.mpf(inside(pair, share))) <= hi


@given(
    st.floats(-1e3, 1e3), st.floats(0, 5), st.integers(-6, 6) | st.sampled_from([0.5, 2.5, -1.5])
)
@settings(max_examples=200, deadline=None)
def test_constant_powers(start, width, exponent):
    pair = (start, start + width)
    box = iv.power(spread(*pair), iv.interval(float(exponent)))
    if (exponent < 0 and pair[0] <= 0 <= pair[1]) or (exponent % 1 and pair[1] < 0):
        assert not known(box)
        return
    if not known(box):
        assert exponent < 0  # the base is too near to 0
        return
    assert bool(np.any(box.may_be_undefined)) == bool(exponent % 1 and pair[0] < 0)
    lo, hi = (mpmath.mpf(end) for end in bounds(box))
    for share in np.linspace(0, 1, 9):
        base = mpmath.mpf(inside(pair, float(share)))
        if base >= 0 or exponent % 1 == 0:
            assert lo <= base ** mpmath.mpf(exponent) <= hi


@pytest.mark.parametrize(
    ("source", "lo", "hi", "low", "high"),
    [
        ("sin(t)", 0, 7, -1, 1),
        ("sin(t)", 1, 2, math.sin(1), 1),
        ("cos(t)", 3, 4, -1, math.cos(4)),
        ("sin(t)", -INF, INF, -1, 1),
        ("cos(t)", 1e300, 1e301, -1, 1),
        ("t*t", -2, 3, 0, 9),
        ("t**2", -2, 3, 0, 9),
        ("t**3", -2, 3, -8, 27),
        ("t**-2", 2, 4, 1 / 16, 1 / 4),
        ("t**0", -2, 3, 1, 1),
        ("abs(t)", -2, 3, 0, 3),
        ("abs(t)", -3, -2, 2, 3),
        ("cosh(t)", -1, 2, 1, math.cosh(2)),
        ("hypot(t, 3)", -4, 4, 3, 5),
        ("min(t, 1)", 0, 3, 0, 1),
        ("max(t, 1)", 0, 3, 1, 3),
        ("2**t", -1, 3, 0.5, 8),
        ("t**t", 1, 2, 1, 4),
        ("atan2(t, -1)", -1, 1, -math.pi, math.pi),
        ("atan2(t, 1)", -1, 1, -math.pi / 4, math.pi / 4),
        ("atan2(1, t)", -1, 1, math.pi / 4, 3 * math.pi / 4),
        ("atan2(t, t)", -1, 1, -math.pi, math.pi),
        ("sqrt(t)", -1, 4, 0, 2),
        ("asin(t)", -2, 2, -math.pi / 2, math.pi / 2),
        ("acos(t)", 0.5, 3, 0, math.pi / 3),
        ("log(t)", 0, 1, -INF, 0),
        ("exp(-t*t)", 100, 1e200, 0, 0),
        ("exp(t)", 0, 1000, 1, INF),
        ("-t", 1, 2, -2, -1),
    ],
)
def test_bounds_are_right_and_tight(source, lo, hi, low, high):
    got = enclosed(source, lo, hi)
    assert got[0] <= low
    assert got[1] >= high
    assert got == pytest.approx((low, high), rel=1e-14, abs=1e-14)


@pytest.mark.parametrize(
    ("source", "lo", "hi"),
    [
        ("1/t", -1, 1),
        ("1/t", 0, 1),
        ("t**-1", -1, 2),
        ("t**-2", 0, 2),
        ("tan(t)", 1, 2),
        ("sqrt(t)", -2, -1),
        ("log(t)", -2, -1),
        ("asin(t)", 2, 3),
        ("t**0.5", -2, -1),
        ("t**-0.5", 0, 1),
        ("(-2)**t", 1, 2),
        ("t**t", -1, 1),
        ("0**t", 0, 1),
    ],
)
@pytest.mark.parametrize("use", ["{}", "sin({})", "atan({})", "min({}, 1)", "({})**0", "1**({})"])
def test_what_is_not_known_stays_so(source, lo, hi, use):
    assert any(map(math.isnan, enclosed(use.format(source), lo, hi)))


@pytest.mark.parametrize(
    "source", ["sqrt(t)", "log(t)", "asin(t - 1)", "t**1.5", "1 + sin(sqrt(t))"]
)
def test_parts_without_a_value_are_marked(source):
    expression = parse(source)
    assert expression.enclosure(spread(-0.5, 0.5)).may_be_undefined.tolist() == [True]
    assert not np.any(expression.enclosure(spread(0.25, 0.5)).may_be_undefined)


@pytest.mark.parametrize("at", [0.5, 1.5, 7.5, 1e5 + 0.5, 2.0**40 + 0.5])
def test_poles_and_crests_are_never_missed(at):
    """The critical points are not floats: one lies in any interval between the floats around."""
    pole = float(mpmath.mpf(at) * mpmath.pi)
    lo, hi = np.nextafter(pole, -INF), np.nextafter(pole, INF)
    assert any(map(math.isnan, enclosed("tan(t)", lo, hi)))
    crest = enclosed("sin(t)", lo, hi)
    assert 1.0 in map(abs, crest)


TERMS = st.recursive(
    st.sampled_from(["t", "2.5", "0.3", "pi", "t*t"]),
    lambda inner: st.one_of(
        st.tuples(st.sampled_from(["sin", "cos", "atan", "exp", "tanh", "abs", "sqrt"]), inner).map(
            lambda call: f"{call[0]}({call[1]})"
        ),
        st.tuples(inner, st.sampled_from(["+", "-", "*", "/"]), inner).map(
            lambda infix: f"({infix[0]} {infix[1]} {infix[2]})"
        ),
        inner.map(lambda base: f"({base})**3"),
        st.tuples(inner, inner).map(lambda pair: f"max({pair[0]}, {pair[1]})"),
    ),
    max_leaves=8,
)


@given(TERMS, st.floats(-5, 5), st.floats(0, 2) | st.floats(0, 1e-6))
@settings(max_examples=300, deadline=None)
def test_random_expressions(source, start, width):
    expression = parse(source) if "t" in source.replace("sqrt", "").replace("tanh", "") else None
    if expression is None:
        return
    t = np.clip(start + width * np.linspace(0, 1, 33), start, start + width)
    box = expression.enclosure(spread(start, start + width))
    if known(box):
        values = expression.value(t)
        values = values[np.isfinite(values)]  # beside a border of what has a value
        assert (box.lo <= values).all()
        assert (values <= box.hi).all()

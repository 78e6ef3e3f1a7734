"""Enclosures of gradients: they hold the slopes that differences find."""

import numpy as np
import pytest

from voxdisplay.expressions.gradient import gradient_enclosure
from voxdisplay.expressions.interval import Interval
from voxdisplay.expressions.operations import FUNCTIONS
from voxdisplay.expressions.parse import parse

_ONE = {name for name, operation in FUNCTIONS.items() if operation.arity == 1}
TEXTS = [
    *(f"{name}(0.3 + u/3 + v/7)" for name in sorted(_ONE - {"acosh"})),
    "acosh(1.5 + u + v)",
    "u*v + u/(2 + v) - v**3",
    "(1.2 + u)**(v + 2)",
    "2**u",
    "atan2(u + 0.1, v - 0.2)",
    "hypot(u, v)",
    "mod(3*u + v, 0.7)",
    "min(u, v) + max(u, 2*v)",
    "clamp(u + v, 0.2, 0.8)",
    "mix(u, v, u*v)",
    "smoothstep(0, 1, u - v/2)",
    "if(u < v, u*u, v)",
]


@pytest.mark.parametrize("text", TEXTS)
def test_slopes_are_within_the_bounds(text: str) -> None:
    rng = np.random.default_rng(len(text))
    low = rng.uniform(0, 0.9, size=(2, 200))
    high = low + rng.uniform(0.001, 0.1, size=(2, 200))
    expression = parse(text, variables=("u", "v"))
    value, slopes = gradient_enclosure(
        expression, Interval(low[0], high[0]), Interval(low[1], high[1])
    )
    inside = low + rng.uniform(0.1, 0.9, size=(2, 200)) * (high - low)
    with np.errstate(all="ignore"):
        at = expression.value(inside[0], inside[1])
    known = ~np.isnan(value.lo + value.hi)
    assert ((at >= value.lo) & (at <= value.hi))[known].all()
    proven = 0
    for axis, slope in enumerate(slopes):
        step = np.zeros((2, 200))
        step[axis] = 1e-6
        with np.errstate(all="ignore"):
            ahead, behind = (expression.value(*(inside + sign * step)) for sign in (1, -1))
        found = (ahead - behind) / 2e-6
        known = ~np.isnan(slope.lo + slope.hi)
        proven += int(known.sum())
        error = 1e-4 * (1 + np.abs(found))
        assert ((found >= slope.lo - error) & (found <= slope.hi + error))[known].all()
    assert proven > 50


def test_nothing_is_known_across_steps_poles_and_ends() -> None:
    box = Interval(np.array([-0.5]), np.array([0.5]))
    other = Interval(np.array([0.4]), np.array([1.4]))
    for text in ("floor(u)", "1/u", "sqrt(u)", "if(u < 0, 1, 2)", "atan2(u, u - 1)", "log(u + v)"):
        _, slopes = gradient_enclosure(parse(text, variables=("u", "v")), box, other)
        assert np.isnan(slopes[0].lo + slopes[0].hi).all(), text


def test_kinks_have_the_slopes_of_both_sides() -> None:
    box = Interval(np.array([-0.5]), np.array([0.5]))
    _, (slope,) = gradient_enclosure(parse("abs(u)", variables=("u",)), box)
    assert (slope.lo[0], slope.hi[0]) == (-1, 1)
    _, (flat,) = gradient_enclosure(parse("3", variables=("u",)), box)
    assert (flat.lo[0], flat.hi[0]) == (0, 0)

"""Expressions of several variables, of which some get their values first."""

from __future__ import annotations

import numpy as np
import pytest

from voxdisplay.errors import CurveError
from voxdisplay.expressions.parse import parse
from voxdisplay.expressions.partial_evaluation import split

TEXTS = [
    "50 + R*cos(t + 2*a)*sqrt(a + R) - (a*R)**2/t",
    "a",
    "t",
    "3",
    "a*R + 1",
    "if(a < t, a, t**a)",
    "if(a < 1, a*t, a*a)",
    "min(t, a, 2*a, 3)",
    "-a*-t",
    "mix(a, 2*a, t) + clamp(t, -a, a)",
]


@pytest.mark.parametrize("text", TEXTS)
def test_what_is_bound_is_what_is_parsed_with_params(text: str) -> None:
    expression = parse(text, {"R": 3.0}, variables=("t", "a"))
    partial = split(expression, ("t",))
    assert all("t" not in part.program and part.variables == ("a",) for part in partial.parts)
    for a in (0.25, 1.75):
        values = [float(part.value(np.array(a))) for part in partial.parts]
        assert partial.bind(values).program == parse(text, {"R": 3.0, "a": a}).program


def test_parts_are_evaluated_for_many_values_at_once() -> None:
    partial = split(parse("t + a*a + sin(a)", variables=("t", "a")), ("t",))
    (first, second) = partial.parts
    a = np.array([0.0, 1.0, 2.0])
    np.testing.assert_array_equal(first.value(a), a * a)
    np.testing.assert_array_equal(second.value(a), np.sin(a))


def test_numbers_are_no_parts() -> None:
    assert split(parse("2*t + 1"), ("t",)).parts == ()


def test_what_is_not_finite_without_late_variables_is_refused() -> None:
    partial = split(parse("1/a", variables=("t", "a")), ("t",))
    with pytest.raises(CurveError, match="not finite"):
        partial.bind([np.inf])
    split(parse("t/a", variables=("t", "a")), ("t",)).bind([0.0])  # as t/0 is parsed


def test_a_variable_without_a_value_says_where_it_has_one() -> None:
    with pytest.raises(CurveError, match="'time' at column 3") as caught:
        parse("2*time")
    assert "duration" in str(caught.value.hint)
    assert parse("2*time", {"time": 3.0}).constant == 6.0

"""Parametric curves: expressions, callables, ranges and their errors."""

from __future__ import annotations

import math

import numpy as np
import pytest
from curve_values import at, slope_at

from voxdisplay.curves import (
    Parametric,
)
from voxdisplay.errors import CurveError

QUARTER = math.pi / 2


class TestParametric:
    def test_expressions_and_params(self) -> None:
        curve = Parametric("o + t", "o*t", 7, t=("-90*deg", "b"), params={"o": 2, "b": "2*o"})
        assert curve.t_range == (-QUARTER, 4)
        assert at(curve, 0, 1) == [[2, 0, 7], [3, 2, 7]]
        assert slope_at(curve, 0) == [[1, 2, 0]]

    def test_given_derivatives_are_used(self) -> None:
        curve = Parametric("t", "t", "t", t=(0, 1), dx="2*t", dz=5)
        assert slope_at(curve, 3) == [[6, 1, 5]]

    @pytest.mark.parametrize(
        "function",
        [
            lambda t: np.stack((np.cos(t), t, 0 * t + 1)),
            lambda t: (np.cos(t), t, 1),
            lambda t: [np.cos(t), t, np.ones_like(t)],
            lambda t: (math.cos(t), t, 1),
            lambda t: np.array([math.cos(t), t, 1]),
            lambda t: (math.cos(t), t, 1) if t > -1 else None,
        ],
    )
    def test_any_callable(self, function: object) -> None:
        curve = Parametric(function, t=(0, 1), derivative=function)  # type: ignore[call-overload]
        t = np.linspace(0, 1, 3)
        expected = np.stack((np.cos(t), t, np.ones(3)))
        np.testing.assert_array_equal(curve.position(t), expected)
        np.testing.assert_array_equal(curve.derivative(t), expected)
        assert curve.position(t[:0]).shape == (3, 0)

    def test_a_callable_without_derivative_has_none(self) -> None:
        assert Parametric(lambda t: (t, t, t), t=(0, 1)).derivative(np.zeros(1)) is None

    @pytest.mark.parametrize(
        ("function", "message"),
        [
            (lambda t: np.stack((t, t, t), axis=1), r"shape \(2, 3\), not \(3, 2\)"),
            (lambda t: np.stack((t, t)), r"shape \(2, 2\), not \(3, 2\)"),
            (lambda t: t.sum(), r"shape \(\), not \(3, 2\)"),
            (lambda t: (math.cos(t), t), r"shape \(2,\), not \(3,\)"),
            (lambda: 1, "cannot be called: TypeError"),
            (lambda t: ("a", t, t), "returned no numbers: str 'a'"),
        ],
    )
    def test_a_callable_of_another_shape_is_refused(self, function: object, message: str) -> None:
        with pytest.raises(CurveError, match=message):
            Parametric(function, t=(0, 1))  # type: ignore[call-overload]

    def test_a_shape_that_changes_later_is_refused(self) -> None:
        curve = Parametric(lambda t: np.ones((3, t.size))[:, :2], t=(0, 1))
        with pytest.raises(CurveError, match=r"shape \(3, 2\), not \(3, 5\)"):
            curve.position(np.linspace(0, 1, 5))

    def test_where_a_callable_has_no_value_it_is_not_finite(self) -> None:
        scalar = Parametric(lambda t: (math.log(t), 1 / t, 1), t=(0, 1))
        vector = Parametric(lambda t: (np.log(t), 1 / t, 1), t=(0, 1))
        for curve in (scalar, vector):
            assert not np.isfinite(curve.position(np.array([0.0]))).all()
            assert np.isfinite(curve.position(np.array([1.0]))).all()

    @pytest.mark.parametrize(
        ("t", "message"),
        [
            ((1, 0), "t runs backwards: 1 to 0"),
            ((1, 1), "t is empty"),
            ((0, math.inf), "not finite"),
            ((math.nan, 1), "not finite"),
            (("1/0", 1), "not finite"),
            ((0, "t"), "has no value here"),
            ((0, 1, 2), "t must be two numbers"),
            ((0,), "t must be two numbers"),
            ("01", "t must be two numbers"),
            ((-1.5e308, 1.5e308), "too large"),
        ],
    )
    def test_wrong_ranges(self, t: object, message: str) -> None:
        with pytest.raises(CurveError, match=message):
            Parametric("t", "t", "t", t=t)  # type: ignore[call-overload]

    def test_the_axis_of_a_wrong_expression_is_named(self) -> None:
        with pytest.raises(CurveError, match="unknown function 'sine'") as caught:
            Parametric("t", "sine(t)", "t", t=(0, 1))
        assert caught.value.axis == "y"
        assert caught.value.hint == "write 'sin'"
        with pytest.raises(CurveError, match=r"dz: .* not finite") as caught:
            Parametric("t", "t", "t", t=(0, 1), dz="9**9**9")
        assert caught.value.axis == "z"

    def test_arguments_that_do_not_go_together(self) -> None:
        with pytest.raises(TypeError, match="x, y and z"):
            Parametric("t", "t", t=(0, 1))  # type: ignore[call-overload]
        with pytest.raises(TypeError, match="dx, dy, dz"):
            Parametric("t", "t", "t", t=(0, 1), derivative=abs)  # type: ignore[call-overload]
        with pytest.raises(TypeError, match="all three"):
            Parametric(abs, "t", "t", t=(0, 1))  # type: ignore[call-overload]

"""Impure callables: work in place, or other values for the same t."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.curves import Curve
from voxdisplay.errors import CurveError
from voxdisplay.voxelization import measure


def circle(t: np.ndarray) -> np.ndarray:
    return np.stack((20 + 10 * np.cos(t), 20 + 10 * np.sin(t), 20 + 0 * t))


def in_place(t: np.ndarray, change: str) -> np.ndarray:
    if change == "shift":
        t -= 1.0
    elif change == "wrap":
        t %= 2 * np.pi
    elif change == "scale":
        np.multiply(t, 2, out=t)
    elif change == "sort":
        t.sort()
        t.fill(3.0)
    return circle(t)


@pytest.mark.parametrize("change", ["shift", "wrap", "scale", "sort"])
def test_a_callable_that_works_in_place_changes_nothing_but_its_own(change: str) -> None:
    t_range = (0, 6 * np.pi)
    own = vd.Parametric(
        lambda t: in_place(t, change), t=t_range, derivative=lambda t: in_place(t, change)
    )
    clean = vd.Parametric(
        lambda t: in_place(t.copy(), change),
        t=t_range,
        derivative=lambda t: in_place(t.copy(), change),
    )
    t = np.linspace(0, 9, 7)
    own.position(t)
    own.derivative(t)
    assert np.array_equal(t, np.linspace(0, 9, 7))
    one, other = vd.voxelize(own), vd.voxelize(clean)
    assert np.array_equal(one.voxels, other.voxels)
    assert np.array_equal(one.t, other.t)
    assert one.report.e_max == other.report.e_max
    for tangent in ("analytic", "difference"):
        one, other = (vd.voxelize(each, method="march", tangent=tangent) for each in (own, clean))
        assert np.array_equal(one.voxels, other.voxels)


def test_a_curve_of_ones_own_that_works_in_place() -> None:
    class Own(Curve):
        t_range = (0.0, 6 * np.pi)

        def position(self, t: np.ndarray) -> np.ndarray:
            t %= 2 * np.pi
            return circle(t)

    sequence = vd.voxelize(Own())
    clean = vd.Parametric(lambda t: circle(t % (2 * np.pi)), t=Own.t_range)
    assert np.array_equal(sequence.voxels, vd.voxelize(clean).voxels)
    assert sequence.report.e_max < 0.8661


@pytest.mark.parametrize("amplitude", [0.01, 1e-4, 5.0])
def test_noise_is_named(amplitude: float) -> None:
    random = np.random.default_rng(3)

    def noisy(t: np.ndarray) -> np.ndarray:
        return circle(t) + amplitude * random.normal(size=(3, t.size))

    curve = vd.Parametric(noisy, t=(0, 6))
    with pytest.raises(CurveError, match=r"other values for the same t: at t = .*, x = ") as caught:
        vd.voxelize(curve)
    assert caught.value.axis == "x"
    assert "t alone" in str(caught.value.hint)
    with pytest.raises(CurveError, match="other values for the same t"):
        measure.distances(np.zeros((1, 3), dtype=int), curve)
    with pytest.raises(CurveError, match=r"^curve 1: .*other values for the same t"):
        vd.voxelize_many([vd.Circle((3, 3, 3), 2), curve])


def test_a_counter_of_calls_is_named() -> None:
    calls = itertools.count()
    curve = vd.Parametric(lambda t: (t, t, 3.0 + next(calls)), t=(0, 6))
    with pytest.raises(CurveError, match=r"other values for the same t: .* z = "):
        vd.voxelize(curve)


@pytest.mark.parametrize(
    "height",
    [
        lambda t: 9 * t / t.max(),
        lambda t: t - t[0],
        lambda t: t - t.mean(),
        lambda t: np.linspace(0, 9, t.size),
        lambda t: np.cumsum(np.cos(t)),
        lambda t: 1e-3 * np.cumsum(t),
        np.sort,
        lambda t: np.gradient(np.sin(t)),
        np.maximum.accumulate,
    ],
    ids=["largest", "first", "mean", "number", "sum", "small sum", "order", "beside", "so far"],
)
@pytest.mark.parametrize("t_range", [(0, 6), (-3, 3), (0.5, 700)])
def test_a_callable_that_depends_on_the_other_parameters_is_named(height, t_range) -> None:
    curve = vd.Parametric(lambda t: (20 + 9 * np.cos(t), 20 + t, height(t)), t=t_range)
    with pytest.raises(CurveError, match=r"other values for the same t: .* z = ") as caught:
        vd.voxelize(curve)
    assert "by itself" in str(caught.value.hint)


@pytest.mark.parametrize("amplitude", [0.02, 0.3, 3.0])
def test_measuring_does_no_more_work_than_is_drawn(amplitude: float) -> None:
    asked = []

    def rough(t: np.ndarray) -> np.ndarray:
        asked.append(t.size)
        return circle(t) + amplitude * np.sin(1e12 * t)

    voxels = vd.voxelize(vd.Circle((20, 20, 20), 10)).voxels
    curve = vd.Parametric(rough, t=(0, 2 * np.pi))
    if amplitude > 1:
        with pytest.raises(ValueError, match="too rough to measure"):
            measure.distances(voxels, curve)
    else:
        assert measure.distances(voxels, curve).max() < 0.8661 + 2 * amplitude
    assert sum(asked) < 20_000 * len(voxels)


def test_a_callable_that_raises_where_it_has_no_value_is_completed() -> None:
    def divides(t: np.ndarray) -> np.ndarray:
        if np.any(t == 0):
            raise ZeroDivisionError("t is 0")
        return np.stack((20 + 5 * t, 20 + 10 * np.sin(t) / t, 20 + 0 * t))

    sequence = vd.voxelize(vd.Parametric(divides, t=(-5, 5)))
    assert {point.t for point in sequence.undefined} == {0.0}
    assert sequence.report.e_max < 0.8661


def test_complex_numbers_are_refused() -> None:
    with pytest.raises(CurveError, match="returned complex numbers") as caught:
        vd.Parametric(lambda t: np.stack((t, np.sqrt(t - 2 + 0j), t)), t=(0, 5))
    assert ".real" in str(caught.value.hint)
    with pytest.raises(CurveError, match="returned complex numbers"):
        vd.Parametric(lambda t: (float(t), 1j * float(t), 0.0), t=(0, 5))


def test_rounding_is_no_noise() -> None:
    flip = itertools.cycle((1.0, 1.0 + 1e-12))
    curve = vd.Parametric(lambda t: circle(t) * next(flip), t=(0, 2 * np.pi))
    assert len(vd.voxelize(curve)) == len(vd.voxelize(vd.Parametric(circle, t=(0, 2 * np.pi))))


@pytest.mark.parametrize("kind", ["array", "rows", "number"])
def test_a_masked_value_is_none(kind: str) -> None:
    def curve(t: np.ndarray) -> object:
        if kind == "number":
            return (float("nan") if 2.9 < float(t) < 3 else float(t), 5.0, 6.0)
        x = np.ma.masked_where((t > 2.9) & (t < 3), t)
        return np.ma.stack((x, 0 * t, 0 * t)) if kind == "array" else (x, 5, 6)

    masked = vd.Parametric(curve, t=(0, 6))
    assert np.isnan(masked.position(np.array([1.0, 2.95, 3.0]))[0]).tolist() == [False, True, False]
    with pytest.raises(CurveError, match=r"x = nan at t = 2\.9\d* is not finite"):
        vd.voxelize(masked)


class OfAUser(Curve):
    t_range = (0.0, 6.0)

    def __init__(self, change) -> None:
        self.change = change

    def position(self, t: np.ndarray) -> np.ndarray:
        return self.change(np.stack((20 + t, 20 + np.sin(t), t)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (np.transpose, r"returned shape \(\d+, 3\), not \(3, \d+\)"),
        (lambda _: None, r"returned shape \(\), not \(3, \d+\)"),
        (lambda points: points[:, :1], r"returned shape \(3, 1\), not \(3, \d+\)"),
        (lambda points: points[:2], r"returned shape \(2, \d+\), not \(3, \d+\)"),
        (lambda points: points + 1j, "returned complex numbers"),
        (lambda points: np.ma.masked_where(points > 25, points), "is not finite"),
    ],
    ids=["columns", "None", "one point", "two rows", "complex", "masked"],
)
def test_what_a_users_curve_returns_is_checked(change, message) -> None:
    for call in (
        lambda: vd.voxelize(OfAUser(change)),
        lambda: vd.voxelize_many([OfAUser(change), OfAUser(change)]),
        lambda: vd.voxelize(OfAUser(change), method="march"),
    ):
        with pytest.raises(CurveError, match=message) as caught:
            call()
        if "returned" in message:
            assert "OfAUser.position" in str(caught.value)


def test_measuring_a_users_curve_that_works_in_place() -> None:
    class Shifted(Curve):
        t_range = (0.0, 6.0)

        def position(self, t: np.ndarray) -> np.ndarray:
            t -= 1.0
            return np.stack((20 + t, 20 + np.sin(t), t))

    sequence = vd.voxelize(Shifted())
    assert sequence.report.e_max < 0.8661

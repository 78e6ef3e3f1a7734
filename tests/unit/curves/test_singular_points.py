"""Isolated singular parameters: removable ones, jumps, poles."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.curves import Curve, Transformed
from voxdisplay.curves.singular_points import complete, singular_points
from voxdisplay.errors import CurveError
from voxdisplay.voxelization import measure

Callables = Callable[[Any], Any]


def expression(y: str, t: tuple[float, float]) -> vd.Parametric:
    return vd.Parametric("10*t", y, "5", t=t)


def callable_of(y: Callables, t: tuple[float, float]) -> vd.Parametric:
    return vd.Parametric(lambda s: np.stack((10 * s, y(s), 5 + 0 * s)), t=t)


def one_by_one(y: Callables, t: tuple[float, float]) -> vd.Parametric:
    return vd.Parametric(lambda s: (10 * s, y(float(s)), 5.0), t=t)


# Formula, the same function without a gap, range, parameters without a value.
REMOVABLE = {
    "sinc": ("20*sin(t)/t", lambda t: 20 * np.sinc(t / np.pi), (-3, 3), [0.0]),
    "sinc from its peak": ("20*sin(t)/t", lambda t: 20 * np.sinc(t / np.pi), (0, 3), [0.0]),
    "sinc to its peak": ("20*sin(t)/t", lambda t: 20 * np.sinc(t / np.pi), (-3, 0), [0.0]),
    "factor": ("5*(t**2-1)/(t-1)", lambda t: 5 * (t + 1), (0, 3), [1.0]),
    "factor at the end": ("5*(t**2-1)/(t-1)", lambda t: 5 * (t + 1), (-1, 1), [1.0]),
    "two factors": (
        "(t**3-t)/(t**2-1)*5",
        lambda t: 5 * t,
        (-3, 3),
        [-1.0, 1.0],
    ),
    "decimal": ("8*(t**2-0.09)/(t-0.3)", lambda t: 8 * (t + 0.3), (-1, 2), [0.3]),
    "t log t": (
        "30*t*log(abs(t))",
        lambda t: 30 * t * np.log(np.maximum(np.abs(t), 1e-300)),
        (-1, 1),
        [0.0],
    ),
    "cancellation": (
        "60*(1-cos(t))/t**2",
        lambda t: 30 * np.sinc(t / 2 / np.pi) ** 2,
        (-2, 2),
        [0.0],
    ),
    "irrational": (
        "9*(t**2-2)/(t-sqrt(2))",
        lambda t: 9 * (t + np.sqrt(2)),
        (0, 3),
        [math.sqrt(2)],
    ),
}


@pytest.mark.parametrize("certified", [False, True])
@pytest.mark.parametrize("name", REMOVABLE)
def test_both_sides_meet(name: str, certified: bool) -> None:
    text, closed_form, t_range, at = REMOVABLE[name]
    sequence = vd.voxelize(expression(text, t_range), certified=certified)
    assert [(point.axis, point.t, point.jump) for point in sequence.report.undefined] == [
        ("y", t, False) for t in at
    ]
    whole = vd.voxelize(callable_of(closed_form, t_range))
    assert np.array_equal(sequence.voxels, whole.voxels)
    assert sequence.report.pieces == 1
    assert sequence.report.gaps == 0
    assert sequence.report.e_max < 0.8661
    assert measure.distances(sequence.voxels, whole.curve).max() < 0.8661
    assert not sequence.report.certified
    if certified:
        assert "which proves nothing" in str(sequence.proof)


@pytest.mark.parametrize("make", [callable_of, one_by_one])
@pytest.mark.parametrize("t_range", [(-3, 3), (0, 3), (-3, 0), (-20, 20), (-0.1, 7)])
def test_callables_as_well(
    make: Callable[..., vd.Parametric], t_range: tuple[float, float]
) -> None:
    sequence = vd.voxelize(make(lambda t: 20 * np.sin(t) / t, t_range))
    assert {point.t for point in sequence.undefined} == {0.0}
    whole = vd.voxelize(callable_of(lambda t: 20 * np.sinc(t / np.pi), t_range))
    assert np.array_equal(sequence.voxels, whole.voxels)
    assert sequence.report.e_max < 0.8661


def test_a_singular_parameter_that_only_sampling_meets_is_completed() -> None:
    hit = 0.123456789

    class Own(Curve):
        t_range = (0.0, 1.0)
        breaks = np.array([hit])

        def position(self, t: np.ndarray) -> np.ndarray:
            y = np.where(t == hit, np.nan, 30 * t)
            return np.stack((30 * t, y, 0 * t))

    sequence = vd.voxelize(Own())
    assert [(point.axis, point.t) for point in sequence.undefined] == [("y", hit)]
    assert np.array_equal(sequence.voxels, vd.voxelize(vd.Segment((0, 0, 0), (30, 30, 0))).voxels)


@pytest.mark.parametrize("axis", "xyz")
def test_every_axis(axis: str) -> None:
    texts = {"x": "10*t", "y": "10*t", "z": "10*t", axis: "10*t*t/t"}
    sequence = vd.voxelize(vd.Parametric(**texts, t=(-1, 2)))
    assert [point.axis for point in sequence.undefined] == [axis]
    line = vd.voxelize(vd.Parametric("10*t", "10*t", "10*t", t=(-1, 2)))
    assert np.array_equal(sequence.voxels, line.voxels)


@pytest.mark.parametrize("certified", [False, True])
@pytest.mark.parametrize(
    "make",
    [
        lambda: expression("10*t/abs(t) + 0.5", (-1, 1)),
        lambda: callable_of(lambda t: 10 * t / abs(t) + 0.5, (-1, 1)),
    ],
)
def test_sides_that_do_not_meet_are_a_jump(make: Callable[[], Curve], certified: bool) -> None:
    sequence = vd.voxelize(make(), certified=certified)
    report = sequence.report
    assert [(point.axis, point.t, point.jump) for point in report.undefined] == [("y", 0.0, True)]
    assert report.pieces == 2
    assert report.jumps == (pytest.approx(0, abs=1e-12),)
    assert set(sequence.voxels[: sequence.starts[1], 1]) == {-10}
    assert set(sequence.voxels[sequence.starts[1] :, 1]) == {10}
    assert report.e_max < 0.8661
    assert not report.certified


POLES = {
    "1/t": 0.0,
    "0.001/(t-0.3)": 0.3,
    "1e-7/t": 0.0,
    "1/t**2": 0.0,
    "log(t**2)": 0.0,
    "tan(t*pi)": 0.5,
    "csc(t*pi)": 0.0,
    "sin(1/t)": 0.0,
    "5/(t*t-2*0.3*t+0.09)": 0.3,
}


@pytest.mark.parametrize("certified", [False, True])
@pytest.mark.parametrize("text", POLES)
def test_a_pole_is_an_error_that_names_axis_and_t(text: str, certified: bool) -> None:
    with pytest.raises(CurveError, match=r"^y = .* at t = ") as caught:
        vd.voxelize(expression(text, (-0.25, 0.75)), certified=certified)
    assert caught.value.axis == "y"
    assert caught.value.hint
    t = float(str(caught.value).split("t = ")[1].split()[0].rstrip(","))
    assert t == pytest.approx(POLES[text], abs=1e-9)


def test_the_curve_of_several_that_has_a_pole_is_named() -> None:
    curves = [expression("t", (0, 1)), expression("1/(t-0.5)", (0, 1))]
    with pytest.raises(CurveError, match=r"^curve 1: y = inf at t = 0\.5 is not finite"):
        vd.voxelize_many(curves)


def test_a_stretch_without_values_is_an_error() -> None:
    with pytest.raises(CurveError, match=r"y = nan at t = -1\.0 is not finite, nor is y beside it"):
        vd.voxelize(expression("sqrt(t)", (-1, 1)))


def test_measuring_and_marching_complete_the_curve_themselves() -> None:
    curve = expression("20*sin(t)/t", (-3, 3))
    voxels = vd.voxelize(curve).voxels
    assert measure.distances(voxels, curve).max() < 0.8661
    assert measure.coverage(voxels, curve) < 2
    assert [p.t for p in vd.voxelize(curve, method="march").undefined] == [0.0]


@pytest.mark.parametrize(
    "curve",
    [
        vd.Parametric("t", "t/(2+cos(t))", "sqrt(1-t*t)", t=(-1, 1)),
        vd.Parametric("t", "if(t == 0, 1, sin(t)/t)", "t", t=(-1, 1)),
        vd.Parametric(lambda t: np.stack((t, t, t)), t=(-1, 1)),
        vd.Circle((5, 5, 5), 3),
    ],
)
def test_a_curve_that_has_all_its_points_stays_the_same_object(curve: Curve) -> None:
    assert complete(curve) is curve
    assert vd.voxelize(curve).curve is curve
    assert vd.voxelize(curve).undefined == ()


def test_very_many_singular_parameters_are_refused() -> None:
    text = "10.5 + 5*mod(t, 1)/mod(t, 1)"
    assert len(vd.voxelize(expression(text, (0, 99))).undefined) == 100
    with pytest.raises(
        CurveError, match="no value at more than 256 parameters, the first"
    ) as caught:
        vd.voxelize(vd.Parametric(*[text] * 3, t=(0, 400)))
    assert caught.value.hint


def test_a_drawing_reports_what_its_curve_lacks() -> None:
    frame = vd.Frame((64, 64, 64))
    drawing = frame.draw(expression("20 + 9*sin(t)/t", (0, 3)))
    assert [(point.axis, point.t) for point in drawing.undefined] == [("y", 0.0)]
    assert drawing.jumps == ()
    split = frame.draw(expression("20.5 + 9*sign(t - 1)", (0, 3)))
    assert split.undefined == ()
    assert split.jumps == (pytest.approx(1),)
    assert frame.draw(vd.Circle((20, 20, 20), 9)).undefined == ()


def test_bounds_know_nothing_at_a_singular_parameter() -> None:
    curve = complete(expression("20*sin(t)/t", (-3, 3)))
    ends = np.array([-1.0, 0.0, 0.5]), np.array([0.0, 1.0, 1.0])
    low, high = curve.enclosure(*ends)  # type: ignore[misc]
    assert np.isnan(low[1, :2]).all()
    assert np.isfinite(low[1, 2])
    assert np.isfinite(high[1, 2])
    t = np.array([-1e-14, 0.0, 1e-14, 1.0])
    assert curve.position(t)[1] == pytest.approx([20, 20, 20, 20 * np.sin(1.0)])


def test_a_completed_curve_can_be_transformed_pickled_and_printed() -> None:
    curve = expression("20*sin(t)/t", (-3, 3))
    moved = vd.voxelize(Transformed(curve, 2, (1, 2, 3)))
    assert [(point.axis, point.t) for point in moved.undefined] == [("y", 0.0)]
    done = complete(curve)
    again = pickle.loads(pickle.dumps(done))  # noqa: S301 - its own
    t = np.linspace(-3, 3, 13)
    assert np.array_equal(again.position(t), done.position(t))
    assert singular_points(again) == singular_points(done)
    assert (
        str(singular_points(done)[0])
        == "y has no value at t = 0.0, and is drawn with its limit there"
    )
    assert "t=0.0" in repr(done)

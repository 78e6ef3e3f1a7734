"""Knot vectors and weights of B-splines as CAD programs write them."""

from __future__ import annotations

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.errors import CurveError

POINTS = [[10, 10, 10], [40, 10, 10], [40, 40, 10], [10, 40, 30], [5, 5, 5]]
T = np.linspace(0, 2, 33)


@pytest.mark.parametrize("weights", [None, [1, 2, 0.5, 3, 1]])
@pytest.mark.parametrize(
    ("degree", "full"),
    [
        (1, [0, 0, 0.5, 1, 1.5, 2, 2]),
        (2, [0, 0, 0, 0.5, 1, 2, 2, 2]),
        (3, [0, 0, 0, 0, 1, 2, 2, 2, 2]),
        (4, [0, 0, 0, 0, 0, 2, 2, 2, 2, 2]),
        (3, [-3, -2, -1, 0, 1, 2, 3, 4, 5]),  # not clamped
    ],
)
def test_the_first_and_the_last_knot_may_be_left_out(
    degree: int, full: list[float], weights: list[float] | None
) -> None:
    whole = vd.BSpline(POINTS, degree, full, weights)
    short = vd.BSpline(POINTS, degree, full[1:-1], weights)
    assert short.t_range == whole.t_range
    assert np.array_equal(short.position(T), whole.position(T))
    np.testing.assert_allclose(short.derivative(T[1:-1]), whole.derivative(T[1:-1]))
    assert np.array_equal(
        vd.voxelize(short, certified=True).voxels, vd.voxelize(whole, certified=True).voxels
    )


def test_knots_that_descend_by_rounding() -> None:
    rounded = vd.BSpline(POINTS, 2, [0, 0, 0, 1 / 3, 1, 2, 2.0000001, 1.9999999])
    exact = vd.BSpline(POINTS, 2, [0, 0, 0, 1 / 3, 1, 2, 2, 2])
    np.testing.assert_allclose(rounded.position(T), exact.position(T), atol=1e-4)
    for certified in (False, True):
        drawn = [vd.voxelize(each, certified=certified).voxels for each in (rounded, exact)]
        assert np.array_equal(*drawn)


def test_descending_knots_are_negated() -> None:
    knots = [2, 2, 2, 1.5, 1, 0, 0, 0]
    with pytest.raises(CurveError, match="must not descend, as from 1 to 0") as refused:
        vd.BSpline(POINTS, 2, knots)
    assert refused.value.hint == "for the same curve, negate all of them"
    curve = vd.BSpline(POINTS, 2, np.negative(knots))
    assert curve.position(np.array(curve.t_range)).T.tolist() == [POINTS[0], POINTS[-1]]
    with pytest.raises(CurveError, match="must not descend, as from 2 to 1") as refused:
        vd.BSpline(POINTS, 2, [0, 0, 0, 2, 1, 3, 3, 3])
    assert refused.value.hint is None


LEFT = [[0, 0, 0], [10, 9, 0], [20, 5, 0], [30, 0, 0]]
RIGHT = [[30, 0, 0], [40, 0, 9], [50, 0, 0], [60, 3, 3]]
FULL = [0] * 4 + [1] * 4 + [2] * 4


def test_full_inner_multiplicity_joins_where_the_points_do() -> None:
    curve = vd.BSpline(LEFT + RIGHT, 3, FULL)
    halves = vd.Bezier(LEFT), vd.Bezier(RIGHT)
    t = np.linspace(0, 1, 17)[:-1]
    np.testing.assert_allclose(curve.position(t), halves[0].position(t), atol=1e-12)
    np.testing.assert_allclose(curve.position(1 + t), halves[1].position(t), atol=1e-12)
    sequence = vd.voxelize(curve, certified=True)
    assert sequence.report.pieces == 1
    assert sequence.report.certified


@pytest.mark.parametrize("certified", [False, True])
def test_full_inner_multiplicity_jumps_where_the_points_do_not_join(certified: bool) -> None:
    points = np.array(LEFT + RIGHT) + 0.5
    points[4:] += (0, 10, 0)
    sequence = vd.voxelize(vd.BSpline(points, 3, FULL), certified=certified)
    report = sequence.report
    assert report.pieces == 2
    assert report.jumps == (pytest.approx(1),)
    assert report.e_max < 0.8661
    # The last parameter before the knot is still a little to the left of it.
    assert sequence.voxels[sequence.starts[1] - 1].tolist() in ([29, 0, 0], [30, 0, 0])
    assert sequence.voxels[sequence.starts[1]].tolist() == [30, 10, 0]


def test_a_point_of_weight_0_has_no_influence() -> None:
    moved = [list(point) for point in POINTS]
    moved[2] = [999, -999, 999]
    weights = [1, 2, 0, 3, 1]
    one, other = (vd.BSpline(points, 3, weights=weights) for points in (POINTS, moved))
    np.testing.assert_allclose(one.position(T), other.position(T))
    assert vd.voxelize(one, certified=True).report.certified


@pytest.mark.parametrize(
    ("weights", "at", "end"),
    [([0, 1, 1, 1, 1], 0.0, POINTS[1]), ([1, 1, 1, 1, 0], 2.0, POINTS[3])],
)
def test_an_end_of_weight_0_is_drawn_with_its_limit(
    weights: list[float], at: float, end: list[float]
) -> None:
    sequence = vd.voxelize(vd.BSpline(POINTS, 3, weights=weights))
    assert {point.t for point in sequence.report.undefined} == {at}
    assert sequence.voxels[0 if at == 0 else -1].tolist() == pytest.approx(end, abs=1)
    assert sequence.report.e_max < 0.8661


@pytest.mark.parametrize(
    ("arguments", "message", "hint"),
    [
        ({"knots": [0, 0, 0, 1, 2, 2]}, "knots are 6, not 9: 5 points", "7 are taken"),
        ({"knots": [0, 1, 2]}, "knots are 3, not 9", "as often as it counts"),
        ({"knots": [2] * 9}, "knots leave no range for t", "from knot 3 to knot 5"),
        (
            {"weights": [0, 0, 0, 0, 1]},
            r"are 0 for all points from 0 to 3.* t = 0 to 1",
            "positive",
        ),
        ({"weights": [1, 1, -1, 1, 1]}, "must not be negative, as -1", "0 takes the point out"),
    ],
)
def test_where_there_is_no_curve_the_hint_says_how(
    arguments: dict[str, list[float]], message: str, hint: str
) -> None:
    with pytest.raises(CurveError, match=message) as caught:
        vd.BSpline(POINTS, 3, **arguments)
    assert hint in str(caught.value.hint)


def test_more_than_full_multiplicity_names_what_is_superfluous() -> None:
    with pytest.raises(CurveError, match=r"have 1 5 times, and 4 is the most") as caught:
        vd.BSpline([*LEFT, [1, 1, 1], *RIGHT], 3, [0] * 4 + [1] * 5 + [2] * 4)
    assert "leave out 1 of them and as many points" in str(caught.value.hint)

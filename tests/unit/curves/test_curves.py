"""Positions, derivatives and argument errors of every curve type."""

from __future__ import annotations

import math

import numpy as np
import pytest
from curve_values import at, slope_at

from voxdisplay import curves
from voxdisplay.curves import (
    Arc,
    Bezier,
    BSpline,
    CatmullRom,
    Circle,
    Curve,
    Ellipse,
    Helix,
    Lissajous,
    Parametric,
    Points,
    Polyline,
    Segment,
    TorusKnot,
    Transformed,
)
from voxdisplay.errors import CurveError

C = (3.0, 5.0, 7.0)
ZIGZAG = [[1, 2, 3], [4, 2, 1], [4, 6, 1], [0, 6, 5], [2, 9, 4]]
QUARTER = math.pi / 2
HALF = math.sqrt(0.5)

EVERY: dict[str, Curve] = {
    "expressions": Parametric("3*cos(t)", "exp(-t)", "t**2", t=(-1, 2)),
    "segment": Segment((1, 2, 3), (4, 4, 4)),
    "polyline": Polyline(ZIGZAG),
    "closed polyline": Polyline(ZIGZAG, closed=True),
    "points": Points(ZIGZAG),
    "arc": Arc(C, 2, 0.5, 2.5, (1, 1, 0)),
    "clockwise arc": Arc(C, 2, 2.5, 0.5),
    "circle": Circle(C, 2, (1, 2, 3)),
    "ellipse": Ellipse(C, ((2, 1, 0), (0, 1, 1))),
    "helix": Helix(C, 2, 1.5, 2.5, (0, 1, 1), start=0.5),
    "lissajous": Lissajous(C, (1, 2, 3), (3, 4, 5), (0, 0.5, 1)),
    "torus knot": TorusKnot(2, -3, C, 4, 1, (1, 0, 1)),
    "bezier": Bezier(ZIGZAG),
    "b-spline": BSpline(ZIGZAG),
    "line as b-spline": BSpline(ZIGZAG, 1),
    "knotted b-spline": BSpline(ZIGZAG, 2, [0, 0, 0, 1, 1, 3, 3, 3]),
    "unclamped b-spline": BSpline(ZIGZAG, 2, [0, 1, 2, 4, 5, 6, 8, 9]),
    "periodic b-spline": BSpline(ZIGZAG, 3, closed=True),
    "nurbs": BSpline(ZIGZAG, 3, weights=[1, 2, 0.5, 3, 1]),
    "catmull-rom": CatmullRom(ZIGZAG),
    "closed catmull-rom": CatmullRom(ZIGZAG, closed=True),
    "transformed": Transformed(Circle(C, 2), 0.5, (1, 2, 3)),
    "turned": Transformed(Circle(C, 2), [[0, -1, 0], [0.6, 0.3, 0], [0, 0.5, -2]], (1, 2, 3)),
}


def everything(test: object) -> object:
    return pytest.mark.parametrize("curve", EVERY.values(), ids=EVERY.keys())(test)  # type: ignore[arg-type]


@everything
def test_shapes_are_3_by_n(curve: Curve) -> None:
    a, b = curve.t_range
    assert a < b
    for n in (0, 1, 5):
        t = np.linspace(a, b, n)
        for values in (curve.position(t), curve.derivative(t)):
            assert values is not None
            assert values.shape == (3, n)
            assert values.dtype == np.float64
            assert np.isfinite(values).all()


@everything
def test_derivatives_are_exact(curve: Curve) -> None:
    a, b = curve.t_range
    h = 1e-6 * (b - a)
    t = np.linspace(a, b, 200)[1:-1]
    if curve.breaks.size:
        t = t[np.abs(t[:, None] - curve.breaks).min(axis=1) > h]
    difference = (curve.position(t + h) - curve.position(t - h)) / (2 * h)
    np.testing.assert_allclose(curve.derivative(t), difference, rtol=1e-6, atol=1e-6)


@everything
def test_direction_jumps_at_breaks_only(curve: Curve) -> None:
    a, b = curve.t_range
    assert ((curve.breaks > a) & (curve.breaks < b)).all()
    assert (np.diff(curve.breaks) > 0).all()
    t = np.linspace(a, b, 20_000)
    direction = curve.derivative(t)
    assert direction is not None
    direction = direction / np.linalg.norm(direction, axis=0)
    turns = (direction[:, 1:] * direction[:, :-1]).sum(axis=0) < 0.9
    has_break = np.histogram(curve.breaks, t)[0] > 0
    assert not (turns & ~has_break).any()


@everything
def test_closed_curves_end_where_they_begin(curve: Curve) -> None:
    if curve.closed:
        first, last = curve.position(np.array(curve.t_range)).T
        np.testing.assert_allclose(first, last, atol=1e-12)


def test_all_curves_are_tested() -> None:
    public = {getattr(curves, name) for name in curves.__all__} - {Curve}
    assert public == {type(curve) for curve in EVERY.values()}


def test_polyline_passes_its_vertices_exactly() -> None:
    assert at(Polyline(ZIGZAG), 0, 1, 2, 3, 4) == ZIGZAG
    assert at(Polyline(ZIGZAG), 0.5) == [[2.5, 2, 2]]
    assert Polyline(ZIGZAG).breaks.tolist() == [1, 2, 3]
    assert at(Polyline(ZIGZAG, closed=True), 4, 4.5, 5) == [ZIGZAG[4], [1.5, 5.5, 3.5], ZIGZAG[0]]
    assert Polyline([*ZIGZAG, ZIGZAG[0]], closed=True).t_range == (0, 5)
    assert slope_at(Polyline(ZIGZAG), 1, 4) == [[0, 4, 0], [2, 3, -1]]


def test_a_single_point_is_a_curve_that_stays_there() -> None:
    assert at(Points([C]), 0, 0.5, 1) == [list(C)] * 3


def test_segment() -> None:
    assert at(Segment((1, 2, 3), (2, 4, 7)), 0, 0.5, 1) == [[1, 2, 3], [1.5, 3, 5], [2, 4, 7]]
    assert Segment((1, 2, 3), (2, 4, 7)).breaks.size == 0


@pytest.mark.parametrize(
    ("normal", "zero", "quarter"),
    [
        ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
        ((0, 0, -5), (1, 0, 0), (0, -1, 0)),
        ((0, 1, 0), (1, 0, 0), (0, 0, -1)),
        ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
        ((1, 1, 0), (HALF, -HALF, 0), (0, 0, -1)),
        ((1e-200, 0, 0), (0, 1, 0), (0, 0, 1)),
        ((1e100, 0, 0), (0, 1, 0), (0, 0, 1)),
    ],
)
def test_angles_begin_nearest_to_x(
    normal: tuple[float, ...], zero: tuple[float, ...], quarter: tuple[float, ...]
) -> None:
    circle = Circle((0, 0, 0), 1, normal)
    np.testing.assert_allclose(at(circle, 0, QUARTER), [zero, quarter], atol=1e-12)


def test_circle_is_a_circle() -> None:
    circle = Circle(C, 2, (1, 2, 3))
    points = circle.position(np.linspace(*circle.t_range, 50)) - np.array(C)[:, None]
    np.testing.assert_allclose(np.linalg.norm(points, axis=0), 2)
    np.testing.assert_allclose(np.array([1, 2, 3]) @ points, 0, atol=1e-12)
    assert circle.closed


def test_arc_runs_from_start_to_end_either_way() -> None:
    for start, end in ((0, QUARTER), (QUARTER, 0), (-1, 3), (3, -1)):
        arc = Arc(C, 2, start, end)
        expected = [[3 + 2 * math.cos(x), 5 + 2 * math.sin(x), 7] for x in (start, end)]
        np.testing.assert_allclose(at(arc, *arc.t_range), expected, atol=1e-12)


def test_ellipse_is_of_its_half_axes() -> None:
    ellipse = Ellipse(C, ((2, 0, 0), (0, 0, 1)))
    assert at(ellipse, 0, QUARTER, math.pi) == [[5, 5, 7], [3, 5, 8], [1, 5, 7]]


def test_helix_advances_by_its_pitch() -> None:
    helix = Helix(C, 2, 1.5, 2, start=QUARTER)
    a, b = helix.t_range
    assert at(helix, a, a + math.tau, b) == [[3, 7, 7], [3, 7, 8.5], [3, 7, 10]]
    assert at(Helix(C, 2, 1, 1, (1, 0, 0)), 0, math.tau) == [[3, 7, 7], [4, 7, 7]]


def test_lissajous() -> None:
    curve = Lissajous((1, 2, 3), (4, 5, 6), (1, 2, 3), (QUARTER, 0, 0))
    assert at(curve, 0, QUARTER) == [[5, 2, 3], [1, 2, -3]]


def test_torus_knot_goes_around_both_ways() -> None:
    assert at(TorusKnot(1, 0, (0, 0, 0), 4, 1), 0, QUARTER) == [[5, 0, 0], [0, 5, 0]]
    assert at(TorusKnot(1, 4, (0, 0, 0), 4, 1), math.pi / 8) == [
        [round(4 * math.cos(math.pi / 8), 12), round(4 * math.sin(math.pi / 8), 12), 1]
    ]


def test_bezier_begins_and_ends_at_its_points() -> None:
    assert at(Bezier([[0, 0, 0], [1, 2, 4], [4, 0, 0]]), 0, 0.5, 1) == [
        [0, 0, 0],
        [1.5, 1, 2],
        [4, 0, 0],
    ]
    assert slope_at(Bezier([[0, 0, 0], [1, 2, 4], [4, 0, 0]]), 0) == [[2, 4, 8]]


def test_a_bspline_with_one_span_is_a_bezier_curve() -> None:
    t = np.linspace(0, 1, 9)
    np.testing.assert_allclose(BSpline(ZIGZAG, 4).position(t), Bezier(ZIGZAG).position(t))


def test_a_bspline_of_degree_1_is_a_polyline() -> None:
    spline = BSpline(ZIGZAG, 1)
    assert at(spline, 0, 1, 2, 3, 4) == ZIGZAG
    assert spline.breaks.tolist() == [1, 2, 3]


def test_the_nurbs_circle_is_a_circle() -> None:
    square = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]]
    nurbs = BSpline(
        [[x, y, 0] for x, y in square],
        2,
        [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4],
        [1, HALF, 1, HALF, 1, HALF, 1, HALF, 1],
    )
    radius = np.linalg.norm(nurbs.position(np.linspace(0, 4, 100)), axis=0)
    np.testing.assert_allclose(radius, 1)


def test_a_periodic_bspline_is_smooth_where_it_closes() -> None:
    spline = BSpline(ZIGZAG, 3, closed=True)
    a, b = spline.t_range
    np.testing.assert_allclose(*slope_at(spline, a, b))


def test_catmull_rom_passes_its_points() -> None:
    spline = CatmullRom(ZIGZAG)
    steps = np.sqrt(np.linalg.norm(np.diff(ZIGZAG, axis=0), axis=1))
    np.testing.assert_allclose(at(spline, *np.cumsum([0, *steps])), ZIGZAG, atol=1e-9)


def test_catmull_rom_through_a_line_stays_on_it() -> None:
    spline = CatmullRom([[0, 0, 0], [1, 1, 1], [3, 3, 3], [3, 3, 3], [4, 4, 4]])
    x, y, z = spline.position(np.linspace(*spline.t_range, 100))
    np.testing.assert_allclose(x, y)
    np.testing.assert_allclose(x, z)
    assert (np.diff(x) > 0).all()
    assert at(CatmullRom([[0, 0, 0], [4, 0, 0]]), 1) == [[2, 0, 0]]


def test_catmull_rom_that_turns_back_breaks_there() -> None:
    assert CatmullRom([[0, 0, 0], [4, 0, 0], [0, 0, 0]]).breaks.tolist() == [2]


def test_catmull_rom_through_points_as_near_as_can_be() -> None:
    spline = CatmullRom([[0, 0, 0], [5e-324, 0, 0], [1, 0, 0]])
    assert np.isfinite(spline.position(np.linspace(*spline.t_range, 5))).all()


def test_transformed_keeps_what_the_curve_knows() -> None:
    polyline = Polyline(ZIGZAG, closed=True)
    moved = Transformed(polyline, 2, (1, 0, -1))
    assert moved.closed
    assert moved.t_range == polyline.t_range
    assert moved.breaks.tolist() == polyline.breaks.tolist()
    assert at(moved, 0, 1) == [[3, 4, 5], [9, 4, 1]]
    assert Transformed(Parametric(lambda t: (t, t, t), t=(0, 1))).derivative(np.zeros(1)) is None


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Circle(C, 0), "radius must be positive, not 0"),
        (lambda: Circle(C, math.nan), "radius is not finite"),
        (lambda: Circle(C, 1e308), "radius is too large: 1e.308"),
        (lambda: Polyline([C, (1, 1e308, 2)]), r"points\[1\]\[1\] is too large"),
        (lambda: Circle(C, 1, (0, 0, 0)), "normal has no direction"),
        (lambda: Circle((1, 2), 1), r"center has shape \(2,\), not \(3,\)"),
        (lambda: Circle((1, 2, math.inf), 1), r"center\[2\] is not finite"),
        (lambda: Circle("abc", 1), "center is not an array"),
        (lambda: Arc(C, 1, 2, 2), "end must differ from start"),
        (lambda: Ellipse(C, ((1, 0, 0),)), r"axes has shape \(1, 3\), not \(2, 3\)"),
        (lambda: Helix(C, 1, 1, 0), "turns must be positive"),
        (lambda: TorusKnot(2, 4, C, 2, 1), "p = 2 and q = 4 make no knot"),
        (lambda: TorusKnot(0, 0, C, 2, 1), "make no knot"),
        (lambda: TorusKnot(1.5, 2, C, 2, 1), "p must be a whole number, not 1.5"),
        (lambda: Polyline([C]), "points has 1 point, at least 2 are needed"),
        (lambda: Points([]), "points has 0 points, at least 1 are needed"),
        (lambda: Polyline([[1, 2], [3, 4]]), r"shape \(2, 2\), not \(n, 3\)"),
        (lambda: Polyline([[1, 2, 3], [4, 5]]), "not an array of numbers"),
        (lambda: Polyline([C, (1, math.nan, 2)]), r"points\[1\]\[1\] is not finite"),
        (lambda: Bezier([C]), "at least 2"),
        (lambda: Bezier(np.zeros((70, 3))), "^points make a curve of degree 69: more than 64"),
        (lambda: BSpline(ZIGZAG, 5), "points has 5 points, at least 6 are needed"),
        (lambda: BSpline(ZIGZAG, 0), "degree must be 1 or more"),
        (lambda: BSpline(ZIGZAG, 1e9), "^degree is 1000000000: more than 64"),
        (lambda: BSpline(ZIGZAG, 2, [0, 1, 2]), "knots are 3, not 8"),
        (lambda: BSpline(ZIGZAG, 2, [0, 0, 0, 2, 1, 3, 3, 3]), "knots must not descend"),
        (lambda: BSpline(ZIGZAG, 2, [0] * 8), "knots leave no range"),
        (
            lambda: BSpline(ZIGZAG, 1, [0, 0, 1, 1, 1, 3, 3]),
            "knots have 1 3 times, and 2 is the most",
        ),
        (lambda: BSpline(ZIGZAG, 2, weights=[1, 2]), r"weights has shape \(2,\), not \(5,\)"),
        (
            lambda: BSpline(ZIGZAG, 2, weights=[1, 1, -2, 1, 1]),
            "weights must not be negative, as -2",
        ),
        (lambda: CatmullRom([C, C]), "points are all the same"),
        (lambda: Transformed(Circle(C, 1), 0), "matrix must be positive"),
    ],
)
def test_what_curves_cannot_be_made_from(make: object, message: str) -> None:
    with pytest.raises(CurveError, match=message):
        make()  # type: ignore[operator]


def test_polynomials_say_their_degree() -> None:
    spline = Bezier(ZIGZAG)
    assert spline.degree == len(ZIGZAG) - 1
    assert Transformed(spline, 2.0).degree == spline.degree
    assert Segment((1, 2, 3), (2, 4, 7)).degree == Polyline(ZIGZAG).degree == 1
    assert Circle((0, 0, 0), 1).degree is None


def test_a_subclass_with_another_position_has_no_degree() -> None:
    class Waves(Bezier):
        def position(self, t: np.ndarray) -> np.ndarray:
            return super().position(t) + np.sin(99 * t)

    class Shifted(Bezier):
        degree = 5

        def position(self, t: np.ndarray) -> np.ndarray:
            return super().position(t) + t**5

    assert Waves(ZIGZAG).degree is None
    assert Shifted(ZIGZAG).degree == 5


def test_another_position_counts_wherever_it_is_inherited_from() -> None:
    class Wave:
        def position(self, t: np.ndarray) -> np.ndarray:
            return super().position(t) + 9 * np.sin(20 * t)

    class Waves(Wave, Bezier):
        pass

    class Same(Waves):
        pass

    class Named(Bezier):
        name = "named"

    for kind in (Waves, Same):
        curve = kind(ZIGZAG)
        assert (curve.degree, curve.thread_safe) == (None, False)
        assert curve.enclosure(np.zeros(1), np.ones(1)) is None
        t = np.linspace(0, 1, 5)
        at_once = kind.batch_evaluator([curve] * 4)(np.arange(5) % 4, t)
        assert np.array_equal(at_once, curve.position(t))
    assert Named(ZIGZAG).degree == len(ZIGZAG) - 1
    assert Named(ZIGZAG).thread_safe

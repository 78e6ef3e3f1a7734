"""Tangent march: the paper's tables II to IV, and the limits of the method."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from space_curves import Function, fourier_curve, paper_curve

import voxdisplay as vd
from voxdisplay.errors import CurveError
from voxdisplay.voxelization import voxelize
from voxdisplay.voxelization.tangent_march import MarchTrace, follow, march

# Variant, radius = amplitude, frequency; number of voxels, greatest and mean error, as printed but
# for two misprints: .843 is .803 in table II's other column, .391 is variant 2's.
TABLES = [
    (1, 40, 2, 355, 0.633, 0.394),
    (1, 80, 2, 712, 0.868, 0.473),
    (1, 40, 4, 660, 0.837, 0.501),
    (1, 80, 4, 1348, 1.845, 0.803),
    (2, 40, 2, 347, 0.601, 0.358),
    (2, 80, 2, 708, 0.664, 0.391),
    (2, 40, 4, 644, 0.669, 0.411),
    (2, 80, 4, 1325, 0.812, 0.494),
    (3, 40, 2, 347, 0.586, 0.350),
    (3, 80, 2, 700, 0.616, None),
    (3, 40, 4, 651, 0.654, 0.395),
    (3, 80, 4, 1321, 0.795, 0.462),
]


class WithDerivative(Function):
    def derivative(self, t: np.ndarray) -> np.ndarray:
        return (self.position(t + 1e-6) - self.position(t - 1e-6)) / 2e-6


def paper_trail(variant: int, radius: int, frequency: int) -> MarchTrace:
    # The paper's voxel centres are at whole numbers, ours at + 1/2: as ``paper_curve`` has it.
    return follow(paper_curve(radius, frequency, 1.25 * radius), variant)


@pytest.mark.parametrize(("variant", "radius", "frequency", "voxels", "e_max", "e_av"), TABLES)
def test_the_tables_of_the_paper(
    variant: int, radius: int, frequency: int, voxels: int, e_max: float, e_av: float | None
) -> None:
    trail = paper_trail(variant, radius, frequency)
    assert len(trail.voxels) == voxels
    assert trail.distances.max() == pytest.approx(e_max, abs=0.0035 if variant == 3 else 0.0015)
    if e_av is not None:
        assert trail.distances.mean() == pytest.approx(e_av, abs=0.0015)


def test_the_step_sizes_are_the_tables_unless_said_otherwise() -> None:
    curve = paper_curve(40, 4, 50)
    said = voxelize(curve, method="march", variant=2, pitch=0.25, reach=2)
    assert np.array_equal(said.voxels, voxelize(curve, method="march", variant=2).voxels)
    # With distances found as finely as can be, the march is as good as the paper's best.
    fine = follow(curve, 1, pitch=0.02, reach=1)
    assert (len(fine.voxels), len(follow(curve, 1).voxels)) == (655, 660)
    assert fine.distances.max() == pytest.approx(0.645, abs=0.002)


def test_the_step_sizes_are_lengths_where_the_parameter_is_no_angle() -> None:
    def arc(slow: float) -> Function:
        return Function(
            lambda t: (40 * np.cos(t / slow), 5 * t / slow, 40 * np.sin(t / slow)), 0, slow
        )

    fine, same = (follow(arc(slow), 1, pitch=0.01, reach=1) for slow in (1, 1000))
    assert np.array_equal(fine.voxels, same.voxels)
    assert np.allclose(fine.distances, same.distances, atol=1e-9)
    coarse = follow(arc(1), 1, pitch=2, reach=2)
    assert fine.distances.max() < 0.7 < coarse.distances.max()


def test_step_sizes_are_the_marchs_alone() -> None:
    with pytest.raises(ValueError, match="method='march'"):
        voxelize(paper_curve(40, 4, 50), pitch=0.5)


def test_how_the_tangent_is_found_makes_no_difference() -> None:
    curve = paper_curve(40, 4, 50)
    exact = WithDerivative(curve.function, *curve.t_range)
    analytic = follow(exact, 1, tangent="analytic")
    difference = follow(exact, 1, tangent="difference")
    assert np.array_equal(analytic.voxels, difference.voxels)
    assert np.array_equal(follow(exact, 1).voxels, analytic.voxels)


def test_true_errors_are_not_those_of_the_paper() -> None:
    sequence = march(paper_curve(80, 4, 100), 1)
    assert sequence.report.e_max == pytest.approx(1.623, abs=0.002)
    assert sequence.report.e_av == pytest.approx(0.585, abs=0.002)
    assert (sequence.distances > 0.866).sum() == 220


@pytest.mark.parametrize("variant", [1, 2, 3])
@pytest.mark.parametrize("seed", range(5))
def test_other_curves(seed: int, variant: int) -> None:
    curve = fourier_curve(seed, "smooth", closed=seed % 2 == 0)
    sequence = voxelize(curve, method="march", variant=variant)
    assert np.array_equal(sequence.voxels[0], np.floor(curve.position(np.zeros(1))[:, 0]))
    assert sequence.report.gaps == 0
    assert np.median(sequence.distances) < 0.6


def test_a_guess_of_ones_own() -> None:
    line = Function(lambda t: (100 * t, 61.8 * t, 38.2 * t))
    trail = follow(line, 2, guess=lambda points, _: points[0] / 100)
    assert np.array_equal(trail.voxels[:, 0], np.arange(len(trail.voxels)))


@pytest.mark.parametrize("variant", [1, 2, 3])
def test_a_curve_within_a_voxel(variant: int) -> None:
    assert march(Function(lambda _: (3.2, 4.4, 5.6)), variant).voxels.tolist() == [[3, 4, 5]]
    assert march(Function(lambda t: (3.2 + t / 2, 4.4, 5.6)), variant).voxels.tolist() == [
        [3, 4, 5]
    ]


ALIKE = [
    (variant, tangent) for variant in (1, 2, 3) for tangent in ("analytic", "difference", None)
]


def along(x: str, y: str, z: str, t: tuple[float, float]) -> Iterator[vd.Parametric]:
    """Yield a curve by formulas, and by a callable."""
    formulas = vd.Parametric(x, y, z, t=t)
    yield formulas
    yield vd.Parametric(formulas.position, t=t, derivative=formulas.derivative)


def distinct_jumps(sequence: vd.Sequence) -> np.ndarray:
    """Return the jumps; what has a value of its own at one, as floor has, is no piece."""
    return np.unique(np.round(sequence.jumps, 9))


@pytest.mark.parametrize(("variant", "tangent"), ALIKE)
@pytest.mark.parametrize(
    ("x", "y", "t", "jumps"),
    [
        ("10*t", "10*t/abs(t) + 0.5", (-1, 1), [0]),
        ("10*t", "20*sign(t)", (-1, 1), [0]),
        ("10*t", "9*floor(t) + 4*t", (-0.5, 2.5), [0, 1, 2]),
        ("10*t", "if(t < 2, 5, 50)", (0, 3), [2]),
        # The parameter is an angle around z, on either side.
        ("20 + 10*cos(t)", "20 + 10*sin(t)", (-3, 3), [0.5]),
    ],
)
def test_nothing_is_drawn_across_a_jump(
    x: str, y: str, t: tuple[float, float], jumps: list[float], variant: int, tangent: str | None
) -> None:
    z = "9 + 8*sign(t - 0.5)" if "cos" in x else "5"
    for curve in along(x, y, z, t):
        sequence = voxelize(curve, method="march", variant=variant, tangent=tangent)
        report = sequence.report
        assert distinct_jumps(sequence) == pytest.approx(jumps, abs=1e-9)
        assert report.pieces == len(voxelize(curve).starts) > len(jumps)
        assert report.gaps == 0
        assert report.e_max < 0.8661
        assert not report.closed


@pytest.mark.parametrize(("variant", "tangent"), ALIKE)
@pytest.mark.parametrize(
    ("formulas", "t", "undefined"),
    [
        (("10*t", "20*sin(t)/t", "5"), (-3, 3), [0.0]),
        (("10*t", "20*sin(t)/t", "5"), (0, 3), [0.0]),
        (("10*t", "8*(t**2-0.09)/(t-0.3)", "5"), (-1, 2), [0.3]),
        (("20 + 10*cos(t)", "20 + 10*sin(t)", "30*sin(t)/t"), (-3, 3), [0.0]),
        (("20 + 10*cos(t)", "20 + 10*sin(t)", "30*sin(t)/t"), (0, 3), [0.0]),
        # Slopes without a bound at the ends of the range, and no values outside of it.
        (("10*t", "20*sqrt(t)", "5"), (0, 2), []),
        (("10*t", "10*asin(t)", "5"), (-1, 1), []),
        (("20 + 10*cos(t)", "20 + 10*sin(t)", "10*sqrt(t)"), (0, 3), []),
        (("20 + 10*cos(t)", "20 + 10*sin(t)", "10*sqrt(2 - t)"), (-2, 2), []),
        (("20 + 10*cos(t)", "20 + 10*sin(t)", "30*t*log(t)"), (0, 2), [0.0]),
    ],
)
def test_a_point_without_a_value_is_drawn_through(
    formulas: tuple[str, str, str],
    t: tuple[float, float],
    undefined: list[float],
    variant: int,
    tangent: str | None,
) -> None:
    for curve in along(*formulas, t):
        sequence = voxelize(curve, method="march", variant=variant, tangent=tangent)
        assert [point.t for point in sequence.undefined] == undefined
        assert sequence.report.pieces == 1
        assert sequence.report.gaps == 0
        assert sequence.report.e_max < 0.8661


@pytest.mark.parametrize("variant", [1, 2, 3])
def test_a_point_that_only_the_march_finds_undefined_is_drawn_through(variant: int) -> None:
    met: list[float] = []

    def line(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        return 30 * t, np.where(np.isin(t, met), np.nan, 30 * t), 0.5

    curve = Function(line)
    whole = voxelize(curve, method="march", variant=variant)
    sampled: set[float] = set()
    voxelize(Function(lambda t: (sampled.update(t.tolist()), line(t))[1]))
    met.append(next(t for t in whole.t.tolist()[2:] if t not in sampled))
    assert not voxelize(curve).undefined
    sequence = voxelize(curve, method="march", variant=variant)
    assert [(point.axis, point.t) for point in sequence.undefined] == [("y", met[0])]
    assert np.array_equal(sequence.voxels, whole.voxels)


@pytest.mark.parametrize("variant", [1, 2, 3])
@pytest.mark.parametrize(
    ("y", "t", "where"),
    [
        ("1/(t-0.25)", (-1, 1), "y = inf at t = 0.25 is not finite: y grows without bound"),
        ("sqrt(t)", (-1, 1), "y = nan at t = -1.0 is not finite, nor is y beside it"),
        ("sin(1/t)", (-1, 1), "y = nan at t = 0.0 is not finite, and y does not settle"),
    ],
)
def test_no_value_and_no_limit_is_an_error(
    y: str, t: tuple[float, float], where: str, variant: int
) -> None:
    bad = vd.Parametric("10*t", y, "5", t=t)
    with pytest.raises(CurveError) as alone:
        voxelize(bad, method="march", variant=variant)
    assert str(alone.value).startswith(where)
    assert alone.value.axis == "y"
    with pytest.raises(CurveError) as second:
        vd.voxelize_many([vd.Segment((0, 0, 0), (5, 5, 5)), bad], method="march", variant=variant)
    assert str(second.value).startswith(f"curve 1: {where}")


@pytest.mark.parametrize("variant", [1, 2, 3])
def test_a_callable_is_not_needed_outside_of_its_range(variant: int) -> None:
    def raising(error: Exception) -> Callable[[np.ndarray], np.ndarray]:
        def arc(t: np.ndarray) -> np.ndarray:
            if (t < 0).any() or (t > 3).any():
                raise error
            return np.stack((20 + 10 * np.cos(t), 20 + 10 * np.sin(t), 0.5 + 0 * t))

        return arc

    whole = voxelize(vd.Parametric("20+10*cos(t)", "20+10*sin(t)", "0.5", t=(0, 3)))
    for error in (ValueError("below the range"), IndexError("no such knot"), ZeroDivisionError()):
        curve = vd.Parametric(raising(error), t=(0, 3))
        sequence = voxelize(curve, method="march", variant=variant)
        assert np.array_equal(sequence.voxels, whole.voxels)


def test_a_march_that_loses_its_way() -> None:
    # A guess that never advances: the march goes to and fro.
    line = Function(lambda t: (100 * t, 0.5, 0.5))
    with pytest.raises(CurveError, match="does not reach the end"):
        follow(line, 1, guess=lambda points, _: np.zeros(points.shape[1]))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"variant": 4}, "variant: expected one of 1, 2, 3"),
        ({"tangent": "guessed"}, "no tangent 'guessed'"),
        ({"tangent": "analytic"}, "no derivative"),
        ({"pitch": 0}, "pitch must be positive and finite, not 0"),
        ({"pitch": float("nan")}, "pitch must be positive and finite, not nan"),
        ({"reach": float("inf")}, "reach must be positive and finite, not inf"),
        ({"reach": 0.2}, "one pitch, 0.25, at least, not 0.2"),
        ({"pitch": 1e-9}, "1000 pitches of 1e-09 at most, not 2: take a larger pitch"),
    ],
)
def test_wrong_options(options: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        march(paper_curve(40, 2, 50), **options)

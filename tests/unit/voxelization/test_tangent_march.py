"""Tangent march: the paper's tables II to IV, and the limits of the method."""

import numpy as np
import pytest
from space_curves import Function, fourier_curve, paper_curve

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

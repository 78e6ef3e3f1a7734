"""Measurements against brute force and distances known in closed form."""

from itertools import combinations

import numpy as np
import pytest
from space_curves import Function, chain, paper_curve

import voxdisplay as vd
from voxdisplay.curves import Polyline
from voxdisplay.voxelization import curve_distance, measure


def line(t: np.ndarray) -> tuple[np.ndarray | float, ...]:
    return 100 * t, 0.0, 0.0


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("closed", [False, True])
def test_contacts_by_brute_force(seed: int, closed: bool) -> None:
    rng = np.random.default_rng(seed)
    voxels = rng.integers(-2, 3, (60, 3)) * (1, 2, 3)
    size = len(voxels)
    expected = [
        (i, j)
        for i, j in combinations(range(size), 2)
        if j - i > 1
        and not (closed and j - i == size - 1)
        and np.abs(voxels[i] - voxels[j]).max() <= 1
    ]
    assert measure.contacts(voxels, closed=closed).tolist() == [list(pair) for pair in expected]
    assert measure.count_contacts(voxels, closed=closed) == len(expected)


@pytest.mark.parametrize("size", [1, 2, 3])
@pytest.mark.parametrize("closed", [False, True])
def test_few_voxels(size: int, closed: bool) -> None:
    voxels = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0]])[:size]
    expected = 1 if size == 3 and not closed else 0
    assert len(measure.contacts(voxels, closed=closed)) == expected
    assert measure.count_contacts(voxels, closed=closed) == expected
    assert measure.gaps(voxels, closed=closed).size == 0
    violations = measure.neighbour_violations(voxels, closed=closed)
    assert violations.tolist() == ([0, 2] if expected else [])


def test_no_voxels() -> None:
    none = np.empty((0, 3), dtype=np.int32)
    assert measure.contacts(none).shape == (0, 2)
    assert measure.count_contacts(none) == 0
    assert measure.gaps(none, closed=True).size == 0
    assert measure.neighbour_violations(none).size == 0
    assert measure.distances(none, Function(line)).size == 0
    assert measure.coverage(none, Function(line)) == np.inf


def test_contacts_of_voxels_far_apart() -> None:
    voxels = np.array([[-(2**30), 2**30, 0], [0, 0, 0], [-(2**30), 2**30 - 1, 1]], dtype=np.int32)
    assert measure.contacts(voxels).tolist() == [[0, 2]]


def test_gaps() -> None:
    voxels = np.array([[0, 0, 0], [1, 1, 1], [3, 1, 1], [3, 1, 1], [3, 2, 1]])
    assert measure.gaps(voxels).tolist() == [1]
    assert measure.gaps(voxels, closed=True).tolist() == [1, 4]
    assert measure.gaps(voxels, starts=np.array([0, 2])).tolist() == []
    assert measure.gaps(voxels, closed=True, starts=np.array([0, 2])).tolist() == [4]


def test_the_two_neighbour_rule() -> None:
    straight = np.array([[x, 0, 0] for x in range(6)])
    assert measure.neighbour_violations(straight).size == 0
    corner = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [2, 2, 0]])
    assert measure.neighbour_violations(corner).tolist() == [0, 2]
    torn = np.delete(straight, 3, axis=0)
    assert measure.neighbour_violations(torn).tolist() == [2, 3]
    assert measure.neighbour_violations(torn, starts=np.array([0, 3])).size == 0


def test_distance_from_a_line() -> None:
    rng = np.random.default_rng(0)
    voxels = rng.integers(-3, 104, (300, 3)) * (1, 0, 0) + rng.integers(-9, 9, (300, 3)) * (0, 1, 1)
    centre = voxels + 0.5
    foot = np.clip(centre[:, 0], 0, 100)
    expected = np.sqrt((centre[:, 0] - foot) ** 2 + (centre[:, 1:] ** 2).sum(axis=1))
    assert measure.distances(voxels, Function(line)) == pytest.approx(expected, abs=1e-6)


def test_distance_from_a_circle_near_and_far() -> None:
    rng = np.random.default_rng(1)
    voxels = np.concatenate((rng.integers(-30, 30, (400, 3)), rng.integers(-2000, 2000, (20, 3))))
    curve = Function(lambda t: (20 * np.cos(t), 20 * np.sin(t), 3.0), 0, 2 * np.pi)
    x, y, z = (voxels + 0.5).T
    expected = np.hypot(np.hypot(x, y) - 20, z - 3)
    assert measure.distances(voxels, curve) == pytest.approx(expected, abs=1e-6)


def test_distance_takes_the_nearer_of_two_branches() -> None:
    # Legs 1.2 apart, with a sharp turn between them that no sample hits.
    curve = chain(np.array([[0, 0, 0], [60 / 7, 0, 0], [60 / 7, 1.2, 0], [0, 1.2, 0]]))
    voxels = np.array([[x, y, 0] for x in range(-2, 12) for y in range(-2, 4)])
    t = np.linspace(0, 3, 300_001)
    points = curve.position(t)
    for voxel, distance in zip(voxels, measure.distances(voxels, curve), strict=True):
        apart = points - (voxel + 0.5)[:, None]
        assert distance == pytest.approx(np.sqrt((apart**2).sum(axis=0).min()), abs=1e-5)


def test_distance_from_the_sides_of_a_jump() -> None:
    curve = Function(lambda t: (10 * t, 50.0 * (t >= 1), 0.0), 0, 1)
    voxels = np.array([[10, 50, 0], [10, 25, 0], [5, 0, 0]])
    assert measure.distances(voxels, curve) == pytest.approx(
        [np.sqrt(0.75), np.sqrt(24.5**2 + 0.5), np.sqrt(0.5)], abs=1e-6
    )


def test_coverage() -> None:
    curve = Function(line)
    voxels = np.array([[x, 0, 0] for x in range(100)])
    assert measure.coverage(voxels, curve) == pytest.approx(np.sqrt(0.75), abs=1e-3)
    missing = np.delete(voxels, slice(40, 60), axis=0)
    assert measure.coverage(missing, curve) == pytest.approx(np.hypot(10.5, np.sqrt(0.5)), abs=1e-2)


def test_own_figures_of_a_marched_curve() -> None:
    # Rounded samples: an honest judge sees the error of any method.
    curve = paper_curve(40, 4, 50)
    voxels = np.floor(curve.position(np.linspace(*curve.t_range, 1000))).T.astype(int)
    t = np.linspace(*curve.t_range, 400_001)
    points = curve.position(t)
    some = voxels[::50]
    expected = [
        np.sqrt(((points - (voxel + 0.5)[:, None]) ** 2).sum(axis=0).min()) for voxel in some
    ]
    assert measure.distances(some, curve) == pytest.approx(expected, abs=1e-5)


def test_a_curve_without_points_is_not_measured() -> None:
    with pytest.raises(ValueError, match=r"z = -inf at t = 0\.0 is not finite"):
        measure.distances(np.zeros((1, 3), dtype=int), Function(lambda t: (t, t, np.log(t))))


def test_a_curve_without_end_is_not_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(curve_distance, "MAX_SEGMENTS", 1000)
    with pytest.raises(ValueError, match="too rough to measure"):
        measure.distances(
            np.zeros((1, 3), dtype=int), Function(lambda t: (t, t, 40 * np.sin(1e9 * t)))
        )


def test_work_grows_with_the_points_of_a_dense_curve_and_no_faster() -> None:
    def asked(count: int) -> int:
        """Count the points asked for to measure 90 voxels along so many vertices."""
        t = np.linspace(0, 1, count)
        curve = Polyline(np.stack((5 + 90 * t, 20 + 9 * np.sin(5 * t), 3 + 2 * t), axis=1))
        asked_for = []

        def counted(t: np.ndarray) -> tuple[np.ndarray, ...]:
            asked_for.append(t.size)
            return tuple(curve.position(t))

        same = Function(counted, *curve.t_range)
        same.breaks = curve.breaks
        measure.distances(np.array([[x, 20, 3] for x in range(5, 95)]), same)
        return sum(asked_for)

    assert asked(40_000) < 5 * asked(10_000)


def test_a_voxel_that_is_visited_often_is_measured_once() -> None:
    asked_for = []

    def counted(t: np.ndarray) -> tuple[np.ndarray, ...]:
        asked_for.append(t.size)
        return (5 + 4 * np.cos(t), 5 + 4 * np.sin(t), 0.3 * t)

    def measured(voxels: np.ndarray) -> tuple[list[float], int]:
        asked_for.clear()
        found = measure.distances(voxels, Function(counted, 0, 9))
        return found.tolist(), sum(asked_for)

    voxels = np.random.default_rng(2).integers(0, 10, (40, 3))
    once, work = measured(voxels)
    again, same_work = measured(np.tile(voxels, (300, 1)))
    assert again == 300 * once
    assert same_work == work
    assert measured(voxels[:0])[0] == []


@pytest.mark.parametrize("part", [3 / 257, 5 / 257, 0.2509765625])
@pytest.mark.parametrize("jump", [False, True])
def test_a_callable_without_a_point_where_only_the_measure_looks(
    part: float, *, jump: bool
) -> None:
    def position(t: np.ndarray) -> np.ndarray:
        apart = t - part
        x = apart / np.abs(apart) if jump else np.sin(apart) / apart
        return np.stack((20 + 9 * x, 20 + 30 * t, 5 + 0 * t))

    sequence = vd.voxelize(vd.Parametric(position, t=(0, 1)))
    assert len(sequence.starts) == 1 + jump
    assert sequence.report.e_max < 0.8661
    assert measure.coverage(sequence.voxels, sequence.curve) < 1


def test_more_contacts_than_memory_holds_are_counted_and_not_listed() -> None:
    voxels = np.tile([[1, 2, 3], [2, 2, 3]], (20_000, 1))
    count = measure.count_contacts(voxels)
    assert count == 40_000 * 39_999 // 2 - 39_999
    with pytest.raises(ValueError, match=f"at {count} pairs"):
        measure.contacts(voxels)
    assert len(measure.contacts(voxels[:200])) == measure.count_contacts(voxels[:200])

"""Thinning of voxels written out by hand, and of random walks."""

import numpy as np
import pytest

from voxdisplay.voxelization.curve_batch import Samples
from voxdisplay.voxelization.thinning import WINDOW, thin_events
from voxdisplay.voxelization.voxel_events import NO_HEADING, VoxelEvents


def events(*pieces: list[tuple[int, int, int]]) -> VoxelEvents:
    voxels = [voxel for piece in pieces for voxel in piece]
    return VoxelEvents(
        np.repeat(np.arange(len(pieces)), [len(piece) for piece in pieces]).astype(np.int32),
        np.arange(len(voxels), dtype=float),
        np.array(voxels, dtype=np.int32).reshape(-1, 3).T,
        np.full(len(voxels), NO_HEADING),
    )


def thinned(*pieces: list[tuple[int, int, int]]) -> list[tuple[int, ...]]:
    return [tuple(voxel) for voxel in thin_events(events(*pieces)).voxels.T.tolist()]


def test_nothing_and_one_voxel() -> None:
    assert thinned([]) == []
    assert thinned([(1, 2, 3)]) == [(1, 2, 3)]
    assert thinned([(1, 2, 3)] * 5) == [(1, 2, 3)]


def test_corners_are_cut() -> None:
    assert thinned([(0, 0, 0), (1, 0, 0), (1, 1, 0), (2, 1, 0)]) == [
        (0, 0, 0),
        (1, 1, 0),
        (2, 1, 0),
    ]


def test_a_staircase_becomes_a_diagonal() -> None:
    stairs = [(i // 3 + (i % 3 > 0), i // 3 + (i % 3 > 1), i // 3) for i in range(16)]
    assert thinned(stairs) == [(i, i, i) for i in range(6)]


def test_a_small_loop_vanishes() -> None:
    line = [(x, 0, 0) for x in range(6)]
    loop = [(3, 1, 0), (3, 1, 1), (3, 0, 1), (3, 0, 0)]
    assert thinned(line[:4] + loop + line[4:]) == line


def test_a_hairpin_stays() -> None:
    up, down = [(0, y, 0) for y in range(9)], [(2, y, 0) for y in range(8, -1, -1)]
    hairpin = [*up, (1, 9, 0), *down]
    assert thinned(hairpin) == hairpin
    # Legs that touch are cut back by no more than what both ends of the cut see.
    narrow = [*up, *[(1, y, 0) for y in range(8, -1, -1)]]
    assert thinned(narrow)[:7] == up[:7]


def test_straight_runs_need_no_look() -> None:
    run = events([(x, x // 3, 0) for x in range(5 * WINDOW)])
    straight = VoxelEvents(run.piece, run.t, run.voxels, np.zeros(run.t.size, dtype=np.int8))
    assert np.array_equal(thin_events(straight).voxels, thin_events(run).voxels)
    assert np.array_equal(thin_events(straight).voxels, run.voxels)


def test_pieces_are_thinned_apart() -> None:
    one, other = [(0, 0, 0), (1, 0, 0)], [(1, 1, 0), (2, 1, 0)]
    assert thinned(one, other) == one + other


@pytest.mark.parametrize("seed", range(20))
def test_random_walks(seed: int) -> None:
    rng = np.random.default_rng(seed)
    walk = np.cumsum(rng.integers(-1, 2, (400, 3)), axis=0)
    thin = thin_events(events([tuple(voxel) for voxel in walk.tolist()])).voxels.T
    assert np.array_equal(thin[0], walk[0])
    assert np.array_equal(thin[-1], walk[-1])
    step = np.abs(np.diff(thin, axis=0)).max(axis=1)
    assert set(step.tolist()) == {1}
    known = {tuple(voxel) for voxel in walk.tolist()}
    assert {tuple(voxel) for voxel in thin.tolist()} <= known


@pytest.mark.parametrize("seed", range(40))
def test_a_walk_and_its_reverse_are_thinned_alike(seed: int) -> None:
    rng = np.random.default_rng(seed)
    walk = np.cumsum(rng.integers(-1, 2, (200, 3)) * [1, 1, seed % 2], axis=0).tolist()
    there = [tuple(voxel) for voxel in walk]
    assert thinned(there[::-1]) == thinned(there)[::-1]


def test_of_two_paths_the_one_nearer_to_the_curve_is_taken() -> None:
    # From (0, 0, 0) to (2, 1, 0) either voxel between leads; the curve is nearer to one of them.
    walk = events([(0, 0, 0), (1, 0, 0), (1, 1, 0), (2, 1, 0)])
    for height, between in ((0.6, (1, 0, 0)), (1.4, (1, 1, 0))):
        points = np.array([[0.5, 0.5, 0.5], [1.5, height, 0.5], [2.5, 1.5, 0.5]]).T
        samples = Samples(np.zeros(3, int), np.array([0.0, 1.5, 3.0]), points, np.zeros(1, int))
        thin = thin_events(walk, samples).voxels.T.tolist()
        assert [tuple(voxel) for voxel in thin] == [(0, 0, 0), between, (2, 1, 0)]

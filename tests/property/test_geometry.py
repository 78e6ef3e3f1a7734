"""Properties of sequences along all curves: connectivity, ends, distance, symmetries, batches."""

import numpy as np
from guarantees import check
from hypothesis import example, given, settings
from hypothesis import strategies as st
from space_curves import Function, backwards, chain, fourier_curve, moved, turned

from voxdisplay.curves import Curve, Polyline
from voxdisplay.voxelization import measure, voxelize, voxelize_many

seeds = st.integers(0, 2**32 - 1)
fouriers = st.builds(
    lambda seed, kind, closed: fourier_curve(seed, kind, closed=closed),
    seeds,
    st.sampled_from(["smooth", "rough", "tiny"]),
    st.booleans(),
)
# Vertices on corners, faces and centres of voxels bring about every tie there is.
lattice = st.integers(-40, 40).map(lambda n: n / 2)
anywhere = st.floats(-20, 20, allow_subnormal=False)
coordinates = lattice | anywhere
polylines = st.lists(st.tuples(coordinates, coordinates, coordinates), min_size=2, max_size=6).map(
    lambda vertices: chain(np.array(vertices, dtype=float))
)
cusps = st.builds(
    lambda p, q, size, x, y: Function(
        lambda t: (x + size * np.abs(t) ** p, y + size * np.sign(t) * np.abs(t) ** q, 0.3 * t),
        -1,
        1,
    ),
    st.sampled_from([0.5, 2 / 3, 1, 2, 3]),
    st.sampled_from([1 / 3, 1, 2, 3, 5]),
    st.floats(0.1, 40),
    coordinates,
    coordinates,
)
curves = fouriers | polylines | cusps


@given(curves)
@settings(max_examples=150, deadline=None)
def test_guarantees(curve: Curve) -> None:
    check(voxelize(curve), curve)


@given(curves, st.tuples(*[st.integers(-3, 3).map(lambda n: 32 * n)] * 3))
@settings(max_examples=60, deadline=None)
def test_moving_by_whole_voxels_moves_the_voxels(curve: Curve, shift: tuple[int, int, int]) -> None:
    # Moving rounds coordinates: let them be multiples of 2^-30, so that nothing is lost.
    def rounded(t: np.ndarray) -> tuple[np.ndarray, ...]:
        return tuple(np.round(curve.position(t) * 2**30) / 2**30)

    exact = Function(rounded, *curve.t_range)
    here, there = voxelize(exact), voxelize(moved(exact, shift))
    assert np.array_equal(here.voxels + np.array(shift), there.voxels)
    assert here.closed == there.closed


@given(
    seeds,
    st.sampled_from(["smooth", "rough"]),
    st.booleans(),
    st.permutations([0, 1, 2]).map(tuple),
)
@settings(max_examples=40, deadline=None)
def test_turning_the_axes_turns_the_voxels(
    seed: int, kind: str, closed: bool, axes: tuple[int, ...]
) -> None:
    curve = fourier_curve(seed, kind, closed=closed)  # where ties do not happen
    here, there = voxelize(curve), voxelize(turned(curve, axes))
    assert np.array_equal(here.voxels[:, list(axes)], there.voxels)


@given(fouriers | polylines)  # at a cusp, only rounding tells one side from the other
@example(chain(np.array([[0, -1e-38, 1], [0, 0, 0], [0, 0, 1]])))  # its ends are in two voxels
@settings(max_examples=80, deadline=None)
def test_reversing_a_curve_reverses_the_voxels(curve: Curve) -> None:
    here, there = voxelize(curve), voxelize(backwards(curve))
    assert here.closed == there.closed
    order = np.arange(len(here))[::-1]
    # Both begin with the same voxel, unless a face of voxels lies between the ends.
    if here.closed and np.array_equal(here.voxels[0], there.voxels[0]):
        order = np.roll(order, 1)
    assert np.array_equal(here.voxels[order], there.voxels)


def test_a_mirror_image_has_the_mirrored_voxels() -> None:
    """Polylines with every kind of tie, in one of the 48 positions of the cube each.

    Their vertices are in the middles of voxels, where nobody asks which of two voxels holds them.
    A few cannot be mirrored: what lies across a boundary evenly cannot choose between its sides.
    """
    missed = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        vertices = rng.integers(-20, 21, (5, 3)) + 0.5
        axes, signs = rng.permutation(3), rng.choice([-1, 1], 3)
        here = voxelize(Polyline(vertices)).voxels[:, axes]
        there = voxelize(Polyline(vertices[:, axes] * signs)).voxels
        missed += not np.array_equal(np.where(signs > 0, here, -1 - here), there)
    assert missed <= 8


def test_a_polygon_is_the_same_from_every_corner() -> None:
    missed = 0
    for seed in range(100):
        rng = np.random.default_rng(seed)
        corners = rng.integers(-40, 41, (5, 3)) / 2 if seed % 2 else rng.uniform(-40, 40, (5, 3))
        loops = [
            voxelize(Polyline(np.concatenate((rolled, rolled[:1]))))
            for rolled in (np.roll(corners, -k, axis=0) for k in (0, 1, 3))
        ]
        assert all(loop.closed for loop in loops)
        for loop in loops:
            check(loop, loop.curve)
        sets = [{tuple(voxel) for voxel in loop.voxels.tolist()} for loop in loops]
        missed += not sets[0] == sets[1] == sets[2]
    assert missed <= 2


def test_a_square_keeps_its_corners() -> None:
    corners = np.array([[2, 2, 4], [9, 2, 4], [9, 7, 4], [2, 7, 4]], dtype=float)
    for middle in (0.0, 0.5):
        square = voxelize(Polyline(corners + middle, closed=True))
        lit = set(map(tuple, square.voxels.tolist()))
        wanted = {(x, y, 4) for x in range(2, 10) for y in (2, 7)}
        assert lit == wanted | {(x, y, 4) for x in (2, 9) for y in range(2, 8)}
        assert len(square.contact_pairs) == 4


@given(st.lists(curves, min_size=1, max_size=8))
@settings(max_examples=25, deadline=None)
def test_a_batch_gives_what_each_curve_gives_alone(batch: list[Curve]) -> None:
    for curve, many in zip(batch, voxelize_many(batch), strict=True):
        alone = voxelize(curve)
        assert np.array_equal(alone.voxels, many.voxels)
        assert np.array_equal(alone.t, many.t)
        assert alone.closed == many.closed


@given(seeds, st.floats(0, 1))
@settings(max_examples=40, deadline=None)
def test_a_jump_is_found_anywhere(seed: int, where: float) -> None:
    smooth = fourier_curve(seed, "smooth", closed=False)
    at = 0.1 + 6 * where

    def function(t: np.ndarray) -> tuple[np.ndarray, ...]:
        x, y, z = smooth.position(t)
        return x, y + 40 * (t > at), z

    sequence = voxelize(Function(function, *smooth.t_range))
    assert len(sequence.starts) == 2
    assert measure.gaps(sequence.voxels, starts=sequence.starts).size == 0
    before, after = sequence.starts[1] - 1, sequence.starts[1]
    assert sequence.t[before] <= at <= sequence.t[after]
    assert sequence.t[after] - sequence.t[before] < 1e-12

"""Area means of volumes, against sums over fine subdivisions."""

import numpy as np
import pytest

from voxdisplay.raster.area_means import Placement, area_means, axis_taps, nearest_samples


def brute_force(values, grid, placement):
    """Mean and cover of each voxel by the overlap of every sample with it."""
    total, cover = np.zeros(grid[::-1]), np.zeros(grid[::-1])

    def overlap(at, sample, axis):
        low = placement.offset[axis] + sample * placement.scale[axis]
        return max(0.0, min(low + placement.scale[axis], at + 1) - max(low, at))

    for (z, y, x), _ in np.ndenumerate(total):
        for (k, j, i), value in np.ndenumerate(values):
            part = overlap(x, i, 0) * overlap(y, j, 1) * overlap(z, k, 2)
            if np.isfinite(value):
                total[z, y, x] += part * float(value)
                cover[z, y, x] += part
    return np.divide(total, cover, out=np.zeros_like(total), where=cover > 1e-9), cover


@pytest.mark.parametrize("kind", [np.int16, np.uint8, np.float32, np.float64, np.int64, bool])
@pytest.mark.parametrize(
    ("scale", "offset"),
    [
        ((0.5, 0.5, 0.5), (0.0, 0.0, 0.0)),
        ((1.0, 1.0, 1.0), (0.0, 0.0, 0.0)),
        ((0.37, 0.61, 0.83), (-0.4, 0.7, 0.2)),
        ((1.7, 2.3, 0.4), (-1.5, 0.25, 1.0)),
        ((0.01, 9.0, 1.0), (1.2, -3.0, 100.0)),
    ],
)
def test_means_are_those_of_a_plain_sum(kind, scale, offset):
    random = np.random.default_rng(5)
    values = (random.normal(size=(7, 6, 5)) * 90).astype(kind)
    placement = Placement(scale, offset)
    mean, cover = area_means(values, (3, 4, 5), placement)
    expected, expected_cover = brute_force(values, (3, 4, 5), placement)
    assert np.allclose(cover, expected_cover, atol=1e-12)
    assert np.allclose(mean, expected, atol=3e-5)


def test_values_that_are_not_finite_are_missing():
    values = np.arange(7 * 6 * 5, dtype=np.float32).reshape(7, 6, 5)
    values[2, 3], values[:, 0, 0], values[4, 5, 1] = np.nan, np.inf, -np.inf
    placement = Placement((0.6, 0.6, 0.6), (0, 0.1, 0.3))
    mean, cover = area_means(values, (3, 4, 5), placement)
    expected, expected_cover = brute_force(values, (3, 4, 5), placement)
    assert np.allclose(cover, expected_cover, atol=1e-6)
    assert np.allclose(mean, expected, rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize("kind", [np.int16, np.float32])
def test_mass_is_kept(kind):
    random = np.random.default_rng(2)
    values = random.integers(-1024, 3000, size=(60, 101, 83)).astype(kind)
    grid = (17, 23, 29)
    placement = Placement.contained((83, 101, 60), grid, (0.7, 0.7, 2.5))
    mean, cover = area_means(values, grid, placement)
    mass = (mean.astype(np.float64) * cover).sum()
    expected = values.sum(dtype=np.float64) * np.prod(placement.scale)
    assert abs(mass / expected - 1) < 1e-6


def test_contained_is_uniform_centred_and_touches_two_walls():
    placement = Placement.contained((10, 20, 5), (7, 7, 7), (1, 1, 3))
    assert np.allclose(placement.scale, (0.35, 0.35, 1.05))
    assert np.allclose(placement.offset, (1.75, 0, 0.875))
    moved = Placement.contained((10, 20, 5), (7, 7, 7), (1, 1, 3), (5, 6, 7))
    assert np.allclose(np.subtract(moved.offset, placement.offset), (5, 6, 7))


def test_lengths_of_an_axis_sum_to_its_cover():
    _, length = axis_taps(5, 7, 1.3, 0.2)
    assert np.allclose(length.sum(axis=1), [0.8, 1, 1, 1, 1, 1, 0.7])


def test_nearest_samples_are_those_at_the_centers():
    index, found = nearest_samples((2, 3, 4), (4, 3, 2), Placement((1, 1, 0.5), (1, 0, 0)))
    assert [each.tolist() for each in index] == [[0, 0, 1, 1], [0, 1, 2], [1, 3]]
    assert [each.all() for each in found] == [False, True, True]
    assert found[0].tolist() == [False, True, True, False]


def test_the_largest_numbers_raise_nothing():
    values = np.full((3, 5, 7), np.finfo(np.float64).max)
    values[0] = np.finfo(np.float64).tiny
    mean, _ = area_means(values, (3, 3, 3), Placement((0.43, 0.6, 1), (0, 0, 0)))
    assert mean[0].max() < 1

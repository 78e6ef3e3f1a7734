"""Colours spread along a curve: the integer formula."""

from fractions import Fraction
from math import floor

import numpy as np
import pytest

from voxdisplay.raster.color import interpolate_colors


def exact_channel(stops, i, n):
    """The nearest byte to the blend at voxel i of n, ties upwards, in fractions."""
    t = Fraction(i * (len(stops) - 1), max(n - 1, 1))
    s = min(floor(t), len(stops) - 1)
    a, b = stops[s], stops[min(s + 1, len(stops) - 1)]
    return floor(a + (t - s) * (b - a) + Fraction(1, 2))


@pytest.mark.parametrize("count", [1, 2, 3, 64, 511])
def test_colours_are_the_nearest_with_ties_upwards(count):
    colors = np.array([[0, 255, 3], [255, 0, 8], [10, 11, 250], [9, 200, 250]], dtype=np.uint8)
    found = interpolate_colors(colors, count).tolist()
    for i, row in enumerate(found):
        assert row == [exact_channel(colors[:, c].tolist(), i, count) for c in range(3)]


def test_a_tie_that_floating_point_would_round_down():
    """Half way between two levels, at a place that binary fractions miss."""
    colors = np.array([[0, 0, 0], [35, 5, 15]], dtype=np.uint8)
    assert interpolate_colors(colors, 11)[5].tolist() == [18, 3, 8]
    assert interpolate_colors(colors, 11)[1].tolist() == [4, 1, 2]


def test_no_voxels_and_one_colour():
    assert interpolate_colors(np.array([[1, 2, 3]], np.uint8), 2).tolist() == [[1, 2, 3]] * 2
    assert interpolate_colors(np.array([[1, 2, 3], [4, 5, 6]], np.uint8), 0).shape == (0, 3)

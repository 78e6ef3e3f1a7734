"""Colours of points: indices of voxels among points, and what frames and scenes make of them."""

from __future__ import annotations

import json

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.voxelization import point_indices

# No sharp corners: those may lose their voxel when the sequence is thinned.
BEND = [[1.5, 1.5, 1.5], [9.5, 1.5, 1.5], [12.5, 4.5, 1.5], [12.5, 8.5, 5.5]]
COLORS = [[200, 0, 0], [0, 160, 0], [0, 0, 120], [90, 90, 90]]


def drawn(curve: vd.Curve, colors: object, size: tuple[int, int, int] = (14, 11, 7)) -> np.ndarray:
    frame = vd.Frame(size, "rgb888")
    frame.draw(curve, colors)
    return frame.array()


def test_indices_are_those_of_the_points_and_between_them() -> None:
    sequence = vd.voxelize(vd.Points(BEND))
    index = point_indices(sequence)
    assert index[0] == 0
    assert index[-1] == 3
    assert (np.diff(index) > 0).all()
    for x in range(1, 10):
        (row,) = np.flatnonzero((sequence.voxels == [x, 1, 1]).all(axis=1))
        assert abs(index[row] - (x - 1) / 8) <= 1 / 8
    with pytest.raises(ValueError, match="not made of points"):
        point_indices(vd.voxelize(vd.Segment([1, 2, 3], [4, 5, 6])))


@pytest.mark.parametrize("scale", [1.0, 1.5, 2.0])
def test_every_point_has_its_colour(scale: float) -> None:
    points = np.array(BEND) * scale
    picture = drawn(vd.Points(points), COLORS, (28, 22, 14))
    for (x, y, z), color in zip(np.floor(points).astype(int), COLORS, strict=True):
        assert picture[z, y, x].tolist() == color


def test_colours_blend_between_points_however_far_apart_they_are() -> None:
    points = [[0.5, 0.5, 0.5], [2.5, 0.5, 0.5], [12.5, 0.5, 0.5]]
    picture = drawn(vd.Points(points), [[0, 0, 0], [200, 0, 0], [0, 0, 0]])[0, 0, :13, 0]
    np.testing.assert_allclose(
        picture, [0, 100, 200, 180, 160, 140, 120, 100, 80, 60, 40, 20, 0], atol=12
    )
    assert picture[[0, 2, 12]].tolist() == [0, 200, 0]
    even = drawn(vd.Points(points), [[0, 0, 0], [200, 0, 0]])[0, 0, :13, 0]
    assert even.tolist() == [round(200 * i / 12) for i in range(13)]


def test_a_closed_curve_leads_back_to_the_first_colour() -> None:
    ring = [[3.5, 1.5, 1.5], [8.5, 1.5, 1.5], [10.5, 5.5, 1.5], [6.5, 9.5, 1.5], [1.5, 5.5, 1.5]]
    colors = [[200, 0, 0], [0, 200, 0], [0, 0, 200], [90, 90, 90], [0, 0, 0]]
    picture = drawn(vd.Points(ring, closed=True), colors)
    for (x, y, z), color in zip(np.floor(ring).astype(int), colors, strict=True):
        assert picture[z, y, x].tolist() == color
    np.testing.assert_allclose(picture[1, 3, 2], [100, 0, 0], atol=25)


def test_points_that_are_closer_than_voxels() -> None:
    points = np.linspace([1.2, 1.5, 1.5], [8.9, 1.5, 1.5], 100)
    ramp = np.stack([np.arange(100) * 2] * 3, axis=1)
    picture = drawn(vd.Points(points), ramp)[1, 1, 1:9, 0].astype(int)
    assert (np.diff(picture) > 10).all()


def test_a_scene_fitted_to_another_size_and_its_strands() -> None:
    scene = {
        "size": [14, 11, 7],
        "objects": [{"type": "points", "points": BEND, "color": COLORS}],
    }
    frame = vd.Frame((28, 22, 14), "rgb888")
    frame.draw(vd.read_scene(json.dumps(scene)))
    for point, color in zip(BEND, COLORS, strict=True):
        x, y, z = (int(2 * side) for side in point)
        assert frame.array()[z, y, x].tolist() == color

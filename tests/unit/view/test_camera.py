"""Camera projection, compared with its formula and with known views."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from voxdisplay.view.camera import FARTHEST, LARGEST_ZOOM, NEAREST, SMALLEST_ZOOM, Camera

GRID = (3, 5, 7)
SIZE = (800, 600)
angles = st.floats(-7, 7)


def by_hand(camera, point, grid, size):
    """The docstring's formula, one point, in plain numbers."""
    longest = max(grid)
    x, y, z = ((p - n / 2) / longest for p, n in zip(point, grid, strict=True))
    right = x * math.cos(camera.yaw) - y * math.sin(camera.yaw)
    away = x * math.sin(camera.yaw) + y * math.cos(camera.yaw)
    up = z * math.cos(camera.pitch) + away * math.sin(camera.pitch)
    depth = camera.distance
    if not camera.orthographic:
        depth += away * math.cos(camera.pitch) - z * math.sin(camera.pitch)
    fit, middle = camera.fitted(grid, size)
    k = fit / depth
    return size[0] / 2 + k * right, size[1] / 2 + fit * middle - k * up, k / longest


@given(
    angles, st.floats(-1.6, 1.6), st.floats(NEAREST, FARTHEST), st.floats(0.2, 12), st.booleans()
)
def test_it_is_the_formula_of_its_docstring(yaw, pitch, distance, zoom, orthographic):
    camera = Camera(yaw, pitch, distance, zoom, orthographic)
    points = np.array([[0, 0, 0], [3, 0, 0], [0, 5, 0], [0, 0, 7], [0.5, 4.5, 2.5]])
    found = np.stack(camera.project(points, GRID, SIZE), axis=1)
    with np.errstate(under="ignore"):
        assert np.allclose(found, [by_hand(camera, point, GRID, SIZE) for point in points])


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("pitch", [-1.5, -0.4, 0.0, 0.42, 1.2, math.pi / 2])
@pytest.mark.parametrize("grid", [(3, 5, 7), (128, 128, 128), (64, 8, 16), (1, 1, 40)])
@pytest.mark.parametrize("size", [(800, 600), (390, 844)])
def test_a_grid_that_turns_is_fitted_and_centred(grid, pitch, size, orthographic):
    """What it sweeps touches the margins on two sides, and is as far from both of each pair."""
    corners = np.array(
        [[x, y, z] for x in (0, grid[0]) for y in (0, grid[1]) for z in (0, grid[2])]
    )
    turn = np.linspace(0, 2 * math.pi, 2000)
    views = [Camera(yaw, pitch, orthographic=orthographic) for yaw in turn]
    seen = np.array([camera.project(corners, grid, size)[:2] for camera in views])
    low, high = seen.min(axis=(0, 2)), seen.max(axis=(0, 2))
    assert low + high == pytest.approx(size, abs=0.5)
    assert (low / min(size)).min() == pytest.approx(0.1, abs=1e-3)


def test_what_is_parallel_stays_parallel_in_an_orthographic_picture():
    ends = np.array([[0, 0, 0], [3, 0, 0], [0, 5, 7], [3, 5, 7]])
    x, y, _ = Camera(orthographic=True).project(ends, GRID, SIZE)
    assert (x[1] - x[0], y[1] - y[0]) == pytest.approx((x[3] - x[2], y[3] - y[2]))
    x, y, _ = Camera().project(ends, GRID, SIZE)
    assert (x[1] - x[0], y[1] - y[0]) != pytest.approx((x[3] - x[2], y[3] - y[2]))


def test_from_the_front_x_grows_right_and_z_up_and_y_away():
    camera = Camera(0, 0)
    x, y, scale = camera.project([[0, 0, 0], [3, 0, 0], [0, 0, 7], [0, 5, 0]], GRID, SIZE)
    assert x[1] > x[0]
    assert y[1] == pytest.approx(y[0])
    assert y[2] < y[0], "rows grow downwards"
    assert x[2] == pytest.approx(x[0])
    assert scale[3] < scale[0], "away is smaller"


def test_the_view_is_not_mirrored():
    """Seen from above, x to y turns anticlockwise, as in every right-handed drawing."""
    x, y, _ = Camera(-0.6, math.pi / 2).project([[0, 0, 3], [3, 0, 3], [0, 5, 3]], GRID, SIZE)
    along, across = (x[1] - x[0], y[0] - y[1]), (x[2] - x[0], y[0] - y[2])
    assert along[0] * across[1] - along[1] * across[0] > 0


@given(angles, st.floats(-math.pi / 2, math.pi / 2))
def test_every_grid_is_in_the_picture_from_everywhere(yaw, pitch):
    corners = np.array([[x, y, z] for x in (0, 3) for y in (0, 5) for z in (0, 7)])
    x, y, _ = Camera(yaw, pitch).project(corners, GRID, (600, 600))
    assert 0 < x.min() < x.max() < 600
    assert 0 < y.min() < y.max() < 600


@given(angles, st.floats(-4, 4), st.floats(0.01, 100))
def test_turning_and_zooming_stay_within_what_a_camera_may_be(yaw, pitch, factor):
    camera = Camera().turned(yaw, pitch).zoomed(factor)
    assert abs(camera.pitch) <= math.pi / 2
    assert SMALLEST_ZOOM <= camera.zoom <= LARGEST_ZOOM


@pytest.mark.parametrize(
    "wrong", [{"yaw": math.nan}, {"distance": 0.5}, {"distance": 11}, {"zoom": 0}, {"zoom": 13}]
)
def test_a_camera_that_cannot_be(wrong):
    with pytest.raises(ValueError, match=r"distance|zoom|finite"):
        Camera(**wrong)

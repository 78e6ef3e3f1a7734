"""Rendered pictures: positions, colours, exposure, labels."""

import io
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

import voxdisplay as vd
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.view.camera import Camera
from voxdisplay.view.glow import accumulate_light
from voxdisplay.view.lit_voxels import lit_voxels
from voxdisplay.view.picture import RenderOptions, render_page, render_voxels

GRIDS = [Grid(3, 5, 7), Grid(300, 4, 3), Grid(9, 64, 33), Grid(128, 128, 128)]
CAMERAS = [Camera(), Camera(2.5, -0.3, 1.9), Camera(0, 0)]
RGB = PixelFormat.RGB888
BARE = RenderOptions(glow=False, axes=False)


def page(grid, voxels, format_=RGB, color=(255, 255, 255)):
    array = np.zeros(format_.shape(grid.array_shape), format_.dtype)
    pixel = format_.pixels(format_.nearest(np.array([color], np.uint8)))[0]
    for x, y, z in voxels:
        array[z, y, x] = pixel
    return array


def light_of(grid, voxels, look=BARE, **how):
    """Return the brightness of each pixel, less that of the ground: (H, W)."""
    drawn = np.asarray(render_page(page(grid, voxels, **how), grid, how.get("format_", RGB), look))
    empty = np.asarray(render_page(page(grid, []), grid, RGB, look))
    return (drawn.astype(int) - empty).max(axis=2)


def middle_of(light):
    """The centre of brightness: x, y, in continuous pixels."""
    y, x = np.indices(light.shape) + 0.5
    return (light * x).sum() / light.sum(), (light * y).sum() / light.sum()


@pytest.mark.parametrize("grid", GRIDS, ids=str)
@pytest.mark.parametrize("camera", CAMERAS)
def test_a_voxel_lands_on_the_pixel_that_the_camera_names(grid, camera):
    look = RenderOptions(glow=False, axes=False, camera=camera)
    for voxel in [(0, 0, 0), (grid.nx - 1, grid.ny // 2, grid.nz - 1), (1, grid.ny - 1, 1)]:
        light = light_of(grid, [voxel], look)
        (x,), (y,), (scale,) = camera.project([np.array(voxel) + 0.5], grid, look.size)
        assert middle_of(light) == pytest.approx((x, y), abs=0.35)
        assert light[int(y), int(x)] >= 0.7 * light.max() > 0
        columns = np.nonzero(light > 0.5 * light.max())[1]
        assert np.ptp(columns) <= 1.2 * scale + 3, "it is as wide as a voxel"


def test_the_axes_are_not_swapped():
    """On unequal sides: each end voxel is where its own axis leads, and nowhere else."""
    grid = Grid(3, 5, 7)
    spots = {
        name: middle_of(light_of(grid, [voxel]))
        for name, voxel in {"o": (0, 0, 0), "x": (2, 0, 0), "y": (0, 4, 0), "z": (0, 0, 6)}.items()
    }
    assert spots["x"][0] > spots["o"][0]
    assert spots["x"][1] > spots["o"][1], "x comes nearer, down the picture"
    assert spots["y"][0] > spots["o"][0]
    assert spots["y"][1] < spots["o"][1], "y goes away, up the picture"
    assert abs(spots["z"][0] - spots["o"][0]) < 30
    assert spots["z"][1] < spots["y"][1]


@pytest.mark.parametrize("format_", PixelFormat)
def test_every_format_shows_the_same_place_and_its_colour(format_):
    grid, voxel = Grid(3, 5, 7), (2, 1, 5)
    array = page(grid, [voxel], format_, (255, 0, 0))
    (x,), (y,), _ = Camera().project([np.array(voxel) + 0.5], grid, (800, 600))
    drawn = np.asarray(render_page(array, grid, format_, BARE)).astype(int)
    red, green, _ = drawn[int(y), int(x)]
    assert red > 200
    assert green > 200 if format_ is PixelFormat.MONO1 else green < red - 60


def test_light_adds_up_and_nothing_hides_anything():
    grid, camera = Grid(9, 9, 9), Camera(0, 0)
    near, far = (4, 0, 4), (4, 8, 4)  # one behind the other

    def light(*voxels):
        lit = lit_voxels(page(grid, voxels), grid, RGB)
        glare = accumulate_light(lit, grid, camera, (800, 600))
        full = np.zeros((600, 800))
        high, wide = glare.light.shape[1:]
        full[glare.top : glare.top + high, glare.left : glare.left + wide] = glare.light[0]
        return full

    both = light(near, far)
    assert np.allclose(both, light(near) + light(far), atol=1e-4)
    assert both[300, 400] > 1.2 * light(near)[300, 400]


def test_a_dense_volume_is_not_burnt_out():
    grid = Grid(48, 48, 48)
    z, y, x = np.indices(grid.array_shape) - 23.5
    array = np.zeros((*grid.array_shape, 3), np.uint8)
    array[x**2 + y**2 + z**2 < 22**2] = (60, 140, 255)
    drawn = np.asarray(render_page(array, grid, RGB)).astype(int)
    assert (drawn.min(axis=2) > 240).mean() < 0.001, "it is blue, not white"
    assert (drawn[..., 2] > 150).mean() > 0.05, "and it is bright"


def test_one_dim_voxel_is_seen():
    light = light_of(Grid(64, 64, 64), [(32, 32, 32)], color=(4, 4, 4))
    assert light.max() > 150


def test_the_box_and_the_axes_are_drawn_and_labelled():
    grid = Grid(3, 5, 7)
    empty = page(grid, [])
    stage = np.asarray(render_page(empty, grid, RGB)).astype(int)
    bare = np.asarray(render_page(empty, grid, RGB, BARE)).astype(int)
    assert (bare == bare[0, 0]).all()
    red = (stage[..., 0] > 200) & (stage[..., 1] < 120)
    green = (stage[..., 1] > 180) & (stage[..., 0] < 120)
    blue = (stage[..., 2] > 200) & (stage[..., 0] < 140)
    ends = [[[0, 0, 0], [3, 0, 0]], [[3, 0, 0], [3, 5, 0]], [[0, 0, 0], [0, 0, 7]]]
    for (start, end), mask in zip(ends, (red, green, blue), strict=True):
        x, y, _ = Camera().project([start, end], grid, (800, 600))
        for share in (0.3, 0.7):
            px, py = (int(c[0] + share * (c[1] - c[0])) for c in (x, y))
            assert mask[py - 2 : py + 3, px - 2 : px + 3].any()


@pytest.mark.parametrize("grid", [Grid(3, 5, 7), Grid(40, 4, 9)], ids=str)
@pytest.mark.parametrize("pitch", [-0.7, 0.0, 0.42, 1.3])
def test_axes_and_labels_are_outside_of_the_box(grid, pitch):
    """What has colour lies on or beyond the outline, wherever the camera is."""
    corners = [[x, y, z] for x in (0, grid.nx) for y in (0, grid.ny) for z in (0, grid.nz)]
    for yaw in np.linspace(-3, 3, 9):
        look = RenderOptions(size=(400, 300), camera=Camera(yaw, pitch))
        stage = np.asarray(render_page(page(grid, []), grid, RGB, look)).astype(int)
        colored = np.argwhere(stage.max(axis=2) - stage.min(axis=2) > 90)[:, ::-1]
        assert len(colored) > 100
        points = np.stack(look.camera.project(corners, grid, look.size)[:2], axis=1)
        ring = outline(points)
        beyond = [
            ((colored - one) @ (np.array([-1, 1]) * (other - one)[::-1])) / np.hypot(*(other - one))
            for one, other in zip(ring, np.roll(ring, -1, axis=0), strict=True)
        ]
        assert np.min(beyond, axis=0).max() < 4.5


def test_no_label_is_moved_onto_what_is_inside():
    grid = Grid(9, 9, 9)
    camera = Camera(zoom=3)
    pictures = [
        np.asarray(render_page(page(grid, []), grid, RGB, RenderOptions(camera=camera, labels=on)))
        for on in (True, False)
    ]
    assert np.array_equal(*pictures)


def outline(points):
    """Return the convex hull of points in the plane, by gift wrapping; y grows downwards."""
    ring = [points[np.argmin(points[:, 0])]]
    while True:
        best = next(p for p in points if np.hypot(*(p - ring[-1])) > 1e-6)
        for p in points:
            (ax, ay), (bx, by) = best - ring[-1], p - ring[-1]
            turn = ax * by - ay * bx
            if turn < -1e-9 or (abs(turn) < 1e-9 and np.hypot(bx, by) > np.hypot(ax, ay)):
                best = p
        if np.allclose(best, ring[0]):
            return np.array(ring)
        ring.append(best)


def test_light_stands_before_the_floor():
    grid = Grid(20, 20, 9)
    array = page(grid, [(x, y, 0) for x in range(20) for y in range(20)], color=(255, 0, 0))
    drawn = np.asarray(render_page(array, grid, RGB, RenderOptions(glow=False))).astype(int)
    stage = np.asarray(render_page(page(grid, []), grid, RGB)).astype(int)
    bright = (np.asarray(render_page(array, grid, RGB, BARE))[..., 0] > 200) & (stage[..., 2] > 60)
    assert bright.sum() > 100, "lines are behind it"
    assert (drawn - np.asarray(render_page(array, grid, RGB, BARE)))[bright].max() < 25


def test_the_labels_are_inside_the_picture_from_everywhere():
    grid = Grid(100, 2, 60)
    for yaw in np.linspace(-3, 3, 7):
        look = RenderOptions(size=(240, 180), camera=Camera(yaw, 0.3))
        with_labels = np.asarray(render_page(page(grid, []), grid, RGB, look)).astype(int)
        plain = RenderOptions(size=(240, 180), camera=Camera(yaw, 0.3), labels=False)
        without = np.asarray(render_page(page(grid, []), grid, RGB, plain)).astype(int)
        written = np.argwhere((with_labels != without).any(axis=2))
        assert len(written) > 50
        assert written.min() >= 1
        assert (written.max(axis=0) < (179, 239)).all()


def test_the_picture_kept_for_the_next_one_is_not_drawn_on():
    grid = Grid(3, 5, 7)
    drawn = render_page(page(grid, []), grid, RGB)
    before = drawn.tobytes()
    drawn.paste((255, 255, 255), (0, 0, 800, 600))
    render_page(page(grid, [(1, 1, 1)]), grid, RGB)
    assert render_page(page(grid, []), grid, RGB).tobytes() == before


@settings(max_examples=25, deadline=None)
@given(
    st.tuples(*[st.integers(1, 40)] * 3),
    st.tuples(*[st.integers(16, 130)] * 2),
    st.floats(-4, 4),
    st.floats(-math.pi / 2, math.pi / 2),
    st.floats(1, 10),
    st.integers(0, 2**32 - 1),
)
def test_any_grid_from_anywhere_is_a_picture(sides, size, yaw, pitch, distance, seed):
    grid, rng = Grid(*sides), np.random.default_rng(seed)
    array = rng.integers(0, 256, (*grid.array_shape, 3), dtype=np.uint8)
    array[rng.random(grid.array_shape) < 0.9] = 0
    drawn = render_page(
        array, grid, RGB, RenderOptions(size=size, camera=Camera(yaw, pitch, distance))
    )
    assert (drawn.mode, drawn.size) == ("RGB", size)


def test_a_shared_exposure_is_kept():
    grid = Grid(9, 9, 9)
    lit = lit_voxels(page(grid, [(4, 4, 4)]), grid, RGB)
    dark, bright = (np.asarray(render_voxels(lit, grid, BARE, e)).max() for e in (0.05, 2.0))
    assert dark < bright


def test_a_frame_is_a_png_in_a_notebook():
    frame = vd.Frame((3, 5, 7))
    frame.draw(np.array([[1, 1, 1]]), "orange")
    image = Image.open(io.BytesIO(frame._repr_png_()))
    assert (image.format, image.size) == ("PNG", (800, 600))
    assert image.convert("RGB").tobytes() == render_page(frame.array(), frame.grid, RGB).tobytes()

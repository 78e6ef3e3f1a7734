"""Test patterns, and the check of axes on a page that was read back."""

import itertools

import numpy as np
import pytest

from voxdisplay.display import test_patterns
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat

GRID = Grid(3, 5, 7)
RGB = PixelFormat.RGB888


def page(name, grid=GRID, format_=RGB, brightness=1.0):
    (step,) = test_patterns.pattern_frames(name, grid, format_, brightness)
    return step.frame.array()


def test_axes_are_labelled_by_colour():
    array = page("axes")
    assert array[0, 0, 0].tolist() == [255, 255, 255]
    assert (array[0, 0, 1:] == (255, 0, 0)).all()
    assert (array[0, 1:, 0] == (0, 255, 0)).all()
    assert (array[1:, 0, 0] == (0, 0, 255)).all()
    assert np.count_nonzero(array.any(axis=-1)) == 1 + 2 + 4 + 6


def test_ticks_tell_the_axes_apart_without_colour():
    array = page("axes", Grid(20, 30, 40), PixelFormat.MONO1)
    assert np.flatnonzero(array[1, 0, :]).tolist() == [0, 19], "one on x, and the z axis"
    assert np.flatnonzero(array[1, :, 0]).tolist() == [0, 27, 29]
    assert np.flatnonzero(array[:, 0, 1]).tolist() == [0, 35, 37, 39]


def test_corners_are_labelled_by_colour():
    array = page("corners")
    for x, y, z in itertools.product((0, 1), repeat=3):
        color = [255 * x, 255 * y, 255 * z] if x or y or z else [96, 96, 96]
        assert array[6 * z, 4 * y, 2 * x].tolist() == color
    assert np.count_nonzero(array.any(axis=-1)) == 8


def test_the_plane_marches_along_each_axis():
    frames = list(test_patterns.pattern_frames("plane", GRID, RGB, 1.0))
    assert len(frames) == 3 + 5 + 7
    for number, (axis, at) in enumerate((a, i) for a in range(3) for i in range(GRID[a])):
        lit = np.argwhere(frames[number].frame.array()[..., axis])[:, ::-1]
        assert set(lit[:, axis]) == {at}
        assert len(lit) == GRID.voxels // GRID[axis]
    assert [step.verify for step in frames[:3]] == [True, True, True]
    assert [step.verify for step in frames[-7:]] == [True, False, False, True, False, False, True]


@pytest.mark.parametrize("format_", PixelFormat)
@pytest.mark.parametrize("name", ["axes", "corners", "all"])
@pytest.mark.parametrize("brightness", [0.0, 0.05, 1.0])
def test_however_dark_it_is_lit(format_, name, brightness):
    lit = page(name, GRID, format_, brightness)
    count = np.count_nonzero(lit.any(axis=-1) if lit.ndim == 4 else lit)
    assert count == {"axes": 13, "corners": 8, "all": 105}[name]


def test_brightness_is_a_share():
    assert page("all", brightness=0.2).max() == 51


CUBE = Grid(12, 12, 12)
DEVICES = {
    # What a device makes of memory [z, y, x], and where it so shows x, y and z.
    "as it should": (lambda a: a, ("+x", "+y", "+z")),
    "x and y swapped": (lambda a: a.swapaxes(1, 2), ("+y", "+x", "+z")),
    "y and z swapped": (lambda a: a.swapaxes(0, 1), ("+x", "+z", "+y")),
    "x mirrored": (lambda a: np.flip(a, axis=2), ("-x", "+y", "+z")),
    "z mirrored": (lambda a: np.flip(a, axis=0), ("+x", "+y", "-z")),
    "turned round": (lambda a: np.moveaxis(a, 0, 2), ("+y", "+z", "+x")),
    "turned and mirrored": (lambda a: np.moveaxis(np.flip(a, axis=0), 0, 2), ("+y", "+z", "-x")),
}


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("name", ["axes", "corners"])
@pytest.mark.parametrize("format_", [PixelFormat.RGB888, PixelFormat.INDEX8])
def test_a_device_that_turns_the_axes_round_is_found_out(device, name, format_):
    memory, shown = DEVICES[device]
    meant = page(name, CUBE, format_)
    found = test_patterns.compare_axes(meant, memory(meant), "xyz")
    assert tuple(finding.found for finding in found) == shown
    assert [f.correct for f in found] == [f"+{a}" == s for a, s in zip("xyz", shown, strict=True)]


@pytest.mark.parametrize("device", DEVICES)
def test_the_ticks_find_it_out_on_a_display_without_colours(device):
    memory, shown = DEVICES[device]
    meant = page("axes", CUBE, PixelFormat.MONO1)
    found = test_patterns.compare_axes(meant, memory(meant), "xyz")
    assert tuple(finding.found for finding in found) == shown


def test_a_mirrored_axis_is_found_out_on_unequal_sides():
    meant = page("axes")
    found = test_patterns.compare_axes(meant, np.flip(meant, axis=1), "xyz")
    assert [(f.correct, f.found) for f in found] == [(True, "+x"), (False, "-y"), (True, "+z")]


def test_a_page_that_is_something_else():
    meant = page("axes")
    for got in (np.zeros_like(meant), np.full_like(meant, 9), np.roll(meant, 1, axis=0)):
        assert [(f.correct, f.found) for f in test_patterns.compare_axes(meant, got, "xyz")] == [
            (False, None)
        ] * 3


def test_what_the_pattern_cannot_tell_is_not_claimed():
    meant = page("corners", GRID, PixelFormat.MONO1)
    assert [f.correct for f in test_patterns.compare_axes(meant, meant, "xyz")] == [None] * 3
    thin = page("axes", Grid(4, 1, 4))
    assert [f.correct for f in test_patterns.compare_axes(thin, thin, "xyz")] == [True, None, True]


@pytest.mark.parametrize("grid", [Grid(5, 6, 7), Grid(16, 9, 12)])
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("format_", list(PixelFormat))
def test_an_arrow_is_a_line_with_a_pyramid_at_its_far_end(grid, axis, format_):
    frame = test_patterns.arrow_frame(axis, grid, format_, 1.0)
    index, _ = frame.lit()
    along = np.bincount(grid.voxels_at(index)[:, axis], minlength=grid[axis])
    head = max(1, grid[axis] // 3)
    assert (along[: grid[axis] - 1 - head] == 1).all()
    assert along[-1] == 1
    assert along[-2] == 9
    widths = along[grid[axis] - 1 - head :]
    assert (np.diff(widths) <= 0).all()

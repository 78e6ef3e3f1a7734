"""Ordered dithering: light on the mean, fixed in space, for volumes and for nothing else."""

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.frame.output_transform import OutputTransform
from voxdisplay.raster.dither import BAYER, dithered, ranks_at
from voxdisplay.raster.light import LINEAR
from voxdisplay.raster.pixel_format import PixelFormat

DITHERED = OutputTransform(dithers=True)
FORMATS = [PixelFormat.MONO1, PixelFormat.INDEX8, PixelFormat.RGB565]


def test_each_rank_is_once_in_the_cell_and_each_scale_is_even():
    assert sorted(BAYER.reshape(-1).tolist()) == list(range(64))
    # The first 8 of the thresholds lie on the coarser grid: one in each of its cells.
    where = np.argwhere(BAYER < 8)
    assert len({tuple(each // 2) for each in where}) == 8
    assert len({tuple(each % 2) for each in where}) == 1


@pytest.mark.parametrize("format_", FORMATS)
def test_the_mean_of_a_cell_is_the_light_wanted(format_):
    colors = np.random.default_rng(3).integers(0, 256, (200, 3), dtype=np.uint8)
    ranks = np.arange(64).repeat(len(colors))
    shown = dithered(np.tile(colors, (64, 1)), ranks, format_)
    np.testing.assert_array_equal(format_.rgb(format_.nearest(shown)), shown)
    mean, wanted = LINEAR[shown].reshape(64, -1, 3).mean(axis=0), LINEAR[colors]
    if format_ is PixelFormat.MONO1:
        weights = np.array([0.2126, 0.7152, 0.0722])
        mean, wanted = mean @ weights, wanted @ weights
    assert np.abs(mean - wanted).max() <= 1 / 128 + 1e-12


@pytest.mark.parametrize("format_", FORMATS)
def test_colors_that_the_format_has_stay(format_):
    values = np.arange(2 if format_ is PixelFormat.MONO1 else 256)
    colors = format_.rgb(values)
    for rank in (0, 31, 63):
        np.testing.assert_array_equal(dithered(colors, np.full(len(values), rank), format_), colors)


@pytest.mark.parametrize("format_", ["mono1", "index8", "rgb565"])
def test_arrays_and_volumes_are_dithered_alike(format_):
    samples = np.linspace(0, 1, 9 * 6 * 5).reshape(9, 6, 5)
    pixels = vd.volume_pixels(
        samples, window=(-0.5, 1.5), format=format_, map=["red", "white"], dither="ordered"
    )
    frame = vd.Frame((5, 6, 9), format_).with_output(DITHERED)
    frame.draw(vd.Volume(samples, window=(-0.5, 1.5), map=["red", "white"]))
    np.testing.assert_array_equal(frame.array(), pixels)
    plain = vd.volume_pixels(samples, window=(-0.5, 1.5), format=format_, map=["red", "white"])
    assert not np.array_equal(pixels, plain)


def test_the_pattern_is_fixed_in_space():
    frames = []
    for at in (0, 1):
        frame = vd.Frame((9, 4, 4), "mono1").with_output(DITHERED)
        frame.draw(vd.Volume(np.full((4, 4, 8), 0.5), window=(0, 1), offset=(at, 0, 0)))
        frames.append(frame.array()[:, :, 1:8])
    np.testing.assert_array_equal(*frames)
    assert 0 < frames[0].mean() < 1


def test_mono1_shows_dark_parts_of_a_volume_by_few_voxels():
    samples = np.full((8, 8, 8), 0.5)
    pixels = vd.volume_pixels(samples, window=(0, 1), format="mono1", dither="ordered")
    assert pixels.mean() == pytest.approx(LINEAR[128], abs=1 / 64)
    assert vd.volume_pixels(samples, window=(0, 1), format="mono1").all()


@pytest.mark.parametrize("format_", ["mono1", "index8", "rgb565"])
def test_curves_and_solids_are_never_dithered(format_):
    plain = vd.Frame((9, 9, 9), format_)
    asked = plain.with_output(DITHERED)
    for frame in (plain, asked):
        frame.draw(vd.Segment((0, 0, 0), (8, 7, 6)), "#808080")
        frame.draw(vd.Circle(center=(4, 4, 4), radius=3), ["#404040", "orange"])
        frame.draw(vd.Sphere(center=(4, 4, 4), radius=2), "#505050")
        frame.draw([[0, 0, 8], [1, 0, 8]], "#303030")
    assert asked == plain


def test_displays_with_enough_colors_are_left_alone():
    samples = np.linspace(0, 1, 60).reshape(5, 4, 3)
    plain = vd.Frame((3, 4, 5))
    asked = plain.with_output(DITHERED)
    palette = vd.Frame((3, 4, 5), "index8", own_palette=True).with_output(DITHERED)
    for frame in (plain, asked, palette):
        frame.draw(vd.Volume(samples, window=(0, 1)))
    assert asked == plain
    np.testing.assert_array_equal(palette.rgb(), plain.rgb())
    wanted = vd.volume_pixels(samples, window=(0, 1), dither="ordered")
    np.testing.assert_array_equal(wanted, vd.volume_pixels(samples, window=(0, 1)))


def test_other_ways_are_refused():
    with pytest.raises(ValueError, match="dither"):
        vd.volume_pixels(np.zeros((2, 2, 2)), dither="random")


def test_ranks_repeat_every_four_voxels():
    voxels = np.array([[1, 2, 3], [5, -2, 7], [-3, 6, -1]])
    assert ranks_at(voxels).tolist() == [BAYER[3, 2, 1]] * 3

"""Brightness and current limit: to the bit, for what is sent, in every format."""

import math

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.errors import IncompatibleDevice
from voxdisplay.frame.output_transform import OutputTransform
from voxdisplay.raster.light import FULL, CurrentLimit, dim, dimmed_levels, parts_of

GRID = (3, 5, 7)


def level(value, parts):
    """The documented formula, number by number."""
    share = value / 255
    light = share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4
    light *= parts / 65536
    share = 12.92 * light if light <= 0.0031308 else 1.055 * light ** (1 / 2.4) - 0.055
    return math.floor(255 * share + 0.5)


@pytest.mark.parametrize("parts", [0, 1, 300, 6554, 32768, 39322, 65535, 65536])
def test_levels_follow_the_documented_formula(parts):
    assert dimmed_levels(parts).tolist() == [level(value, parts) for value in range(256)]


def test_known_levels():
    assert dimmed_levels(parts_of(0.5))[[0, 1, 128, 255]].tolist() == [0, 1, 92, 188]
    assert dimmed_levels(FULL).tolist() == list(range(256))
    assert parts_of(0.6) == 39322


def picture(format_, *, own=False):
    frame = vd.Frame(GRID, format_, own_palette=own)
    frame.draw(vd.Segment((0.5, 0.5, 0.5), (2.5, 4.5, 6.5)), ["red", "#4060f0"])
    return frame


def with_page(format_):
    page = np.random.default_rng(5).integers(0, 256, (7, 5, 3, 3), dtype=np.uint8)
    page[page < 90] = 0
    frame = vd.Frame(GRID, format_)
    values = frame.format.nearest(page.reshape(-1, 3))
    frame.set(frame.format.pixels(values).reshape(frame.format.shape((7, 5, 3))))
    frame.draw([[0, 0, 0], [1, 1, 1]], "gold")
    return frame


@pytest.mark.parametrize("make", [picture, with_page])
@pytest.mark.parametrize("format_", ["index8", "rgb565", "rgb888"])
def test_brightness_dims_each_pixel_to_the_nearest_of_its_format(format_, make):
    frame = make(format_)
    lit = frame.with_output(OutputTransform(brightness=0.5))
    levels = np.array([level(value, 32768) for value in range(256)], dtype=np.uint8)
    wanted = frame.format.nearest(levels[frame.rgb().reshape(-1, 3)])
    np.testing.assert_array_equal(
        lit.readback().reshape(-1), frame.format.pixels(wanted).reshape(-1)
    )
    np.testing.assert_array_equal(lit.array(), frame.array())


def test_a_palette_of_its_own_is_dimmed_exactly():
    frame = picture("index8", own=True)
    lit = frame.with_output(OutputTransform(brightness=0.5))
    np.testing.assert_array_equal(lit.readback(), frame.array())
    levels = np.array([level(value, 32768) for value in range(256)], dtype=np.uint8)
    np.testing.assert_array_equal(lit.memory.rgb(), levels[frame.rgb()])


def amps(frame, each_ma):
    share = frame.rgb() / 255
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return light.sum() * each_ma / 1000


@pytest.mark.parametrize("make", [picture, with_page])
@pytest.mark.parametrize("format_", ["index8", "rgb565", "rgb888"])
@pytest.mark.parametrize("share", [0.9, 0.3, 0.01])
def test_the_limit_holds_for_what_is_sent_by_the_largest_factor(format_, make, share):
    frame = make(format_)
    limit = CurrentLimit(share * amps(frame, 20), 20)
    output = OutputTransform(limit=limit)
    lit = frame.with_output(output)
    assert amps(lit.memory, 20) <= limit.amps
    assert f"the limit is {limit.amps:g} A" in lit.output_note
    factor = dim(frame._raster, None, 1.0, limit).factor
    more = frame.with_output(OutputTransform(brightness=(factor + 1) / FULL))
    assert amps(more.memory, 20) > limit.amps


def test_a_limit_that_is_not_reached_changes_nothing():
    frame = picture("rgb888")
    lit = frame.with_output(OutputTransform(limit=CurrentLimit(amps(frame, 20) * 1.001, 20)))
    np.testing.assert_array_equal(lit.readback(), frame.array())
    assert lit.output_note == ""
    assert lit.digest() == frame.digest()


def test_the_current_counts_after_the_brightness():
    frame = picture("rgb888")
    limit = CurrentLimit(amps(frame, 20) * 0.6, 20)
    assert not frame.with_output(OutputTransform(brightness=0.5, limit=limit)).output_note
    assert frame.with_output(OutputTransform(brightness=0.7, limit=limit)).output_note


def test_mono1_has_no_dimmer_light():
    frame = picture("mono1")
    lit = frame.with_output(OutputTransform(brightness=0.5))
    np.testing.assert_array_equal(lit.readback(), frame.array())
    seven = CurrentLimit(7 * 3 * 0.02, 20)
    assert frame.with_output(OutputTransform(limit=seven)).digest() == frame.digest()
    less = frame.with_output(OutputTransform(limit=CurrentLimit(0.41, 20)))
    with pytest.raises(
        IncompatibleDevice, match=r"takes 0\.42 A, the limit is 0\.41 A, and a mono1"
    ):
        less.digest()


def test_a_picture_that_is_drawn_on_is_computed_again():
    frame = picture("rgb888").with_output(OutputTransform(brightness=0.5))
    before = frame.digest()
    assert frame.digest() == before
    frame.draw([[2, 0, 0]], "white")
    assert frame.digest() != before
    assert frame.readback()[0, 0, 2].tolist() == [188] * 3

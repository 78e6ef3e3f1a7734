"""Ramps: palette entries in a row for colours spread along a curve."""

import numpy as np
import pytest
from drawing import page_after, values_of

import voxdisplay as vd
from voxdisplay.frame import Frame
from voxdisplay.raster.color import interpolate_colors
from voxdisplay.raster.palette import Palette
from voxdisplay.wire import spec
from voxdisplay.wire.op_decoder import decode_ops

RAINBOW = np.array([[255, 0, 0], [255, 255, 0], [0, 255, 9], [0, 4, 255]], dtype=np.uint8)
KNOT = vd.TorusKnot(2, 3, (64, 64, 64), 40, 15)
FADE = ("line", "palette", "fade")


def test_each_voxel_of_a_short_curve_has_its_color():
    palette = Palette(grows=True)
    ramp = palette.ramp(RAINBOW, 200)
    assert (ramp.first, ramp.count) == (1, 200)
    assert np.array_equal(palette.colors[1:201], interpolate_colors(RAINBOW, 200))
    assert palette.ramp(RAINBOW.copy(), 200) is ramp
    assert palette.copy().ramps == [ramp]
    assert palette.ramp(RAINBOW[::-1], 200) is None  # 55 entries are left


def test_a_long_curve_takes_what_is_left():
    palette = Palette(grows=True)
    palette.mark_used(np.arange(1, 10))
    palette.mark_used(np.array([200]))
    ramp = palette.ramp(RAINBOW, 700)
    assert (ramp.first, ramp.count) == (10, 190)


@pytest.mark.parametrize(
    ("palette", "stops", "voxels"),
    [
        (Palette(), RAINBOW, 100),
        (Palette(grows=True), RAINBOW, 0),
        (Palette(grows=True), np.array([[9, 9, 9], [0, 0, 0]], dtype=np.uint8), 100),
        (Palette(grows=True), np.array([[9, 9, 9], [12, 9, 9]], dtype=np.uint8), 100),
    ],
    ids=["fixed", "no-voxels", "black", "few-colours"],
)
def test_where_single_entries_are_better(palette, stops, voxels):
    assert palette.ramp(stops, voxels) is None


def test_a_full_palette_has_no_ramps():
    palette = Palette(grows=True)
    palette.mark_used(np.arange(256))
    assert palette.ramp(RAINBOW, 700) is None


@pytest.mark.parametrize("most", [64, 1024])
@pytest.mark.parametrize("many", [False, True])
def test_it_is_sent_in_few_bytes(most, many):
    frame = Frame((128, 128, 128), "index8", own_palette=True)
    colors = ["red", "yellow", "lime", "cyan", "blue", "magenta", "red"]
    if many:
        frame.draw_all([(KNOT, colors), (vd.Segment((3, 4, 5), (90, 20, 9)), "orange")])
    else:
        drawing = frame.draw(KNOT, colors)
    payloads = frame.payloads(most, FADE)
    index, values = frame.lit()
    drawn = decode_ops(payloads, frame.grid, frame.format)
    assert np.array_equal(drawn.index, index)
    assert np.array_equal(drawn.values, values)
    palette = frame.palette.copy()
    assert all(tuple(palette[entry].tolist()) == color for entry, color in drawn.colors.items())
    page = page_after(payloads, frame.grid, frame.format)
    assert np.array_equal(values_of(page, frame.format)[index], values)
    assert page.digest == frame.digest()
    assert any(payload[0] == spec.OP_RAMP for payload in payloads)
    assert 8 * sum(map(len, payloads)) < 6 * len(index)
    if not many:
        assert drawing.exact_color is False
        error = frame.lit_rgb().astype(int) - np.array(rgb_of_the_knot(colors)).astype(int)
        assert abs(error).max() <= 4


def rgb_of_the_knot(colors):
    whole = Frame((128, 128, 128), "rgb888")
    whole.draw(KNOT, colors)
    return whole.lit_rgb()


def test_a_ramp_that_does_not_fit_a_payload_is_sent_as_colors():
    stops = np.random.default_rng(1).integers(1, 256, (30, 3)).astype(np.uint8)
    frame = Frame((128, 128, 128), "index8", own_palette=True)
    frame.draw(KNOT, stops)
    payloads = frame.payloads(64, FADE)
    assert not any(payload[0] == spec.OP_RAMP for payload in payloads)
    drawn = decode_ops(payloads, frame.grid, frame.format)
    assert np.array_equal(drawn.index, frame.lit()[0])
    assert len(drawn.colors) > 200

"""Fades: the three decoders agree, and chains under fades draw what was meant."""

import json
import random

import numpy as np
import pytest
from drawing import page_after, values_of
from hypothesis import given, settings
from hypothesis import strategies as st

import voxdisplay as vd
from voxdisplay.conformance import ops
from voxdisplay.conformance.announced_device import FEATURES, AnnouncedDevice
from voxdisplay.conformance.reference_decoder import ReferenceDecoder
from voxdisplay.conformance.reference_page import Page
from voxdisplay.errors import RemoteProtocolError
from voxdisplay.frame import Frame
from voxdisplay.raster.display_list import DrawnVoxels, Kind, Spread
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import spec
from voxdisplay.wire.fades import FadedRows
from voxdisplay.wire.op_decoder import decode_ops
from voxdisplay.wire.op_encoding import EncoderConfig
from voxdisplay.wire.op_listing import list_ops

GRID = (128, 128, 128)
RAINBOW = ["red", "yellow", "lime", "cyan", "blue", "magenta", "red"]
KNOT = vd.TorusKnot(2, 3, (64, 64, 64), 40, 15)
FADE = ("line", "fade")
COLORED = [PixelFormat.INDEX8, PixelFormat.RGB565, PixelFormat.RGB888]


@pytest.mark.parametrize("format_", COLORED)
@pytest.mark.parametrize("grid", [(5, 7, 9), (300, 4, 3)])
def test_random_ops_are_drawn_alike(format_, grid):
    rng = random.Random(f"{format_} {grid}")
    bits = sum(1 << bit for name, bit in FEATURES.items())
    if format_ is not PixelFormat.INDEX8:
        bits &= ~(1 << spec.FEATURE_DIFF | 1 << spec.FEATURE_PALETTE)
    device = AnnouncedDevice(format_.wire, *grid, features=bits)
    for _ in range(60):
        payload = ops.random_fade(device, rng) + ops.random_ops(device, rng, 300)
        page = Page()
        ReferenceDecoder(device, page).draw(payload)
        meant = np.zeros(Grid(*grid).voxels, dtype=np.uint32)
        meant[list(page.pixels)] = list(page.pixels.values())
        drawn = decode_ops([payload], Grid(*grid), format_)
        found = np.zeros_like(meant)
        found[drawn.index] = drawn.values
        assert np.array_equal(found, meant)
        shown = values_of(page_after([payload], Grid(*grid), format_), format_)
        assert np.array_equal(shown, meant)


def assert_draws(payloads, frame):
    index, values = frame.lit()
    drawn = decode_ops(payloads, frame.grid, frame.format)
    assert np.array_equal(drawn.index, index)
    assert np.array_equal(drawn.values, values)
    shown = values_of(page_after(payloads, frame.grid, frame.format), frame.format)
    assert np.array_equal(np.flatnonzero(shown), index)
    assert np.array_equal(shown[index], values)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from(["rgb565", "rgb888"]),
    st.sampled_from([64, 70, 200, 1024]),
    st.sampled_from([(), ("line",), ("line", "box", "oct", "dots")]),
)
def test_what_is_drawn_over_a_fade_and_beside_it(seed, pixel_format, most, features):
    rng = np.random.default_rng(seed)
    frame = Frame((24, 17, 20), pixel_format)
    for _ in range(rng.integers(1, 6)):
        points = rng.uniform(-3, 24, (4, 3))
        colors = rng.integers(0, 256, (rng.integers(1, 6), 3)).astype(np.uint8)
        frame.draw(vd.Bezier(points), colors)
    if rng.random() < 0.3:
        frame.draw(rng.integers(0, 17, (30, 3)), "white")
    plain = frame.payloads(most, features)
    faded = frame.payloads(most, (*features, "fade"))
    assert all(0 < len(payload) <= most for payload in faded)
    assert sum(map(len, faded)) <= sum(map(len, plain))
    assert_draws(faded, frame)


@pytest.mark.parametrize("pixel_format", ["rgb565", "rgb888"])
def test_a_gradient_costs_little_more_than_one_color(pixel_format):
    frame, plain = Frame(GRID, pixel_format), Frame(GRID, pixel_format)
    voxels = frame.draw(KNOT, RAINBOW).voxels
    plain.draw(KNOT, "red")
    (payload,) = frame.payloads(1024, FADE)
    assert payload[0] == spec.OP_FADE
    assert 8 * (len(payload) - sum(map(len, plain.payloads(1024, FADE)))) <= 0.6 * voxels
    assert len(payload) * 6 < sum(map(len, frame.payloads(1024, ["line"])))


def test_a_curve_of_a_scene_is_a_fade(tmp_path):
    circle = {"type": "circle", "center": [64] * 3, "radius": 50, "color": RAINBOW}
    scene = {"size": [128] * 3, "objects": [circle]}
    frame, again = Frame(GRID), Frame(GRID)
    (tmp_path / "circle.json").write_text(json.dumps(scene))
    frame.draw(vd.load_scene(tmp_path / "circle.json"))
    again.draw(vd.Circle((64, 64, 64), 50), RAINBOW)
    assert frame == again
    assert frame.payloads(1024, FADE)[0][0] == spec.OP_FADE


@pytest.mark.parametrize(
    ("stops", "count", "most"), [(30, 900, 64), (257, 900, 65_535), (3, (1 << 20) + 1, 1024)]
)
def test_spreads_for_which_fade_has_no_room(stops, count, most):
    rng = np.random.default_rng(1)
    spread = Spread(rng.integers(0, 256, (stops, 3)).astype(np.uint8), count)
    index = np.arange(100, dtype=np.int64)
    values = index.astype(np.uint32)
    drawn = DrawnVoxels.of_item(index, values, index > 100, Kind.CURVE, spread)
    config = EncoderConfig(Grid(*GRID), PixelFormat.RGB888, most, 1 << spec.FEATURE_FADE)
    assert FadedRows.of(drawn, config) is None


def test_a_difference_keeps_fades_and_darkens_what_vanished():
    old, new = Frame(GRID), Frame(GRID)
    old.draw(KNOT, RAINBOW)
    new.draw(vd.TorusKnot(2, 3, (64, 64, 64), 40, 9), RAINBOW)
    payloads = new.difference(old, 1024, FADE)
    assert any(payload[0] == spec.OP_FADE for payload in payloads)
    shown = old.array().reshape(-1, 3).copy()
    drawn = decode_ops(payloads, new.grid, new.format)
    shown[drawn.index] = new.format.pixels(drawn.values)
    assert np.array_equal(shown, new.array().reshape(-1, 3))


@pytest.mark.parametrize(
    ("pixel_format", "ops", "what"),
    [
        ("mono1", "08 00 00 00 01", "mono1"),
        ("rgb888", "08 00 80 80 40 00 01 02 03", "fade of 1048577"),
        ("rgb888", "08 00 01 02 01 02 03", "voxel 2 of 2"),
        ("rgb888", "08 00 01 01 01 02", "ends inside"),
        ("rgb888", "08 00 81 00 00 01 02 03", "shortest"),
        ("index8", "09 FA 06 00 01 02 03", "palette"),
    ],
)
def test_what_is_refused(pixel_format, ops, what):
    with pytest.raises(RemoteProtocolError, match=what):
        decode_ops([bytes.fromhex(ops)], Grid(3, 5, 7), PixelFormat(pixel_format))


def test_ramps_are_read():
    found = decode_ops([bytes.fromhex("09 FD 02 01 00 00 00 05 FF 04")], Grid(3, 5, 7), COLORED[0])
    assert found.colors == {253: (0, 0, 0), 254: (3, 128, 2), 255: (5, 255, 4)}


def test_listing():
    config = EncoderConfig(Grid(3, 5, 7), PixelFormat.INDEX8, 64)
    payload = bytes.fromhex("08 01 80 01 05 10 20 09 00 01 00 01 02 03 A0 08 00 80")
    assert list(list_ops(payload, config)) == [("FADE", 7), ("RAMP", 7), ("RUN", 1), ("?", 3)]
    config = EncoderConfig(Grid(3, 5, 7), PixelFormat.RGB888, 64)
    assert list(list_ops(bytes.fromhex("08 00 00 00 01 02 03"), config)) == [("FADE", 7)]

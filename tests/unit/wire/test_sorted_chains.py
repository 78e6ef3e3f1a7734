"""ARC2: fades and near starts are drawn by three decoders as they were meant; its selection."""

import random

import numpy as np
import pytest
from drawing import page_after, values_of
from hypothesis import given, settings
from hypothesis import strategies as st

import voxdisplay as vd
from voxdisplay.conformance import ops as kit_ops
from voxdisplay.conformance import second_chains
from voxdisplay.conformance.announced_device import FEATURES, AnnouncedDevice
from voxdisplay.conformance.checks.range_coded_chains import random_walk
from voxdisplay.conformance.reference_decoder import ReferenceDecoder
from voxdisplay.conformance.reference_page import Page
from voxdisplay.conformance.second_chains import FadeInk, InkedPiece
from voxdisplay.errors import RemoteProtocolError
from voxdisplay.frame import Frame
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import spec
from voxdisplay.wire.op_decoder import decode_ops

ARC2 = ("line", "arc", "arc2")
RAINBOW = ["red", "yellow", "lime", "cyan", "blue", "magenta", "red"]
KNOT = vd.TorusKnot(2, 3, (64, 64, 64), 40, 15)
BITS = sum(1 << bit for bit in FEATURES.values())


def drawn_by_all(payload, grid, format_):
    """The pixel values that the kit's decoder draws; the two others must draw them, too."""
    page = Page()
    ReferenceDecoder(AnnouncedDevice(format_.wire, *grid, features=BITS), page).draw(payload)
    meant = np.zeros(Grid(*grid).voxels, dtype=np.uint32)
    meant[list(page.pixels)] = list(page.pixels.values())
    drawn = decode_ops([payload], Grid(*grid), format_)
    found = np.zeros_like(meant)
    found[drawn.index] = drawn.values
    assert np.array_equal(found, meant)
    assert np.array_equal(values_of(page_after([payload], Grid(*grid), format_), format_), meant)
    return meant


@pytest.mark.parametrize("format_", PixelFormat)
@pytest.mark.parametrize("grid", [(5, 7, 9), (300, 4, 3), (1025, 2, 3)])
def test_random_pieces_are_drawn_alike(format_, grid):
    rng = random.Random(f"{format_} {grid}")
    device = AnnouncedDevice(format_.wire, *grid, features=BITS)
    for _ in range(30):
        pieces = []
        for _ in range(rng.randint(0, 7)):
            count = rng.choice([1, 5, 300])
            inks = [None, rng.randint(1, device.full_pixel)]
            if format_ is not PixelFormat.MONO1:
                inks.append(FadeInk(kit_ops.random_stops(rng), count, rng.randrange(count)))
            walk = tuple(random_walk(device, rng, rng.randint(0, 9), 0.8))
            pieces.append(InkedPiece(walk, rng.choice(inks)))
            pieces.append(InkedPiece((), rng.choice(inks), jump=False))
        before = b""
        if format_ is not PixelFormat.MONO1 and rng.random() < 0.5:
            before = kit_ops.random_fade(device, rng)
        drawn_by_all(
            before + second_chains.encode(device, pieces, near=rng.random() < 0.7), grid, format_
        )


def assert_draws(payloads, frame):
    index, values = frame.lit()
    drawn = decode_ops(payloads, frame.grid, frame.format)
    assert np.array_equal(drawn.index, index)
    assert np.array_equal(drawn.values, values)
    shown = values_of(page_after(payloads, frame.grid, frame.format), frame.format)
    assert np.array_equal(np.flatnonzero(shown), index)
    assert np.array_equal(shown[index], values)


@settings(max_examples=50, deadline=None, derandomize=True)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from(["mono1", "index8", "rgb565", "rgb888"]),
    st.sampled_from([64, 70, 200, 1024]),
    st.sampled_from([1, 4, 70]),
    st.sampled_from([(24, 17, 20), (1100, 9, 9)]),
)
def test_frames_are_drawn_as_they_were_meant(seed, pixel_format, most, curves, grid):
    rng = np.random.default_rng(seed)
    frame = Frame(grid, pixel_format)
    for _ in range(curves):
        start = rng.uniform(0, grid, (1, 3))
        points = start + np.cumsum(rng.uniform(-4, 4, (4, 3)), axis=0)
        colors = rng.integers(0, 256, (rng.choice([1, 1, 3]), 3)).astype(np.uint8)
        frame.draw(vd.Bezier(points), colors)
    payloads = frame.payloads(most, ["arc2"])
    assert all(0 < len(payload) <= most for payload in payloads)
    assert_draws(payloads, frame)


def short_curves(pixel_format="mono1", colors=("white",)):
    rng = np.random.default_rng(22)
    frame = Frame((128, 128, 128), pixel_format)
    start = rng.uniform(0, 128, (400, 1, 3))
    points = (start + np.cumsum(rng.uniform(-7, 7, (400, 4, 3)), axis=1)).clip(0.5, 127.5)
    count = 0
    for number, each in enumerate(points):
        count += frame.draw(vd.Bezier(each), colors[number % len(colors)]).voxels
    return frame, count


def test_many_short_curves():
    frame, voxels = short_curves()
    payloads = frame.payloads(1024, ARC2)
    assert payloads[0][0] == spec.OP_ARC2
    assert 8 * sum(map(len, payloads)) <= 4.8 * voxels
    assert sum(map(len, payloads)) < 0.95 * sum(map(len, frame.payloads(1024, ["line", "arc"])))
    assert_draws(payloads, frame)


def test_curves_of_few_colors_are_put_together():
    frame, _ = short_curves("index8", ["orange", "lime", "blue"])
    payloads = frame.payloads(1024, ARC2)
    assert sum(map(len, payloads)) < 0.9 * sum(map(len, frame.payloads(1024, ["line", "arc"])))
    assert_draws(payloads, frame)


def test_a_single_curve_stays_arc():
    frame = Frame((128, 128, 128), "mono1")
    frame.draw(KNOT)
    assert frame.payloads(1024, ARC2) == frame.payloads(1024, ["line", "arc"])
    assert frame.payloads(1024, ["arc2"])[0][0] == spec.OP_ARC2


def test_a_set_is_sent_as_one():
    frame = Frame((32, 32, 32), "mono1")
    solid = np.argwhere(np.ones((20, 20, 20), dtype=bool))
    frame.draw(solid)
    assert frame.payloads(1024, [*ARC2, "box", "oct"]) == frame.payloads(1024, ["box", "oct"])


@pytest.mark.parametrize("pixel_format", ["rgb565", "rgb888"])
def test_a_gradient_costs_little_more_than_one_color(pixel_format):
    frame, plain = Frame((128,) * 3, pixel_format), Frame((128,) * 3, pixel_format)
    voxels = frame.draw(KNOT, RAINBOW).voxels
    plain.draw(KNOT, "red")
    payloads = frame.payloads(1024, ARC2)
    assert payloads[0][0] == spec.OP_ARC2
    excess = sum(map(len, payloads)) - sum(map(len, plain.payloads(1024, ARC2)))
    assert 8 * excess <= 0.6 * voxels
    assert_draws(payloads, frame)


@pytest.mark.parametrize(
    ("ops", "what"),
    [
        ("5A A9 9C FF FF FF EE 00 00 00 48", "leaves the grid"),
        ("5A E3 9A 60 00 00 00 00 00 00 00 00 00", "voxel 5 of 5"),
        ("5A", "ends inside"),
        ("5A A9 9A C0", "leaves the grid"),
    ],
)
def test_what_is_refused(ops, what):
    with pytest.raises(RemoteProtocolError, match=what):
        decode_ops([bytes.fromhex(ops)], Grid(3, 5, 7), PixelFormat.INDEX8)


def test_a_difference_darkens_what_vanished():
    """Dark pens in mono1, which has no fades."""
    old, new = Frame((128, 128, 128), "mono1"), Frame((128, 128, 128), "mono1")
    old.draw(KNOT)
    new.draw(vd.TorusKnot(2, 3, (64, 64, 64), 40, 9))
    payloads = new.difference(old, 1024, ["arc2"])
    assert payloads[0][0] == spec.OP_ARC2
    shown = old.array().reshape(-1).copy()
    drawn = decode_ops(payloads, new.grid, new.format)
    shown[drawn.index] = drawn.values
    assert np.array_equal(shown, new.array().reshape(-1))

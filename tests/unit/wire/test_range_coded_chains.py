"""Range-coded chains, drawn by the emulator; and the selection of ARC."""

import numpy as np
import pytest
from drawing import page_after, values_of
from hypothesis import given, settings
from hypothesis import strategies as st

import voxdisplay as vd
from voxdisplay.frame import Frame
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import spec
from voxdisplay.wire.op_encoding import EncoderConfig
from voxdisplay.wire.range_coded_chains import encode_range_coded

GRIDS = [Grid(17, 12, 20), Grid(3, 5, 7), Grid(300, 4, 3), Grid(1, 1, 1)]
ARC = 1 << spec.FEATURE_ARC
PAPER = vd.Parametric(
    "50 + 40*cos(t)", "50 + 40*sin(t)", "50 + 40*(1 - cos(4*t))", t=("-170*deg", "170*deg")
)


def walk(rng, grid, count):
    """Voxels that mostly follow each other, straight on for a while, and sometimes jump."""
    places = [rng.integers(0, grid)]
    step = rng.integers(-1, 2, 3)
    while len(places) < count:
        if rng.random() < 0.3:
            step = rng.integers(-1, 2, 3)
        there = places[-1] + step
        inside = ((there >= 0) & (there < grid)).all()
        places.append(there if inside and rng.random() < 0.97 else rng.integers(0, grid))
    return np.array(places)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from(GRIDS),
    st.sampled_from(PixelFormat),
    st.sampled_from([64, 65, 200, 1024]),
    st.sampled_from([1, 2, 7, 60, 900]),
)
def test_the_emulator_draws_what_was_meant(seed, grid, pixel_format, most, count):
    rng = np.random.default_rng(seed)
    voxels = walk(rng, grid, count)
    voxels = voxels[np.sort(np.unique(voxels, axis=0, return_index=True)[1])]
    pens = rng.choice(rng.integers(1, pixel_format.full + 1, 3), len(voxels))
    pens = np.repeat(pens[::5], 5)[: len(voxels)]
    payloads = encode_range_coded(voxels, pens, EncoderConfig(grid, pixel_format, most, ARC))
    assert all(0 < len(payload) <= most for payload in payloads)
    meant = np.zeros(grid.voxels, dtype=np.uint32)
    meant[grid.index_of(voxels)] = pens
    shown = values_of(page_after(payloads, grid, pixel_format), pixel_format)
    assert np.array_equal(shown, meant)


def test_a_long_straight_line_is_cut_where_a_piece_may_be_longest():
    grid = Grid(65535, 1, 2)
    voxels = np.stack([np.arange(65535), np.zeros(65535, int), np.zeros(65535, int)], axis=1)
    (payload,) = encode_range_coded(
        voxels, np.ones(65535, int), EncoderConfig(grid, PixelFormat.MONO1, 1024)
    )
    shown = values_of(page_after([payload], grid, PixelFormat.MONO1), PixelFormat.MONO1)
    assert shown.sum() == 65535
    assert len(payload) < 200


def test_it_is_sent_where_it_was_announced_and_is_shorter():
    frame = Frame((128, 128, 128), "rgb888")
    frame.draw(PAPER, "orange")
    plain = frame.payloads(1024)
    (short,) = frame.payloads(1024, {"arc"})
    assert short[0] == spec.OP_ARC
    assert len(short) < 0.7 * sum(map(len, plain))
    frame.set(frame.array())  # now nobody knows an order
    assert frame.payloads(1024, {"arc"})[0][0] != spec.OP_ARC


@pytest.mark.parametrize(("count", "tried"), [(40, True), (400, False)])
def test_it_is_not_sent_where_it_is_longer(monkeypatch, count, tried):
    """Nor tried where LINE takes fewer bytes than it ever could."""
    calls = []

    def noted(*arguments):
        calls.append(arguments)
        return encode_range_coded(*arguments)

    monkeypatch.setattr("voxdisplay.wire.range_coded_chains.encode_range_coded", noted)
    frame = Frame((512, 128, 128), "rgb888")
    length = count - 1
    way, steps = np.array([length, 17, -22]), np.arange(count)[:, None]
    frame.draw(np.array([3, 5, 90]) + (2 * steps * way + length) // (2 * length), "white")
    assert frame.payloads(1024, {"arc", "line"}) == frame.payloads(1024, {"line"})
    assert bool(calls) == tried


@pytest.mark.parametrize(("rate", "used"), [(None, False), (11_520, True), (300_000, False)])
def test_it_is_sent_on_slow_lines(rate, used):
    with vd.open("sim:?size=128x128x128&format=index8") as display:
        display._connection._transport.bytes_per_s = rate
        frame = display.frame()
        frame.draw(PAPER, "orange")
        assert (display._operations.queue.payloads(frame)[-1][0] == spec.OP_ARC) == used
        assert display.present(frame).digest == frame.digest()
        display.verify(frame)

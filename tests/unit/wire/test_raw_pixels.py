"""Raw pages: what they draw, what they cost, and when they are selected."""

import numpy as np
import pytest
from drawing import decode_plainly
from hypothesis import given, settings
from hypothesis import strategies as st

from voxdisplay.frame import Frame
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import raw_pixels
from voxdisplay.wire.op_encoding import EncoderConfig

GRIDS = [Grid(3, 5, 7), Grid(17, 12, 20), Grid(300, 4, 3), Grid(1, 1, 1)]


def random_page(rng, format_, voxels, lit):
    """Noise of which so much is lit, a part at either end, and a part dark."""
    page = rng.integers(1, format_.full + 1, voxels, dtype=np.uint32)
    page[rng.random(voxels) > lit] = 0
    if voxels > 9:
        page[: voxels // 9 * int(rng.integers(3))] = 0
        page[voxels - voxels // 9 * int(rng.integers(3)) :] = 0
    return format_.pixels(page)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(
    st.sampled_from(GRIDS),
    st.sampled_from(PixelFormat),
    st.sampled_from([64, 65, 100, 1024]),
    st.sampled_from([0.02, 0.3, 0.7, 0.97, 1.0]),
    st.sampled_from([8, 104, 1 << 19]),
    st.integers(0, 2**32 - 1),
)
def test_a_page_is_drawn_in_any_order_of_its_payloads(grid, format_, most, lit, slab, seed):
    rng = np.random.default_rng(seed)
    page = random_page(rng, format_, grid.voxels, lit)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(raw_pixels, "_SLAB_VOXELS", slab)
        portions = list(raw_pixels.encode_raw(page, EncoderConfig(grid, format_, most)))
    payloads = [payload for portion in portions for payload in portion]
    assert all(1 <= len(payload) <= most for payload in payloads)
    rng.shuffle(payloads)
    values = format_.values(page)
    drawn = decode_plainly(payloads, grid, format_)
    assert drawn.page == values.tolist()
    assert not drawn.two_pixels
    assert bool(payloads) == bool(values.any())


@pytest.mark.parametrize("format_", PixelFormat)
def test_a_full_page_costs_its_pixels_and_hardly_more(format_):
    grid = Grid(64, 32, 32)
    page = format_.pixels(np.full(grid.voxels, format_.full))
    payloads = [
        p for ps in raw_pixels.encode_raw(page, EncoderConfig(grid, format_, 1024)) for p in ps
    ]
    pixels = -(-grid.voxels * (1 if format_ is PixelFormat.MONO1 else 8 * format_.bytes) // 8)
    assert pixels < sum(map(len, payloads)) <= pixels * 1.01


def test_narrow_gaps_are_written_and_wide_ones_skipped():
    grid = Grid(3, 5, 7)
    config = EncoderConfig(grid, PixelFormat.INDEX8, 64)
    page = np.zeros(grid.voxels, dtype=np.uint8)
    page[[4, 8, 13]] = 9
    # SKIP 4, LIT of 5 with three that are dark between, SKIP 4, LIT of 1.
    expected = bytes([0x83, 0xC4, 9, 0, 0, 0, 9, 0x83, 0xC0, 9])
    assert list(raw_pixels.encode_raw(page, config)) == [[expected]]


def test_noise_is_told_from_what_has_runs():
    rng = np.random.default_rng(5)
    grid = Grid(32, 32, 32)

    def noise(format_, values):
        page = format_.pixels(np.asarray(values, dtype=np.uint32).reshape(-1))
        return raw_pixels.is_incompressible(page, EncoderConfig(grid, format_, 1024))

    z, y, x = np.indices((32, 32, 32))
    ball = (x - 16) ** 2 + (y - 16) ** 2 + (z - 16) ** 2 < 200
    for format_ in set(PixelFormat) - {PixelFormat.MONO1}:
        many = rng.integers(1, format_.full + 1, x.shape)
        assert noise(format_, many)
        assert noise(format_, many * ball), "what is dark does not count"
        assert not noise(format_, ball * 7), "one colour"
        assert not noise(format_, rng.integers(1, 9, x.shape)), "a few colours"
        assert not noise(format_, np.repeat(many.reshape(-1)[::4], 4)), "runs of four"
        assert not noise(format_, x * 0), "nothing at all"
    assert noise(PixelFormat.MONO1, rng.random(x.shape) < 0.5)
    assert not noise(PixelFormat.MONO1, ball)


def test_a_frame_goes_plain_only_over_a_fast_line_and_with_what_is_drawn_on_it():
    rng = np.random.default_rng(2)
    frame = Frame((16, 12, 20), "index8", own_palette=True)
    frame.set(rng.integers(1, 200, (20, 12, 16), dtype=np.uint8))
    frame.draw([(3, 5, 7)], "#123456")
    assert frame.has_own_palette
    features = ("palette",)

    def coded(rate):
        return [payload for some in frame.iter_payloads(1024, features, rate) for payload in some]

    fast = coded(1e8)
    drawn = decode_plainly(fast, frame.grid, frame.format)
    assert drawn.page == frame.array().reshape(-1).tolist()
    entry = int(frame.array()[7, 5, 3])
    assert drawn.palette[entry] == (0x12, 0x34, 0x56)
    assert sum(map(len, fast)) > frame.grid.voxels
    assert coded(1e6) == coded(1.1e6), "otherwise all is parsed"

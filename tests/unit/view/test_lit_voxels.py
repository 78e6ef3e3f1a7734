"""Lit voxels of pages of every format."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.raster.pixel_map import PixelMap
from voxdisplay.view.lit_voxels import lit_voxels
from voxdisplay.view.live.snapshot_message import Snapshot, encode

# (x, y, z): colour. In scan order; colours that every format but mono1 has as they are.
LIT = {
    (0, 0, 0): (255, 0, 0),
    (2, 0, 0): (0, 255, 0),
    (1, 4, 2): (0, 0, 255),
    (2, 4, 6): (255,) * 3,
}


def page(grid, format_):
    array = np.zeros(format_.shape(grid.array_shape), format_.dtype)
    for (x, y, z), color in LIT.items():
        value = format_.nearest(np.array([color], np.uint8))
        array[z, y, x] = format_.pixels(value)[0]
    return array


@pytest.mark.parametrize("format_", PixelFormat)
@pytest.mark.parametrize("grid", [Grid(3, 5, 7), Grid(300, 5, 9)])
def test_places_and_colours(grid, format_):
    positions, colors = lit_voxels(page(grid, format_), grid, format_)
    assert list(map(tuple, positions.tolist())) == list(LIT)
    mono = format_ is PixelFormat.MONO1
    meant = [(255,) * 3 if mono else color for color in LIT.values()]
    assert list(map(tuple, colors.tolist())) == meant
    assert (positions.dtype, colors.dtype) == (np.uint16, np.uint8)


@pytest.mark.parametrize("format_", PixelFormat)
@pytest.mark.parametrize("grid", [Grid(3, 5, 7), Grid(300, 5, 9)])
def test_lit_pixels_alone_show_the_same(grid, format_):
    array = page(grid, format_)
    values = format_.values(array)
    pixels = PixelMap(np.flatnonzero(values), values[values != 0])
    colors = np.arange(768, dtype=np.uint8).reshape(256, 3)
    for palette in [None, colors] if format_ is PixelFormat.INDEX8 else [None]:
        dense, sparse = (lit_voxels(each, grid, format_, palette) for each in (array, pixels))
        assert np.array_equal(dense.positions, sparse.positions)
        assert np.array_equal(dense.colors, sparse.colors)
        assert sparse.positions.dtype == np.uint16
        snapshots = (
            Snapshot(each, grid, format_, 1, "", palette=palette) for each in (array, pixels)
        )
        assert encode(next(snapshots)) == encode(next(snapshots))


@pytest.mark.parametrize("format_", PixelFormat)
def test_dark_and_full(format_):
    grid = Grid(3, 5, 7)
    dark = np.zeros(format_.shape(grid.array_shape), format_.dtype)
    assert lit_voxels(dark, grid, format_).positions.shape == (0, 3)
    full = np.full_like(dark, 1)
    positions, colors = lit_voxels(full, grid, format_)
    assert np.array_equal(grid.index_of(positions), np.arange(grid.voxels))
    assert colors.shape == (grid.voxels, 3)


def test_a_palette_gives_the_colours():
    grid, format_ = Grid(3, 5, 7), PixelFormat.INDEX8
    palette = np.zeros((256, 3), np.uint8)
    palette[9] = 1, 2, 4
    array = np.zeros(grid.array_shape, np.uint8)
    array[6, 4, 2] = 9
    assert lit_voxels(array, grid, format_, palette).colors.tolist() == [[1, 2, 4]]


def test_one_channel_is_enough():
    grid, format_ = Grid(3, 5, 7), PixelFormat.RGB888
    for channel in range(3):
        array = np.zeros((7, 5, 3, 3), np.uint8)
        array[6, 3, 1, channel] = 1
        assert lit_voxels(array, grid, format_).positions.tolist() == [[1, 3, 6]]


def test_a_page_of_another_shape_is_refused():
    with pytest.raises(ValueError, match="shape"):
        lit_voxels(np.zeros((3, 5, 7), np.uint8), Grid(3, 5, 7), PixelFormat.INDEX8)


@given(
    st.sampled_from(list(PixelFormat)),
    st.sampled_from([Grid(3, 5, 7), Grid(4, 4, 4), Grid(1, 1, 1), Grid(300, 5, 9)]),
    st.sampled_from([0.0, 0.005, 0.1, 1.0]),
    st.integers(0, 1000),
)
def test_what_is_lit_is_found_however_little_or_much_it_is(format_, grid, density, seed):
    rng = np.random.default_rng(seed)
    top = 2 if format_ is PixelFormat.MONO1 else np.iinfo(format_.dtype).max + 1
    array = rng.integers(0, top, format_.shape(grid.array_shape)).astype(format_.dtype)
    array[rng.random(grid.array_shape) >= density] = 0
    values = format_.values(array)
    positions, colors = lit_voxels(array, grid, format_)
    assert np.array_equal(grid.index_of(positions), np.flatnonzero(values))
    assert np.array_equal(colors, format_.rgb(values[values != 0]))

"""Palettes: allocation of entries to colours, and the colours shown."""

import numpy as np
import pytest
from drawing import decode_plainly

from voxdisplay.frame import Frame
from voxdisplay.raster.palette import DEFAULT, Palette
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import spec
from voxdisplay.wire.op_encoding import EncoderConfig
from voxdisplay.wire.palette_ops import color_blocks
from voxdisplay.wire.payload_splitting import PayloadLayout

GRID = (17, 9, 5)


def rgb(*colors):
    return np.array(colors, dtype=np.uint8)


def grey(count):
    """Greys, all different, none black."""
    return np.repeat(np.arange(1, count + 1, dtype=np.uint8)[:, None], 3, axis=1)


def test_the_default_palette_is_the_documents():
    """2.1, and 8: "floor(255 · value + 1/2)"."""
    for entry, color in enumerate(DEFAULT.tolist()):
        levels = ((entry >> 5) / 7, ((entry >> 2) & 7) / 7, (entry & 3) / 3)
        assert color == [int(255 * level + 0.5) for level in levels]


def test_a_colour_of_the_palette_is_its_entry():
    palette = Palette(grows=True)
    assert palette.nearest(DEFAULT[[7, 255, 0]]).tolist() == [7, 255, 0]
    assert len(palette.entries_differing(DEFAULT)) == 0


def test_a_colour_that_is_missing_gets_an_entry_that_nobody_uses():
    palette = Palette(grows=True)
    palette.mark_used(np.array([1, 2, 4]))
    values = palette.nearest(rgb((1, 2, 3), (4, 5, 6), (1, 2, 3), (0, 0, 0)))
    assert values.tolist() == [3, 5, 3, 0]
    assert palette.entries_differing(DEFAULT).tolist() == [3, 5]
    assert palette.rgb(values).tolist() == [[1, 2, 3], [4, 5, 6], [1, 2, 3], [0, 0, 0]]
    assert palette.nearest(rgb((4, 5, 6))).tolist() == [5]
    assert palette.nearest(DEFAULT[[3]]).tolist() == [6], "its colour is elsewhere now"


def test_a_copy_grows_for_itself():
    palette = Palette(grows=True)
    twin = palette.copy()
    palette.nearest(rgb((1, 2, 3)))
    assert twin.nearest(rgb((9, 9, 9))).tolist() == [1]
    assert palette.rgb(np.array([1])).tolist() == [[1, 2, 3]]


def test_255_colours_and_black_are_exact_and_no_more():
    palette = Palette(grows=True)
    values = palette.nearest(np.concatenate((grey(255), rgb((0, 0, 0)))))
    assert sorted(values.tolist()) == list(range(256))
    assert (palette.rgb(values[:-1]) == grey(255)).all()
    (value,) = palette.nearest(rgb((100, 101, 100)))
    assert palette.rgb(np.array([value])).tolist() == [[100, 100, 100]]


def test_of_too_many_colours_those_spread_along_are_exact():
    ramp = np.stack([np.arange(600) % 256, np.arange(600) // 3, np.full(600, 77)], axis=1)
    palette = Palette(grows=True)
    shown = palette.rgb(palette.nearest(ramp.astype(np.uint8))).astype(int)
    apart = np.abs(shown - ramp).max(axis=1)
    assert (apart == 0).sum() == 255
    assert np.diff(np.flatnonzero(apart == 0)).max() <= 4
    assert apart.max() <= 60


def test_a_palette_that_was_given_does_not_grow():
    given = DEFAULT.copy()
    given[9] = (10, 20, 30)
    palette = Palette(given)
    assert palette.nearest(rgb((10, 20, 30), (11, 20, 30))).tolist() == [9, 9]
    assert (palette.colors == given).all()


def test_pixel_0_is_dark_whatever_its_entry_says():
    given = DEFAULT.copy()
    given[0] = (255, 255, 255)
    palette = Palette(given)
    assert palette.rgb(np.array([0])).tolist() == [[0, 0, 0]]
    assert palette.nearest(rgb((255, 255, 255), (0, 0, 0))).tolist() == [255, 0]


@pytest.mark.parametrize("colors", [np.zeros((256, 4), np.uint8), np.zeros((256, 3)), np.zeros(3)])
def test_what_is_no_palette(colors):
    with pytest.raises(ValueError, match=r"palette: it is a \(256, 3\) array"):
        Palette(colors)
    with pytest.raises(ValueError, match="has no palette"):
        Frame(GRID, "rgb888", palette=DEFAULT)


# -- COLORS


@pytest.mark.parametrize("most", [64, 200, 1024])
@pytest.mark.parametrize(
    "entries", [[], [0], [255], [1, 2, 4, 7, 8], list(range(256)), list(range(0, 256, 3))]
)
def test_entries_are_set_in_ops_that_fit(entries, most):
    palette = np.random.default_rng(1).integers(0, 256, (256, 3), dtype=np.uint8)
    config = EncoderConfig(Frame(GRID).grid, PixelFormat.INDEX8, most, 1 << spec.FEATURE_PALETTE)
    payloads = PayloadLayout(
        color_blocks(np.array(entries, dtype=int), palette, config), config
    ).payloads
    assert all(len(payload) <= most for payload in payloads)
    drawn = decode_plainly(payloads, GRID, PixelFormat.INDEX8).palette
    assert set(entries) <= set(drawn)
    assert all(tuple(palette[entry].tolist()) == color for entry, color in drawn.items())
    if entries == [1, 2, 4, 7, 8]:
        assert [payload[:3].hex() for payload in payloads] == ["060103"], (
            "one between costs no more"
        )


# -- frames


def test_the_colours_of_a_frame_are_exact_if_the_palette_is_its_own():
    frame = Frame(GRID, "index8", own_palette=True)
    assert frame.draw([(x, 1, 2) for x in range(17)], ["#123456", "#abcdef"]).exact_color
    assert frame.draw([(3, 4, 1)], "#808080").exact_color
    assert frame.has_own_palette
    shown = frame.rgb()
    assert shown.shape == (5, 9, 17, 3)
    assert shown[2, 1, 0].tolist() == [0x12, 0x34, 0x56]
    assert shown[2, 1, 16].tolist() == [0xAB, 0xCD, 0xEF]
    assert shown[1, 4, 3].tolist() == [0x80] * 3
    assert not shown[0].any()


def test_without_one_nothing_is_sent_of_it():
    frame = Frame(GRID, "index8")
    assert not frame.draw([(3, 4, 1)], "#808080").exact_color
    assert not frame.has_own_palette
    assert (frame.palette == DEFAULT).all()
    assert Frame(GRID).palette is None
    assert frame.rgb()[1, 4, 3].tolist() == DEFAULT[frame.array()[1, 4, 3]].tolist()


@pytest.mark.parametrize("format_", PixelFormat)
def test_what_is_seen_of_any_format(format_):
    frame = Frame(GRID, format_)
    frame.draw([(3, 4, 1)], "red")
    seen = frame.rgb()
    assert seen[1, 4, 3].tolist() == ([255] * 3 if format_.value == "mono1" else [255, 0, 0])
    seen[1, 4, 3] = 0
    assert not seen.any()


def test_raw_values_with_their_palette():
    """What `set` uses stays what it is; what is drawn besides takes other entries."""
    frame = Frame(GRID, "index8", own_palette=True)
    array = frame.array()
    array[0, 0, :8] = range(1, 9)
    frame.set(array)
    frame.draw([(3, 4, 1)], "#808080")
    assert frame.array()[1, 4, 3] == 9
    given = np.random.default_rng(1).integers(0, 256, (256, 3), dtype=np.uint8)
    frame = Frame(GRID, "index8", palette=given)
    frame.set(array)
    assert (frame.palette == given).all()
    assert (frame.rgb()[0, 0, :8] == given[1:9]).all()


def test_a_palette_is_sent_with_its_frame_and_counts_in_the_digest():
    frame = Frame(GRID, "index8", own_palette=True)
    frame.draw([(3, 4, 1)], "white")
    plain_digest = frame.digest()
    frame.draw([(4, 4, 1)], "#808080")
    (payload,) = frame.payloads(1024, {"palette", "oct"})
    drawn = decode_plainly([payload], GRID, PixelFormat.INDEX8)
    assert drawn.palette == {1: (0x80,) * 3}
    assert frame.digest() != plain_digest
    again = Frame(GRID, "index8", palette=frame.palette)
    again.set(frame.array())
    assert again.digest() == frame.digest()
    with pytest.raises(ValueError, match="palette of its own"):
        frame.payloads(1024, {"oct"})


def test_the_vector_of_a_palette_in_a_dialogue():
    """17.5: palette-of-a-page; its digests are those of frames."""
    colors = DEFAULT.copy()
    colors[2], colors[3] = (10, 11, 12), (13, 14, 15)
    frame = Frame((3, 5, 7), "index8", palette=colors)
    array = frame.array()
    array[0, 0, :2] = 3
    frame.set(array)
    assert frame.digest() == 0x3AD7AACE
    colors[2] = (0, 0, 0xAA)  # of the default palette
    array[6, 4, 2] = 255
    frame = Frame((3, 5, 7), "index8", palette=colors)
    frame.set(array)
    assert frame.digest() == 0xE879F869

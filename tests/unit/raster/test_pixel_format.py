"""Pixel formats (protocol.md, 2.1)."""

import itertools

import document
import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.raster.pixel_format import PixelFormat

FORMATS = pytest.mark.parametrize("format_", PixelFormat)
LEVELS = {"index8": (7, 7, 3), "rgb565": (31, 63, 31), "rgb888": (255, 255, 255)}


@FORMATS
def test_what_the_document_says_of_it(format_):
    assert format_.wire == document.literals()[f"FORMAT_{format_.name}"]
    assert format_.bytes == document.pixel_bytes()[format_.wire]
    assert PixelFormat.from_wire(format_.wire) is format_
    assert format_.full == {1: 1, 2: 0xFF, 3: 0xFFFF, 4: 0xFFFFFF}[format_.wire]


def test_an_unknown_number_is_none():
    assert PixelFormat.from_wire(9) is None


@pytest.mark.parametrize(
    ("format_", "rgb", "value"),
    [
        ("mono1", (0, 0, 0), 0),
        ("mono1", (0, 0, 1), 1),
        ("index8", (255, 0, 0), 0b111_000_00),
        ("index8", (0, 255, 0), 0b000_111_00),
        ("index8", (0, 0, 255), 0b000_000_11),
        ("rgb565", (255, 0, 0), 0xF800),
        ("rgb565", (0, 255, 0), 0x07E0),
        ("rgb565", (0, 0, 255), 0x001F),
        ("rgb888", (1, 2, 3), 0x030201),
    ],
)
def test_where_the_channels_lie(format_, rgb, value):
    assert PixelFormat(format_).nearest(np.array([rgb], dtype=np.uint8)).tolist() == [value]


@pytest.mark.parametrize("format_", [f for f in PixelFormat if f is not PixelFormat.MONO1])
def test_the_nearest_pixel_is_the_nearest(format_):
    """By trying all levels of each channel, and no other is nearer."""
    channel = np.arange(256)
    for axis, top in enumerate(LEVELS[format_.value]):
        rgb = np.zeros((256, 3), dtype=np.uint8)
        rgb[:, axis] = channel
        got = format_.rgb(format_.nearest(rgb))[:, axis].astype(float)
        exact = np.arange(top + 1) * 255 / top
        best = np.abs(channel[:, None] - exact).min(axis=1)
        assert (np.abs(got - channel) <= best + 0.5).all()
        assert not np.delete(format_.rgb(format_.nearest(rgb)), axis, axis=1).any()


@FORMATS
def test_what_a_pixel_shows_gives_the_pixel_again(format_):
    values = np.arange(min(format_.full + 1, 65536), dtype=np.uint32)
    assert (format_.nearest(format_.rgb(values)) == values).all()


@FORMATS
def test_values_and_pixels_are_each_others_inverse(format_):
    values = np.array([0, 1, format_.full, format_.full // 2], dtype=np.uint32)
    array = format_.pixels(values)
    assert array.dtype == format_.dtype
    assert array.shape == format_.shape((4,))
    assert format_.values(array).tolist() == values.tolist()


@FORMATS
def test_an_array_of_another_shape_or_type_is_refused(format_):
    shape = format_.shape((7, 5, 3))
    format_.validate(np.zeros(shape, dtype=format_.dtype), (7, 5, 3))
    for wrong in itertools.permutations((7, 5, 3)):
        if wrong != (7, 5, 3):
            with pytest.raises(ValueError, match=r"\[z, y, x\]"):
                format_.validate(np.zeros(format_.shape(wrong), dtype=format_.dtype), (7, 5, 3))
    for dtype in (bool, np.int64, np.uint32):
        with pytest.raises(
            ValueError, match=f"convert it with array.astype.'{format_.dtype.__name__}'"
        ):
            format_.validate(np.ones(shape, dtype=dtype), (7, 5, 3))


@FORMATS
@pytest.mark.parametrize("array", [0.5, -1, 1 << 16], ids=["fractions", "negative", "too large"])
def test_values_that_a_cast_would_spoil_are_not_advised_to_be_cast(format_, array):
    """0..1 cast to uint8 is black."""
    with pytest.raises(ValueError, match=f"frame is {format_.dtype.__name__}") as caught:
        format_.validate(np.full(format_.shape((7, 5, 3)), array), (7, 5, 3))
    assert "convert it with" not in str(caught.value)
    word = "threshold" if format_ is PixelFormat.MONO1 else "volume_pixels"
    assert word in str(caught.value)


def test_mono1_has_only_0_and_1():
    """2.1: "00 dark, 01 lit; no other value"."""
    array = np.zeros((7, 5, 3), dtype=np.uint8)
    array[1, 2, 0] = 2
    with pytest.raises(ValueError, match="only 0 and 1"):
        PixelFormat.MONO1.validate(array, (7, 5, 3))


def test_no_array_is_a_format():
    for value in (np.zeros(3), [1], {"mono1"}, 5, (np.zeros(3),)):
        with pytest.raises(ValueError, match="expected one of mono1, index8, rgb565, rgb888"):
            PixelFormat(value)
    assert PixelFormat(np.str_("mono1")) is PixelFormat.MONO1


@FORMATS
def test_lists_of_numbers_that_fit_are_pixels(format_):
    frame = vd.Frame((3, 5, 7), format_)
    top = np.iinfo(format_.dtype).max if format_ is not PixelFormat.MONO1 else 1
    picture = np.zeros(format_.shape((7, 5, 3)), dtype=int)
    picture[6, 0, 2] = top
    frame.set(picture.tolist())
    assert frame.array().dtype == format_.dtype
    assert (frame.array() == picture).all()
    frame.set(tuple(map(tuple, (picture > 0).tolist())))
    assert (frame.array() == (picture > 0)).all()
    for wrong in (top + 1, -1, 0.5, 1 << 70):
        spoilt = picture.tolist()
        if format_ is PixelFormat.RGB888:
            spoilt[0][0][0][1] = wrong
        else:
            spoilt[0][0][0] = wrong
        with pytest.raises(ValueError, match="the array is"):
            frame.set(spoilt)
    with pytest.raises(ValueError, match="convert it"):
        frame.set(picture)  # whoever chose a type is told that it is another

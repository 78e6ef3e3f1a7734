"""Pixels of volumes: window, threshold, colour map, labels, and the edges of all types."""

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.raster.color_map import color_map

RAMP = np.arange(105, dtype=np.float64).reshape(7, 5, 3)


def test_the_window_spans_the_map():
    pixels = vd.volume_pixels(RAMP, window=(0, 104), map="magma")
    assert pixels.shape == (7, 5, 3, 3)
    assert pixels.dtype == np.uint8
    entries = np.floor(RAMP / 104 * 255 + 0.5).astype(int)
    expected = color_map("magma")[entries]
    expected[0, 0, 0] = 0  # at the low end: dark
    assert np.array_equal(pixels, expected)


@pytest.mark.parametrize("format_", ["mono1", "index8", "rgb565", "rgb888"])
def test_a_frame_of_each_format_takes_them(format_):
    frame = vd.Frame((3, 5, 7), format_)
    frame.set(vd.volume_pixels(RAMP, format=format_, threshold=50, map="viridis"))
    assert len(frame.lit()[0]) == 55


def test_mono_lights_the_upper_half_of_the_window():
    pixels = vd.volume_pixels(RAMP, format="mono1", window=(0, 100))
    assert np.array_equal(pixels, RAMP >= 50)


def test_what_is_lit_stays_so_in_a_map_that_begins_in_black():
    pixels = vd.volume_pixels(RAMP, window=(0, 1e6))
    assert pixels.any(axis=-1).sum() == 104
    assert not vd.volume_pixels(RAMP, window=(0, 1e6), threshold=105).any()


def test_values_beyond_the_window_take_its_ends():
    pixels = vd.volume_pixels(RAMP, window=(10, 20), map="viridis", threshold=0)
    ends = color_map("viridis")[[0, 255]]
    assert np.array_equal(pixels[0, 0, 0], ends[0])
    assert np.array_equal(pixels[-1, -1, -1], ends[1])


def test_numbers_that_are_not_finite_are_dark():
    values = RAMP.copy()
    values[0, 0], values[3, 3, 1], values[6] = np.nan, np.inf, -np.inf
    pixels = vd.volume_pixels(values, threshold=-1e30, map="viridis")
    assert np.array_equal(pixels.any(axis=-1), np.isfinite(values))


@pytest.mark.parametrize(
    "kind", ["b1", "i1", "u1", "<i2", ">i2", "<u2", ">u4", "i8", "u8", "f2", "f4", ">f8"]
)
def test_every_type_of_number_gives_the_same_pixels(kind):
    values = (RAMP % 2).astype(kind)
    assert np.array_equal(
        vd.volume_pixels(values, window=(0, 1)), vd.volume_pixels(RAMP % 2, window=(0, 1))
    )


@pytest.mark.parametrize("kind", ["i1", "u1", "i8", "u8", "f4", "f8"])
def test_the_widest_window_of_a_type_is_no_overflow(kind):
    limits = np.iinfo(kind) if kind[0] in "iu" else np.finfo(kind)
    values = np.full((3, 5, 7), limits.min, dtype=kind)
    values[1], values[2] = 0, limits.max
    pixels = vd.volume_pixels(values, window=(float(limits.min), float(limits.max)))
    assert not pixels[0].any()
    assert (pixels[2] == 255).all()


def test_the_default_window_is_from_the_first_to_the_last_percentile():
    values = np.arange(10_000, dtype=np.int32).reshape(10, 100, 10)
    values[-1, -1, -1] = 10**9
    pixels = vd.volume_pixels(values)
    low, high = np.percentile(values, (1, 99))
    assert np.array_equal(pixels, vd.volume_pixels(values, window=(low, high)))


def test_a_small_object_before_nothing_is_seen_by_default():
    values = np.zeros((30, 30, 30))
    values[4, 5, 6] = 3
    assert vd.volume_pixels(values)[4, 5, 6].tolist() == [255, 255, 255]
    assert vd.volume_pixels(values).any(axis=-1).sum() == 1


@pytest.mark.parametrize(("level", "lit"), [(0, 0), (5, 105), (-5, 105)])
def test_an_even_volume_is_dark_only_where_it_is_zero(level, lit):
    assert vd.volume_pixels(np.full((7, 5, 3), level)).any(axis=-1).sum() == lit


def test_fitting_keeps_proportions_and_leaves_the_margin_dark():
    pixels = vd.volume_pixels(np.ones((4, 8, 8)), grid=(3, 5, 7), spacing=(1, 1, 2), format="mono1")
    lit = np.argwhere(pixels)
    assert (lit.max(axis=0) - lit.min(axis=0) + 1).tolist() == [3, 3, 3]
    assert lit.min(axis=0).tolist() == [2, 1, 0]


def test_labels_are_not_mixed():
    labels = np.zeros((6, 10, 14), dtype=np.uint8)
    labels[:, :, 5:], labels[:, 5:, 5:] = 2, 7
    mixed = vd.volume_pixels(labels, grid=(7, 5, 3), window=(0, 7))
    clean = vd.volume_pixels(labels, grid=(7, 5, 3), labels=True)
    assert len(np.unique(clean)) == 3
    assert len(np.unique(mixed)) > 3
    colors = color_map("gray")[[73, 255]]
    assert {tuple(each) for each in clean.reshape(-1, 3)} == {(0, 0, 0), *map(tuple, colors)}


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"array": "text"}, TypeError, "indexed"),
        ({"array": np.zeros((3, 5))}, ValueError, "three axes"),
        ({"array": np.zeros((3, 0, 5))}, ValueError, "3 x 0 x 5"),
        ({"array": np.zeros((3, 5, 7), dtype=complex)}, ValueError, "complex128"),
        ({"array": np.zeros((3, 5, 7), dtype="datetime64[s]")}, ValueError, "datetime"),
        ({"window": (5, 5)}, ValueError, "lower"),
        ({"window": (9, 5)}, ValueError, "lower"),
        ({"window": (0, np.inf)}, ValueError, "lower"),
        ({"window": 5}, TypeError, "window"),
        ({"threshold": "high"}, TypeError, "threshold"),
        ({"threshold": np.nan}, ValueError, "threshold"),
        ({"map": "nosuch" * 20}, (ValueError, vd.MissingExtra), "colour map"),
        ({"grid": (3, 5)}, TypeError, "grid"),
        ({"spacing": (1, 1, 2)}, ValueError, "grid"),
        ({"grid": (3, 5, 7), "spacing": (1, 0, 2)}, ValueError, "above 0"),
        ({"grid": (3, 5, 7), "spacing": (1, 1e9, 2)}, ValueError, "different"),
        ({"format": "rgb"}, ValueError, "format"),
        ({"labels": np.zeros(2)}, TypeError, "labels"),
    ],
)
def test_wrong_arguments_are_named(arguments, error, words):
    with pytest.raises(error, match=words):
        vd.volume_pixels(**{"array": RAMP, **arguments})


def test_a_frame_names_what_makes_pixels_of_numbers():
    for array in (RAMP, RAMP[:2], np.ones((7, 5, 3, 3))):
        with pytest.raises(ValueError, match="volume_pixels"):
            vd.Frame((3, 5, 7)).set(array)

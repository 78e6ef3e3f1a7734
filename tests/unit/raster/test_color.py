"""Parsing of colours."""

from __future__ import annotations

import numpy as np
import pytest

from voxdisplay.raster.color import NAMED, as_colors, parse_color


@pytest.mark.parametrize(
    ("text", "color"),
    [
        ("#ff8800", (255, 136, 0)),
        ("#F80", (255, 136, 0)),
        ("#123", (0x11, 0x22, 0x33)),
        ("#123456", (0x12, 0x34, 0x56)),
        ("orange", (255, 165, 0)),
        (" RebeccaPurple ", (0x66, 0x33, 0x99)),
        ("black", (0, 0, 0)),
        ("white", (255, 255, 255)),
    ],
)
def test_colors(text: str, color: tuple[int, int, int]) -> None:
    assert parse_color(text) == color


def test_css_has_148_names_and_each_is_a_color() -> None:
    assert len(NAMED) == 148
    assert as_colors(list(NAMED)).shape == (148, 3)
    # Seven colours have two names.
    assert len({parse_color(name) for name in NAMED}) == 139
    for name in NAMED:
        assert parse_color(name.replace("grey", "gray")) == parse_color(name)


@pytest.mark.parametrize("text", ["#", "#1", "#12", "#1234", "#12345", "#1234567", "#ggg", "", "0"])
def test_what_is_no_color(text: str) -> None:
    with pytest.raises(ValueError, match=r"unknown colour .*CSS colour name, #rgb or #rrggbb"):
        parse_color(text)


def test_the_nearest_name_is_named() -> None:
    with pytest.raises(ValueError, match="'orang': did you mean 'orange'"):
        parse_color("orang")


def test_a_long_text_is_not_repeated() -> None:
    with pytest.raises(ValueError, match="unknown colour") as caught:
        parse_color("\ud800" * 100_000)
    str(caught.value).encode()
    assert len(str(caught.value)) < 200


def test_one_color_and_several() -> None:
    np.testing.assert_array_equal(as_colors("red"), [[255, 0, 0]])
    colors = as_colors(["red", "#010203"])
    np.testing.assert_array_equal(colors, [[255, 0, 0], [1, 2, 3]])
    assert colors.dtype == np.uint8
    with pytest.raises(ValueError, match="at least one"):
        as_colors([])


@pytest.mark.parametrize(
    ("color", "rows"),
    [
        ((255, 128, 0), [[255, 128, 0]]),
        ([255, 128, 0], [[255, 128, 0]]),
        (np.array([255, 128, 0]), [[255, 128, 0]]),
        (tuple(np.uint8([1, 2, 3])), [[1, 2, 3]]),
        ([(255, 0, 0), "lime", [0, 0, 255], np.array([1, 2, 3])],
         [[255, 0, 0], [0, 255, 0], [0, 0, 255], [1, 2, 3]]),
        (np.array(["red", "lime"]), [[255, 0, 0], [0, 255, 0]]),
        (((1, 2, 3), (4, 5, 6)), [[1, 2, 3], [4, 5, 6]]),
        (np.array([[1, 2, 3], [4, 5, 6]]), [[1, 2, 3], [4, 5, 6]]),
    ],
)  # fmt: skip
def test_triples(color: object, rows: list[list[int]]) -> None:
    colors = as_colors(color)
    assert colors.dtype == np.uint8
    assert colors.tolist() == rows


@pytest.mark.parametrize(
    ("color", "message"),
    [
        ((255, 128), "three whole numbers, 0 to 255"),
        ((255, 128, 0, 1), "three whole numbers, 0 to 255"),
        ((256, 0, 0), "0 to 255; here they are 0 to 256"),
        ((0, -1, 0), "0 to 255; here they are -1 to 0"),
        ((1.0, 0.5, 0.0), "multiply 0..1 by 255"),
        ((True, False, True), "whole numbers"),
        ((1 << 70, 0, 0), "whole numbers"),
        ([(1, 2, 3), (1, 2)], "three whole numbers"),
        ([("red", 2, 3)], "three whole numbers"),
        (["red", "nocolour"], "unknown colour 'nocolour'"),
        (np.zeros((2, 4), int), r"\(k, 3\) array"),
        (np.zeros((0, 3), int), r"\(k, 3\) array"),
        (np.array(["red", "a"]), "unknown colour 'a'"),
        (np.array([["red", "a", "b"]]), "whole numbers"),
        ((), "at least one"),
    ],
)
def test_what_is_no_triple(color: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        as_colors(color)


@pytest.mark.parametrize(
    "color",
    [None, 7, 1.5, b"red", {"red": 1}, {1, 2, 3}, object(), ["red", 3], [None], [b"red"]],
)
def test_what_is_of_another_kind(color: object) -> None:
    with pytest.raises(TypeError, match=r"colou?r"):
        as_colors(color)

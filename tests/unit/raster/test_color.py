"""Parsing of colours."""

from __future__ import annotations

import colorsys

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


@pytest.mark.parametrize(
    ("text", "color"),
    [
        ("rgb(255, 136, 0)", (255, 136, 0)),
        ("RGB(255 136 0)", (255, 136, 0)),
        (" rgb( 100%  53.333%  0% ) ", (255, 136, 0)),
        ("rgb(300 -5 127.5)", (255, 0, 128)),
        ("rgb(50% 128 none)", (128, 128, 0)),
        ("rgb(1e2 .5 +0.4)", (100, 1, 0)),
        ("rgba(1, 2, 3, 1)", (1, 2, 3)),
        ("rgb(1 2 3 / 100%)", (1, 2, 3)),
        ("hsl(32, 100%, 50%)", (255, 136, 0)),
        ("hsl(0 100% 50%)", (255, 0, 0)),
        ("hsl(120deg 100% 25%)", (0, 128, 0)),
        ("hsl(0.5turn 100 50)", (0, 255, 255)),
        ("hsl(-120 100% 50%)", (0, 0, 255)),
        ("hsl(200grad 100% 50%)", (0, 255, 255)),
        ("hsl(3.14159265rad 100% 50%)", (0, 255, 255)),
        ("hsl(39 100% 50% / 1)", (255, 166, 0)),
        ("hsla(720, 0%, 50%, 100%)", (128, 128, 128)),
        ("hsl(none 200% 150%)", (255, 255, 255)),
        ("hsl(270 50% 40%)", (102, 51, 153)),
    ],
)
def test_functions_are_those_of_css(text: str, color: tuple[int, int, int]) -> None:
    assert parse_color(text) == color


def test_hsl_is_colorsys_on_a_grid() -> None:
    for hue in range(0, 360, 15):
        for saturation in range(0, 101, 20):
            for lightness in range(0, 101, 20):
                found = parse_color(f"hsl({hue} {saturation}% {lightness}%)")
                wanted = colorsys.hls_to_rgb(hue / 360, lightness / 100, saturation / 100)
                assert all(
                    abs(each - 255 * share) <= 0.5 + 1e-6
                    for each, share in zip(found, wanted, strict=True)
                )


@pytest.mark.parametrize(
    "text",
    [
        "rgb()", "rgb(1 2)", "rgb(1 2 3 4)", "rgb(1, 2, 3, 4, 5)", "rgb(1, 2%, 3)", "rgb(1,2 3)",
        "rgb(1 2 3", "rgb(1deg 2 3)", "rgb(a b c)", "rgb(1. 2 3)", "rgb(none, 2, 3)",
        "rgb(1 2 3 / 1 / 1)", "rgb(1e999 2 3)", "rgb(1 2 3 / 1px)", "rgb(" + "1" * 300 + " 2 3)",
        "rgb(1 2 3) 4", "hsl(1, 2, 3)", "hsl(1% 2% 3%)", "hsl(1px 2% 3%)", "hsl(1 2deg 3%)",
    ],
)  # fmt: skip
def test_wrong_functions_show_the_right_form(text: str) -> None:
    with pytest.raises(ValueError, match=r"the colour function (rgb|hsl)\(\) is written like"):
        parse_color(text)


@pytest.mark.parametrize("text", ["rgb(1 2 3 / 0.5)", "hsla(1, 2%, 3%, 50%)"])
def test_voxels_are_not_transparent(text: str) -> None:
    with pytest.raises(ValueError, match="leave the colour's alpha out"):
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

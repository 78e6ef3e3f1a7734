"""Half-block text, decoded as a terminal does."""

import itertools
import re

import numpy as np
import pytest

from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.view.axes_and_grid import BACKGROUND, outline_axes
from voxdisplay.view.half_blocks import (
    CAMERA,
    RESET,
    _color_codes,
    half_blocks,
    has_true_color,
)
from voxdisplay.view.lit_voxels import lit_voxels
from voxdisplay.view.picture import RenderOptions, render_voxels

GRID = Grid(3, 5, 7)
COLUMNS, ROWS = 60, 20
CELL = re.compile(r"\x1b\[([\d;]*)m|(.)")


def screen(lines):
    """Return the screen of a terminal: characters, and colours above and below of each cell."""
    characters, pixels = [], np.zeros((2 * len(lines), COLUMNS), dtype=object)
    for row, line in enumerate(lines):
        front = back = None
        text = ""
        for code, character in CELL.findall(line):
            if code.startswith("38;"):
                front = code[3:]
            elif code.startswith("48;"):
                back = code[3:]
            elif not character:
                front = back = None
            else:
                above = front if character == "\N{UPPER HALF BLOCK}" else back
                pixels[2 * row, len(text)], pixels[2 * row + 1, len(text)] = above, back
                text += character
        assert len(text) == COLUMNS
        characters.append(text)
    return characters, pixels


def lit(*voxels):
    array = np.zeros((*GRID.array_shape, 3), np.uint8)
    for x, y, z in voxels:
        array[z, y, x] = (255, 200, 40)
    return lit_voxels(array, GRID, PixelFormat.RGB888)


def test_a_voxel_is_in_the_cell_that_the_camera_names():
    _, with_voxel = screen(half_blocks(lit((2, 4, 6)), GRID, COLUMNS, ROWS))
    _, without = screen(half_blocks(lit(), GRID, COLUMNS, ROWS))
    (x,), (y,), _ = CAMERA.project([[2.5, 4.5, 6.5]], GRID, (COLUMNS, 2 * ROWS))
    assert with_voxel[int(y), int(x)] != without[int(y), int(x)]
    red, green, blue = map(int, with_voxel[int(y), int(x)].split(";")[1:])
    assert red > 180
    assert red >= green > blue


def test_it_is_the_picture_two_rows_a_line():
    voxels = lit((2, 4, 6), (0, 0, 0))
    characters, pixels = screen(half_blocks(voxels, GRID, COLUMNS, ROWS))
    look = RenderOptions(size=(2 * COLUMNS, 4 * ROWS), camera=CAMERA, labels=False, floor=False)
    meant = np.asarray(render_voxels(voxels, GRID, look).reduce(2))
    for row, column in np.ndindex(2 * ROWS, COLUMNS):
        if characters[row // 2][column] not in "xyz":
            assert pixels[row, column] == "2;{};{};{}".format(*meant[row, column])


def test_the_axes_have_their_names():
    characters, _ = screen(half_blocks(lit(), GRID, COLUMNS, ROWS))
    text = "".join(characters)
    assert [text.count(name) for name in "xyz"] == [1, 1, 1]
    place = {name: np.array(divmod(text.index(name), COLUMNS)) for name in "xyz"}
    for axis in outline_axes(GRID, CAMERA, (COLUMNS, 2 * ROWS)):
        row, column = place["xyz"[axis.number]]
        x, y = axis.middle
        outward = (column + 0.5 - x) * axis.outward[0] + (2 * row + 1 - y) * axis.outward[1]
        assert 0.5 < outward < 4, "a name is outside of the box, beside its axis"


def test_lines_end_without_colour_and_say_nothing_twice():
    for line in half_blocks(lit((1, 1, 1)), GRID, COLUMNS, ROWS):
        assert line.endswith(RESET)
        codes = re.findall(r"\x1b\[(48;[\d;]*)m", line)
        assert all(one != other for one, other in itertools.pairwise(codes))


def test_256_colours():
    _, pixels = screen(half_blocks(lit((2, 4, 6)), GRID, COLUMNS, ROWS, full=False))
    found = {int(re.fullmatch(r"5;(\d+)", code)[1]) for code in pixels.ravel().tolist()}
    assert found <= set(range(16, 256))
    assert len(found) > 10
    assert pixels[0, 0] == "5;232", f"the darkest grey is nearest to the ground, {BACKGROUND}"


def test_256_colours_have_no_stains():
    """Without a halo, what is far from voxels and the box is ground."""
    _, pixels = screen(half_blocks(lit((1, 2, 3)), GRID, COLUMNS, ROWS, full=False))
    assert (pixels == "5;232").mean() > 0.8


@pytest.mark.parametrize(("color", "code"), [
    ((200, 60, 60), 167), ((60, 70, 200), 62), ((128, 128, 128), 244), ((255, 200, 40), 178),
])  # fmt: skip
def test_256_colours_keep_their_hue(color, code):
    assert _color_codes(np.array([[color]], np.uint8), full=False) == [[f"5;{code}"]]


@pytest.mark.parametrize(("said", "full"), [("truecolor", True), ("24bit", True), ("", False)])
def test_what_the_terminal_says_of_its_colours(said, full):
    assert has_true_color({"COLORTERM": said}) is full
    assert has_true_color({}) is False


@pytest.mark.parametrize(("columns", "rows"), [(8, 8), (200, 3), (9, 60)])
def test_any_window(columns, rows):
    lines = half_blocks(lit((0, 0, 0)), GRID, columns, rows)
    assert len(lines) == rows
    assert {len(re.sub(r"\x1b\[[\d;]*m", "", line)) for line in lines} == {columns}

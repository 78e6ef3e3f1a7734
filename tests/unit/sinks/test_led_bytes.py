"""Wiring, colour order, gamma and white balance."""

import itertools

import numpy as np
import pytest

from voxdisplay.raster.grid import Grid
from voxdisplay.sinks.led_bytes import LedBytes, value_table, wiring_order
from voxdisplay.sinks.settings import WIRINGS, SinkSettings

SIZE = Grid(2, 3, 4)


def places(**settings):
    """Voxels along the wire as texts of x, y, z."""
    grid = settings.pop("size", SIZE)
    order = wiring_order(SinkSettings(grid, **settings))
    nx, ny, _ = grid
    return [f"{i % nx}{i // nx % ny}{i // (nx * ny)}" for i in order.tolist()]


def test_straight_rows_run_the_same_way():
    assert places()[:8] == ["000", "100", "010", "110", "020", "120", "001", "101"]


def test_serpentine_rows_run_back():
    found = places(wiring="serpentine")
    assert found[:6] == ["000", "100", "110", "010", "020", "120"]
    assert found[6:12] == ["001", "101", "111", "011", "021", "121"], "panels begin alike"


def test_a_continuous_wire_goes_on_where_the_panel_before_ended():
    found = places(wiring="continuous")
    assert found[:6] == ["000", "100", "110", "010", "020", "120"]
    assert found[6:12] == ["121", "021", "011", "111", "101", "001"]


def test_panels_along_other_axes():
    # Rows along z, from row to row along x, from panel to panel along y.
    found = places(panels="zxy")
    assert found[:9] == ["000", "001", "002", "003", "100", "101", "102", "103", "010"]


def test_the_wire_begins_in_a_corner():
    assert places(start=(1, 0, 1))[:3] == ["103", "003", "113"]


@pytest.mark.parametrize("wiring", WIRINGS)
def test_every_voxel_has_one_led_whatever_the_wiring(wiring):
    for panels in map("".join, itertools.permutations("xyz")):
        for start in itertools.product((0, 1), repeat=3):
            found = places(size=Grid(3, 5, 7), wiring=wiring, panels=panels, start=start)
            assert len(set(found)) == 105
            corner = [side - 1 if far else 0 for side, far in zip((3, 5, 7), start, strict=True)]
            assert found[0] == "".join(map(str, corner))


def test_neighbours_on_a_continuous_wire_are_neighbours_in_the_cube():
    for panels in map("".join, itertools.permutations("xyz")):
        found = places(size=Grid(3, 5, 7), wiring="continuous", panels=panels, start=(1, 0, 1))
        for one, other in itertools.pairwise(found):
            steps = [abs(int(a) - int(b)) for a, b in zip(one, other, strict=True)]
            assert sum(steps) == 1


def picture(grid, seed=1):
    shape = (*grid.array_shape, 3)
    return np.random.default_rng(seed).integers(0, 256, shape, dtype=np.uint8)


def test_bytes_follow_wire_and_color_order():
    settings = SinkSettings(
        Grid(3, 5, 7), wiring="serpentine", panels="yzx", start=(0, 1, 0), order="grb"
    )
    rgb = picture(settings.size)
    expected = []
    for x in range(3):
        for z in range(7):
            ys = range(5) if z % 2 else range(4, -1, -1)
            for y in ys:
                red, green, blue = rgb[z, y, x].tolist()
                expected += [green, red, blue]
    assert LedBytes(settings).convert(rgb).tolist() == expected


def test_gamma_and_white():
    settings = SinkSettings(Grid(3, 5, 7), order="bgr", gamma=2.2, white=(1.0, 0.5, 0.0))
    rgb = picture(settings.size)
    found = LedBytes(settings).convert(rgb).reshape(-1, 3).tolist()
    for led, voxel in zip(found, rgb.reshape(-1, 3).tolist(), strict=True):
        red, green, _ = (255 * (value / 255) ** 2.2 for value in voxel)
        assert led == [0, round(green / 2), round(red)]


def test_the_ends_of_a_table():
    assert value_table(1, 1).tolist() == list(range(256))
    table = value_table(2.8, 0.5)
    assert (table[0], table[255]) == (0, 128)
    assert (np.diff(table.astype(int)) >= 0).all()


def test_white_takes_what_the_others_share():
    settings = SinkSettings(Grid(1, 1, 2), order="gwrb")
    rgb = np.array([[[[9, 5, 7]]], [[[0, 255, 255]]]], dtype=np.uint8)
    assert LedBytes(settings).convert(rgb).tolist() == [0, 5, 4, 2, 255, 0, 0, 255]


def test_gamma_of_all_colours_alike():
    settings = SinkSettings(Grid(1, 1, 1), gamma=2)
    rgb = np.array([[[[255, 128, 64]]]], dtype=np.uint8)
    assert LedBytes(settings).convert(rgb).tolist() == [255, 64, 16]

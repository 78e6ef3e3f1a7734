"""Settings from URLs and from tables of TOML files."""

import tomllib

import pytest

import voxdisplay as vd
from voxdisplay.raster.grid import Grid
from voxdisplay.sinks.opening import open_ddp
from voxdisplay.sinks.settings import LAYOUT_KEYS, SinkSettings

ALL = (
    *LAYOUT_KEYS, "universe", "pixels", "address", "channel", "offset", "priority", "hold", "sync",
    "broadcast",
)  # fmt: skip


def settings(**values):
    return SinkSettings.from_mapping({"size": "3x5x7", **values}, ALL)


def test_a_url_and_a_toml_table_mean_the_same():
    texts = {
        "size": "3x5x7", "wiring": "serpentine", "panels": "yxz", "start": "0,1,0",
        "order": "GRB", "gamma": "2.2", "white": "1,0.9,0.75", "fps": "30", "universe": "2-4,9",
        "pixels": "16", "address": "5", "channel": "3", "offset": "7", "priority": "150",
        "hold": "2", "sync": "no", "broadcast": "yes",
    }  # fmt: skip
    table = tomllib.loads(
        """
        size = [3, 5, 7]
        wiring = "serpentine"
        panels = "yxz"
        start = [0, 1, 0]
        order = "grb"
        gamma = 2.2
        white = [1, 0.9, 0.75]
        fps = 30
        universe = ["2-4", 9]
        pixels = 16
        address = 5
        channel = 3
        offset = 7
        priority = 150
        hold = 2
        sync = false
        broadcast = true
        """
    )
    expected = SinkSettings(
        Grid(3, 5, 7), "serpentine", "yxz", (0, 1, 0), "grb", 2.2, (1.0, 0.9, 0.75), 30.0,
        (2, 3, 4, 9), 16, 5, 3, 7, 150, 2, sync=False, broadcast=True,
    )  # fmt: skip
    assert SinkSettings.from_mapping(texts, ALL) == expected
    assert SinkSettings.from_mapping(table, ALL) == expected


def test_defaults():
    assert settings() == SinkSettings(Grid(3, 5, 7))
    assert settings(universe=7).universe == (7,)


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ({"wirring": "straight"}, "unknown key 'wirring'; did you mean 'wiring'"),
        ({"colour": "grb"}, "unknown key 'colour'; there are address, "),
        ({"size": "3x5"}, "not a size"),
        ({"size": [3, 5]}, "three whole numbers"),
        ({"size": 3}, "three whole numbers"),
        ({"size": "129x128x128"}, "more than 2097152 LEDs"),
        ({"wiring": "zigzag"}, "expected one of straight, serpentine, continuous"),
        ({"wiring": 1}, "expected a text"),
        ({"panels": "xxz"}, "each once"),
        ({"start": "0,1"}, "three numbers"),
        ({"start": "0,1,2"}, "from 0 to 1, found 2"),
        ({"start": True}, "three numbers"),
        ({"order": "rgg"}, "a permutation of rgb"),
        ({"gamma": "nan"}, "from 0.1 to 10"),
        ({"gamma": True}, "from 0.1 to 10"),
        ({"gamma": "1e400"}, "from 0.1 to 10"),
        ({"white": "1,1,1.5"}, "from 0 to 1"),
        ({"white": "ffffff"}, "three numbers"),
        ({"fps": "0"}, "from 0.1 to 60"),
        ({"fps": None}, "from 0.1 to 60"),
        ({"universe": "5-2"}, "runs backwards"),
        ({"universe": "1,2-4,3"}, "universe 3 is named twice"),
        ({"universe": "x"}, "a whole number"),
        ({"universe": ""}, "a whole number"),
        ({"universe": "0-63999,0-63999"}, "more than 63999 universes"),
        ({"universe": 64_000}, "from 0 to 63999"),
        ({"universe": True}, "a whole number"),
        ({"pixels": "0"}, "from 1 to 21845"),
        ({"address": "513"}, "from 1 to 512"),
        ({"address": "1.5"}, "a whole number"),
        ({"hold": "-1"}, "a whole number"),
        ({"sync": "maybe"}, "expected yes or no"),
        ({"broadcast": 1}, "expected yes or no"),
    ],
)
def test_wrong_values_name_the_key_and_what_is_wanted(values, complaint):
    with pytest.raises(ValueError, match=complaint):
        settings(**values)


def test_the_size_cannot_be_left_out():
    with pytest.raises(ValueError, match="size=16x16x16"):
        SinkSettings.from_mapping({}, ALL)


def test_keys_of_other_sinks_are_unknown():
    with pytest.raises(ValueError, match="unknown key 'hold'"):
        SinkSettings.from_mapping({"size": "3x5x7", "hold": "2"}, LAYOUT_KEYS)


def test_keys_of_a_name_win_over_those_of_a_profile():
    keys = {"size": [3, 5, 7], "order": "grb", "pixels": 16, "fps": 30}
    sink = open_ddp(
        "ddp://127.0.0.1?size=7x5x3",
        timeout_s=2.0,
        baud=115_200,
        reset=True,
        keys={key: keys[key] for key in ("size", "order", "fps")},
    )
    assert (sink.grid, sink.max_fps) == (Grid(7, 5, 3), 30.0)
    sink.close()
    with pytest.raises(vd.OpenError, match="unknown key 'pixels'"):
        open_ddp("ddp://127.0.0.1", timeout_s=2.0, keys=keys)

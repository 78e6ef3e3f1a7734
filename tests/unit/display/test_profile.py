"""Display profiles: keys and their errors, files, and folders."""

import pytest

import voxdisplay as vd
from voxdisplay.display.profile import DisplayProfile, read_profile, with_keys
from voxdisplay.display.profile_files import (
    as_profile,
    load_profile,
    profile_folder,
    profile_keys,
    profile_names,
    profile_path,
    save_profile,
)
from voxdisplay.raster.light import CurrentLimit
from voxdisplay.raster.orientation import Orientation

DESK = """
port = "/dev/ttyUSB0"      # or usb:VID:PID:SERIAL
serial = "A1"
axes = ["x", "-z", "y"]
pitch_mm = [5.0, 5.0, 8.0]
brightness = 0.6
limit = {amps = 8.0, ma_per_channel = 20}
dither = "ordered"
fit = "content"
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    found = tmp_path / "voxdisplay" / "displays"
    found.mkdir(parents=True)
    return found


def test_all_keys_of_a_file(folder):
    (folder / "desk.toml").write_text(DESK)
    profile = load_profile("desk")
    assert profile == DisplayProfile(
        port="/dev/ttyUSB0",
        serial="A1",
        axes=Orientation.of("x,-z,y"),
        pitch_mm=(5, 5, 8),
        brightness=0.6,
        limit=CurrentLimit(8, 20),
        dither="ordered",
        fit="content",
    )
    assert profile.source == str(folder / "desk.toml")
    assert load_profile(str(folder / "desk.toml")) == profile
    assert as_profile(folder / "desk.toml") == as_profile(profile) == profile


def test_an_empty_profile_leaves_all_as_it_is():
    assert read_profile({}) == DisplayProfile()
    assert DisplayProfile().output is None
    assert read_profile({"pitch_mm": [3, 3, 3], "brightness": 1, "dither": "none"}).output is None
    assert read_profile({"axes": "x,y,-z"}).output is not None


@pytest.mark.parametrize(
    ("keys", "message", "hint"),
    [
        ({"brightnes": 1}, "unknown key 'brightnes'", "did you mean 'brightness'?"),
        ({"axis": []}, "unknown key 'axis'", "did you mean 'axes'?"),
        ({"q": 1}, "unknown key 'q'", "known keys are port, serial, axes"),
        ({"axes": ["x", "x", "z"]}, "axes: x is named twice, and y is missing", None),
        ({"axes": 5}, "axes", None),
        ({"brightness": 2}, "brightness: expected 0 to 1, found 2", None),
        ({"brightness": float("nan")}, "brightness: expected 0 to 1, found nan", None),
        ({"brightness": "half"}, "brightness", None),
        ({"pitch_mm": [5, 5]}, "pitch_mm", None),
        ({"pitch_mm": [5, 5, 0]}, "pitch_mm", None),
        ({"pitch_mm": [5, 5, 1e9]}, "pitch_mm: no display", None),
        ({"limit": 8}, "limit: expected a table|limit is", None),
        ({"limit": {"amps": 8}}, "limit: ma_per_channel is missing", None),
        ({"limit": {"amp": 8}}, "limit: unknown key 'amp'", "did you mean 'amps'?"),
        ({"limit": {"amps": -8, "ma_per_channel": 20}}, "limit.amps", None),
        ({"dither": "random"}, "dither: expected one of 'none', 'ordered', found 'random'", None),
        ({"fit": True}, "fit", None),
        ({"port": 5}, "port: expected a text, found 5", None),
        ({"serial": ""}, "serial: expected a text", None),
    ],
)
def test_wrong_keys_are_named_with_the_file(keys, message, hint):
    with pytest.raises(vd.ProfileError, match=message) as raised:
        read_profile(keys, "desk.toml")
    assert str(raised.value).startswith("desk.toml: ")
    if hint:
        assert hint in raised.value.hint


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"axes = [", "is no TOML"),
        (b"\xff\xfe", "is no UTF-8 text"),
        (b"# " + b"a" * 70000, "is larger than 65536 bytes"),
        (b"a = " + b"[" * 30000, "is no TOML"),
    ],
)
def test_files_that_are_no_profiles(folder, data, message):
    (folder / "x.toml").write_bytes(data)
    with pytest.raises(vd.ProfileError, match=message):
        load_profile("x")


def test_a_missing_profile_names_the_nearest(folder):
    (folder / "kitchen.toml").touch()
    (folder / "notes.txt").touch()
    assert profile_names() == ["kitchen"]
    with pytest.raises(vd.ProfileError, match="there is no display profile") as raised:
        vd.open(display="kitchne")
    assert raised.value.hint == "did you mean 'kitchen'?"
    (folder / "folder.toml").mkdir()
    with pytest.raises(vd.ProfileError, match="cannot be read"):
        load_profile("folder")


@pytest.mark.parametrize("name", ["", "../desk", "a/b", ".x", "a\0b", "c:desk", "a\\b"])
def test_names_cannot_lead_out_of_the_folder(name):
    with pytest.raises(vd.ProfileError, match="no name of a display profile"):
        profile_path(name)


def test_the_folder_follows_the_system(monkeypatch, tmp_path):
    monkeypatch.delenv("XDG_CONFIG_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert profile_folder() == tmp_path / ".config" / "voxdisplay" / "displays"
    assert profile_names() == []
    monkeypatch.setattr("sys.platform", "win32")
    monkeypatch.setenv("APPDATA", str(tmp_path / "Roaming"))
    assert profile_folder() == tmp_path / "Roaming" / "voxdisplay" / "displays"


def test_what_is_written_is_read_as_it_was(folder):
    keys = {
        "port": 'sim:?"\\\x7f\u2028',
        "axes": ["x", "-z", "y"],
        "limit": {"amps": 8.5, "ma_per_channel": 20},
        "brightness": 0.25,
        "pitch_mm": [1.5, 2, 3],
    }
    path = folder / "new" / "desk.toml"
    assert profile_keys(path) is None
    save_profile(path, keys)
    assert profile_keys(path) == keys
    assert [each.name for each in path.parent.iterdir()] == ["desk.toml"]


def test_some_keys_win_over_a_profile():
    profile = read_profile({"axes": "y,x,z", "brightness": 0.5, "port": "sim:"})
    found = with_keys(profile, {"axes": "x,y,z", "dither": "ordered"})
    assert found.axes == Orientation.of("x,y,z")
    assert (found.brightness, found.port, found.dither) == (0.5, "sim:", "ordered")


def test_a_port_that_is_named_wins_over_the_profiles():
    keys = {"port": "sim:?size=3x5x7"}
    with vd.open(display=keys) as display:
        assert display.info.grid == (3, 5, 7)
    with vd.open("sim:?size=7x5x3", display=keys) as display:
        assert display.info.grid == (7, 5, 3)


def test_other_kinds_are_no_profiles():
    with pytest.raises(TypeError, match="display"):
        vd.open("sim:", display=5)

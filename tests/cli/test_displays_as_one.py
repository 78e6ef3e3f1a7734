"""Commands on a display that is made of several, and profiles of such displays that are wrong."""

import json

import numpy as np
import pytest
from light_receivers import UdpReceiver

from voxdisplay.cli.main import main
from voxdisplay.shows.recording import Recording

SCENE = """{"size": [8, 5, 7], "duration": 0.2, "fps": 20, "objects":
  [{"type": "segment", "from": [0, 0, 0], "to": [7.9, 4.9, "6.9 - time"], "color": "red"}]}"""
LEFT = {"name": "left", "port": "sim:?size=4x5x7", "size": [4, 5, 7]}
RIGHT = {
    "name": "right", "port": "sim:?size=7x5x4", "size": [4, 5, 7], "at": [4, 0, 0],
    "axes": "-z,y,x",
}  # fmt: skip


def toml(*parts, **keys):
    lines = [f"{key} = {json.dumps(value)}" for key, value in keys.items()]
    for part in parts:
        lines += ["[[parts]]", *(f"{key} = {json.dumps(value)}" for key, value in part.items())]
    return "\n".join(lines)


@pytest.fixture
def command(tmp_path, capsys, monkeypatch):
    """Run a command with a profile of parts; return exit code, stdout and stderr."""
    monkeypatch.delenv("VOXDISPLAY_PORT", raising=False)
    (tmp_path / "scene.json").write_text(SCENE)

    def run(name, *options, parts=(LEFT, RIGHT), **keys):
        profile = tmp_path / "wall.toml"
        profile.write_text(toml(*parts, **keys))
        scene = (
            [str(tmp_path / "scene.json")]
            if name in {"push", "play", "record"}
            and not (options and str(options[0]).endswith(".vxs"))
            else []
        )
        code = main([name, *scene, "--display", str(profile), *map(str, options)])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run


def test_push_tells_of_every_part(command):
    code, out, err = command("push", "--verify", "--json", brightness=0.5)
    assert code == 0, err
    told = json.loads(out)
    assert told["device"]["size"] == [8, 5, 7]
    assert told["verified"] is True
    assert told["digest"]
    assert 0 <= told["skew_s"] <= told["elapsed_s"]
    assert [part["name"] for part in told["parts"]] == ["left", "right"]
    assert [part["at"] for part in told["parts"]] == [[0, 0, 0], [4, 0, 0]]
    assert sum(part["voxels"] for part in told["parts"]) == told["voxels"] == 8
    assert sum(part["wire_bytes"] for part in told["parts"]) == told["wire_bytes"]
    assert all(part["digest"] and part["shown"] for part in told["parts"])
    _, out, _ = command("push")
    assert "left (sim:?size=4x5x7): 4 voxels" in out
    assert "proved: the display's digest" in out


def test_other_commands_take_it(command, tmp_path):
    code, out, err = command("play", "--json")
    told = json.loads(out)
    assert (code, told["wrong"], told["shown"] > 0) == (0, 0, True), err
    assert [part["state"] for part in told["parts"]] == ["open", "open"]
    assert "part 2" in command("info")[1]
    code, out, _ = command("clear", "--json")
    assert [part["shown"] for part in json.loads(out)["parts"]] == [True, True]
    code, out, _ = command("test-pattern", "--check", "--json")
    assert code == 0
    assert json.loads(out)["check"]["right"]
    code, out, _ = command("read", "-o", tmp_path / "page.npy", "--json")
    assert len(json.loads(out)["parts"]) == 2
    assert np.load(tmp_path / "page.npy").shape == (7, 5, 8, 3)


def test_quiet_leaves_out_what_threads_note(command):
    _, _, loud = command("push")
    assert "right: axes -z,y,x" not in loud  # a rotation
    mirrored = RIGHT | {"axes": "z,y,x"}
    assert "right: axes z,y,x mirror" in command("push", parts=(LEFT, mirrored))[2]
    assert command("push", "--quiet", parts=(LEFT, mirrored))[2] == ""


WRONG = {
    "an unknown key": ([LEFT | {"plce": [0, 0, 0]}], {}, "left: unknown key 'plce'"),
    "a key of the whole": ([LEFT | {"limit": 3}], {}, "write it above the parts"),
    "a key of a part": ([LEFT, RIGHT], {"serial": "A1"}, "serial: this display has 2 parts"),
    "no port": ([{"size": [4, 5, 7]}], {}, "part 1: port is missing"),
    "no size": ([{"port": "sim:"}], {}, "part 1: size is missing"),
    "twice the same axis": ([LEFT, RIGHT | {"axes": "x,x,z"}], {}, "x is named twice"),
    "twice the same port": (
        [LEFT | {"port": "/dev/tty9"}, RIGHT | {"port": "/dev/tty9"}], {}, "have the port",
    ),
    "twice the same name": ([LEFT, RIGHT | {"name": "left"}], {}, "have the name 'left'"),
    "a place below 0": ([LEFT | {"at": [0, -1, 0]}], {}, "left: at: expected 0 to"),
    "far away": ([LEFT | {"at": [2000, 2000, 2000]}], {}, "parts: "),
    "too many": ([LEFT] * 33, {}, "parts: expected 1 to 32, found 33"),
    "another grid": (
        [LEFT, RIGHT | {"axes": "x,y,z"}], {}, "right (sim:?size=7x5x4) is a display of 7x5x4",
    ),
    "another format": (
        [LEFT, RIGHT | {"port": "sim:?size=7x5x4&format=mono1"}], {}, "is a mono1 display, left",
    ),
    "another serial number": (
        [LEFT, RIGHT | {"serial": "B2"}], {}, "right (sim:?size=7x5x4): this device has no serial",
    ),
    "a port that is not there": (
        [LEFT, RIGHT | {"port": "/dev/no-such-port"}], {}, "right (/dev/no-such-port): ",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("parts", "keys", "text"), WRONG.values(), ids=WRONG)
def test_a_wrong_profile_is_a_clear_error(command, parts, keys, text):
    code, out, err = command("push", parts=parts, **keys)
    assert code in {1, 2, 3}
    assert text in err
    assert not out
    assert "Traceback" not in err


def test_a_port_or_a_capture_for_all_is_refused(command, tmp_path):
    assert "port: this display is made of several parts" in command("push", "--port", "sim:")[2]
    code, _, err = command("push", "--capture", tmp_path / "all.txt")
    assert code == 2
    assert "capture: this display is made of several parts" in err
    # But one of the environment is for those that name none.
    assert "part" in command("info")[1]


def test_the_port_of_the_environment_is_for_other_displays(command, monkeypatch):
    monkeypatch.setenv("VOXDISPLAY_PORT", "/dev/no-such-port")
    assert command("info")[0] == 0


def test_axes_are_not_asked_of_the_whole(command, tmp_path):
    command("info")
    assert main(["test-pattern", "--ask", str(tmp_path / "wall.toml")]) == 2
    assert "[[parts]]" in (tmp_path / "wall.toml").read_text()


def test_axes_are_not_asked_of_parts_for_another_profile(command, tmp_path):
    code, _, err = command("test-pattern", "--ask", tmp_path / "new.toml")
    assert code == 2
    assert "this display is made of parts: ask of each with --port" in err
    assert not (tmp_path / "new.toml").exists()


def test_a_recording_is_made_for_the_whole_and_played_on_it(command, tmp_path):
    recording = tmp_path / "day.vxs"
    scene = tmp_path / "scene.json"  # of another size, as that of the display counts
    scene.write_text(SCENE.replace("[8, 5, 7]", "[16, 10, 14]"))
    code, _, err = command("record", "-o", recording, pitch_mm=[1, 1, 2])
    assert code == 0, err
    assert "scaled" in err  # round stays round on voxels that are no cubes
    assert Recording(recording).grid == (8, 5, 7)
    code, out, err = command("play", recording, "--json")
    assert code == 0, err
    report = json.loads(out)
    assert report["frames"] == report["shown"] + report["dropped"] == 4
    assert report["wrong"] == 0
    assert [part["name"] for part in report["parts"]] == ["left", "right"]


def test_holes_and_overlaps_are_drawn_and_said(command):
    hole = RIGHT | {"at": [6, 0, 0]}
    code, out, err = command("push", "--verify", parts=(LEFT, hole))
    assert code == 0
    assert "no part lies at x 4 to 5, y 0 to 4, z 0 to 6" in err
    assert "  y 0-4  A . B" in err
    assert "verified: all" in out
    overlap = RIGHT | {"at": [2, 0, 0]}
    code, out, err = command("push", "--verify", parts=(LEFT, overlap))
    assert code == 0
    assert "left and right overlap at x 2 to 3, y 0 to 4, z 0 to 6" in err
    assert "  y 0-4  A # B" in err
    assert "proved" in out


def test_displays_lists_and_draws_it(tmp_path, capsys, monkeypatch):
    folder = tmp_path / "voxdisplay" / "displays"
    folder.mkdir(parents=True)
    (folder / "wall.toml").write_text(toml(LEFT, RIGHT))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setenv("APPDATA", str(tmp_path))
    assert main(["displays"]) == 0
    told = capsys.readouterr().out
    assert "wall  8x5x7 of 2 parts" in told
    assert "  y 0-4  A B" in told
    assert main(["displays", "--json"]) == 0
    (entry,) = json.loads(capsys.readouterr().out)["displays"]
    assert entry["size"] == [8, 5, 7]
    assert [part["name"] for part in entry["parts"]] == ["left", "right"]
    assert entry["layout_faults"] == []


def test_an_led_cube_may_be_a_part_and_proves_nothing(command):
    cube = UdpReceiver()
    try:
        part = LEFT | {"at": [4, 0, 0], "name": "cube"}
        part["port"] = f"artnet://127.0.0.1:{cube.number}?size=4x5x7"
        code, out, err = command("push", "--json", parts=(LEFT, part))
        assert code == 0, err
        told = json.loads(out)
        assert told["digest"] is None
        assert [bool(each["digest"]) for each in told["parts"]] == [True, False]
        assert len(cube.await_count(1)) == 1  # 140 LEDs in one universe
        code, out, err = command("play", parts=(LEFT, part))
        assert code == 0, err
        assert "not proved" in out
        code, _, err = command("read", "-o", "unwritten.npy", parts=(LEFT, part))
        assert code == 1
        assert "cannot" in err or "nothing answers" in err
    finally:
        cube.close()

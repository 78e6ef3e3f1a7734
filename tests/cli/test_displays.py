"""``--display``, its keys as options, ``displays`` and ``test-pattern --ask``."""

import io
import json
import tomllib

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.cli.main import main
from voxdisplay.display.display import Display
from voxdisplay.display.test_patterns import arrow_frame
from voxdisplay.raster.orientation import Orientation

PORT = "sim:?size=3x7x5&refresh=0"
SCENE = {"type": "segment", "from": [0, 0, 0], "to": [2.5, 4.5, 6.5], "color": ["red", "blue"]}
DESK = f'port = "{PORT}"\naxes = ["-x", "z", "y"]\n'


@pytest.fixture
def folder(tmp_path):
    found = tmp_path / "voxdisplay" / "displays"
    found.mkdir(parents=True)
    return found


@pytest.fixture
def at_home(run, tmp_path):
    """Run a command whose user's profiles are in `folder`."""

    def run_at_home(*arguments, **settings):
        return run(*arguments, XDG_CONFIG_HOME=str(tmp_path), **settings)

    return run_at_home


def test_push_shows_what_stands_otherwise(at_home, folder, scene):
    (folder / "desk.toml").write_text(DESK)
    path = scene(SCENE)
    done = at_home("push", path, "--display", "desk", "--verify", "--json")
    assert done.returncode == 0, done.stderr
    shown = json.loads(done.stdout)
    assert shown["port"] == PORT
    assert shown["device"]["size"] == [3, 5, 7]
    assert shown["verified"] is True
    frame = vd.Frame((3, 5, 7))
    frame.draw(vd.load_scene(path))
    turned = np.ascontiguousarray(frame.array()[:, :, ::-1].transpose(1, 0, 2, 3))
    memory = vd.Frame((3, 7, 5))
    memory.set(turned)
    assert shown["digest"] == f"{memory.digest():08x}"


def test_the_preview_of_a_turned_display_is_that_of_an_upright_one(run, scene, tmp_path):
    path, pictures = scene(SCENE), []
    for number, options in enumerate(
        (["--port", "sim:?size=3x5x7"], ["--port", PORT, "--axes=-x,z,y"])
    ):
        picture = tmp_path / f"{number}.png"
        done = run("push", path, *options, "--preview", picture)
        assert done.returncode == 0, done.stderr
        pictures.append(picture.read_bytes())
    assert pictures[0] == pictures[1]


def test_options_win_over_the_profile_and_it_over_the_environment(at_home, folder, scene):
    (folder / "desk.toml").write_text(DESK)
    path = scene(SCENE)

    def size(*options):
        command = ["push", path, "--display", "desk", *options, "--json"]
        done = at_home(*command, VOXDISPLAY_PORT="sim:?size=2x2x2&refresh=0")
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)["device"]["size"]

    assert size() == [3, 5, 7]
    assert size("--axes", "y,z,x") == [7, 5, 3]
    assert size("--port", "sim:?size=4x5x6&refresh=0") == [4, 6, 5]


def test_fit_of_the_profile_is_a_default(at_home, folder, scene):
    (folder / "desk.toml").write_text(DESK + 'fit = "none"\n')
    path = scene({"size": [30, 50, 70], "objects": [{**SCENE, "to": [29, 49, 69]}]})

    def voxels(*options):
        done = at_home("push", path, "--display", "desk", *options, "--json")
        return done.stderr

    assert "outside the display" in voxels()
    assert "scaled by 0.1" in voxels("--fit", "contain")


def test_light_and_pitch_are_options(run, scene):
    path = scene({"size": [9, 9, 9], "objects": [
        {"type": "sphere", "center": [4, 4, 4], "radius": 3, "fill": "solid"}]})  # fmt: skip
    light = ["--brightness", "0.5", "--limit", "0.5,20"]
    done = run("push", path, "--port", "sim:?size=9x9x9", *light, "--pitch", "5,5,8", "--verify")
    assert done.returncode == 0, done.stderr
    assert "along x, y, z to 9x9x9, whose voxels are 5 x 5 x 8 mm" in done.stderr
    assert "the limit is 0.5 A: shown with" in done.stderr


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--axes", "x,-x,z"], "x is named twice, and y is missing"),
        (["--display", "dsk"], "did you mean 'desk'?"),
        (["--display", "wrong"], "unknown key 'axis'\n  did you mean 'axes'?"),
        (["--brightness", "60"], "brightness: expected 0 to 1, found 60"),
        (["--limit", "8"], "'8' is not 2 numbers such as 8,20"),
        (["--pitch", "5,5,x"], "'5,5,x' is not 3 numbers"),
        (["--dither", "random"], "'random' is not one of"),
    ],
)
def test_what_is_wrong_is_a_usage_error(at_home, folder, scene, options, message):
    (folder / "desk.toml").write_text(DESK)
    (folder / "wrong.toml").write_text('axis = ["x", "y", "z"]')
    done = at_home("push", scene(SCENE), *options)
    assert done.returncode == 2
    assert message in done.stderr


def test_another_device_is_refused(at_home, folder, scene):
    (folder / "desk.toml").write_text(DESK + 'serial = "A1"\n')
    done = at_home("push", scene(SCENE), "--display", "desk")
    assert done.returncode == 1
    assert "no serial number" in done.stderr
    assert "wants 'A1'" in done.stderr


def test_a_mirror_is_said(run, scene):
    done = run("push", scene(SCENE), "--port", PORT, "--axes=x,z,y")
    assert done.returncode == 0
    assert "axes x,z,y mirror" in done.stderr


@pytest.mark.parametrize("options", [["--axes", "z,-x,-y"], ["--display", "desk"]])
def test_the_pattern_is_right_on_a_turned_display(at_home, folder, options):
    (folder / "desk.toml").write_text('axes = "-z,y,x"\nbrightness = 0.4\n')
    done = at_home("test-pattern", "--port", "sim:?size=9x12x10", "--check", *options)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "read back: all as meant" in done.stdout


def test_read_saves_what_the_user_sees(run, emulator, scene, tmp_path):
    device = emulator("--tcp", "127.0.0.1:0", "--size", "3x7x5", "--refresh", "0")
    options = ["--port", device.port, "--axes=-x,z,y"]
    path, file = scene(SCENE), tmp_path / "page.npy"
    assert run("push", path, *options).returncode == 0
    assert run("read", *options, "-o", file).returncode == 0
    frame = vd.Frame((3, 5, 7))
    frame.draw(vd.load_scene(path))
    np.testing.assert_array_equal(np.load(file), frame.array())
    assert run("clear", *options).returncode == 0


def test_displays_lists_what_there_is(at_home, folder):
    done = at_home("displays")
    assert (done.returncode, done.stdout) == (0, "")
    assert "no display profiles in" in done.stderr
    (folder / "desk.toml").write_text(DESK + "pitch_mm = [5, 5, 8]\nbrightness = 0.6\n")
    (folder / "mirror.toml").write_text('axes = "-x,y,z"\nlimit = {amps = 8, ma_per_channel = 20}')
    (folder / "wrong.toml").write_text("axes = 3")
    lines = at_home("displays").stdout.splitlines()
    assert lines[0] == f"desk    {PORT}, axes -x,z,y, pitch 5 x 5 x 8 mm, brightness 0.6"
    assert lines[1] == "mirror  any port, axes -x,y,z (mirrored), limit 8 A"
    assert lines[2].startswith(f"wrong   wrong: {folder / 'wrong.toml'}: axes")
    listed = json.loads(at_home("displays", "--json").stdout)
    assert listed["folder"] == str(folder)
    assert [each["name"] for each in listed["displays"]] == ["desk", "mirror", "wrong"]
    assert listed["displays"][0]["axes"] == ["-x", "z", "y"]
    assert "error" in listed["displays"][2]


def test_ask_writes_how_the_display_stands(at_home, folder, scene):
    ask = ["test-pattern", "--ask", "desk", "--port", PORT]
    done = at_home(*ask, stdin="left\nsideways\nup\nt\n")
    assert done.returncode == 0, done.stderr
    assert "please answer with one of away, towards, up, down" in done.stderr
    assert "Light 3 of 3: which side is lit (away, towards)?" in done.stderr
    path = folder / "desk.toml"
    # The memory's x points left, its y up, its z towards the user.
    assert tomllib.loads(path.read_text()) == {"port": PORT, "axes": ["-x", "-z", "y"]}
    assert at_home("push", scene(SCENE), "--display", "desk", "--verify").returncode == 0

    path.write_text(path.read_text() + "brightness = 0.5\n")
    done = at_home(*ask, stdin="no\n")
    assert done.returncode == 2
    assert "was left as it is" in done.stderr
    done = at_home("test-pattern", "--ask", "desk", stdin="yes\nright\nup\ntowards\n")
    assert done.returncode == 0, done.stderr
    assert "mirrors" not in done.stderr
    assert tomllib.loads(path.read_text()) == {
        "port": PORT, "axes": ["x", "-z", "y"], "brightness": 0.5,
    }  # fmt: skip
    done = at_home("test-pattern", "--ask", "desk", stdin="y\nright\nup\naway\n")
    assert "the display mirrors what its memory holds" in done.stderr


def test_without_answers_nothing_is_written(at_home, folder):
    done = at_home("test-pattern", "--ask", "desk", "--port", PORT, stdin="left\n")
    assert done.returncode == 2
    assert "no answer came on stdin: nothing was written" in done.stderr
    assert list(folder.iterdir()) == []


# Answers by grid, and the axes that they tell, if all three were asked.
SMALL = {
    "2x2x2": ("up right away", ["y", "z", "x"]),
    "3x5x7": ("right towards up", ["x", "-y", "z"]),
    "9x9x1": ("left away", None),
    "1x4x3": ("right up", None),
    "1x1x5": ("left", None),
    "6x1x1": ("up", None),
    "6x7x8": ("right away up", ["x", "y", "z"]),
}


@pytest.mark.parametrize(("size", "told"), SMALL.items())
def test_a_small_display_is_asked_by_lit_sides(size, told, tmp_path, monkeypatch, capsys):
    answers, axes = told
    path = tmp_path / "desk.toml"
    monkeypatch.setattr("sys.stdin", io.StringIO(answers.replace(" ", "\n") + "\n"))
    port = f"sim:?size={size}&refresh=0"
    assert main(["test-pattern", "--ask", str(path), "--port", port]) == 0
    written = Orientation.of(tomllib.loads(path.read_text())["axes"])
    count = len(answers.split())
    assert written.names == axes if axes else not written.mirrors
    directions = {"right": (0, False), "left": (0, True), "away": (1, False),
                  "towards": (1, True), "up": (2, False), "down": (2, True)}  # fmt: skip
    asked = [axis for axis, side in enumerate(vd.Grid.parse(size)) if side > 1]
    for axis, answer in zip(asked, answers.split(), strict=True):
        user, flips = directions[answer]
        assert (written.axes[user], written.flips[user]) == (axis, flips)
    err = capsys.readouterr().err
    assert ("Arrow 1 of 3: where does it point" in err) == (size == "6x7x8")
    assert (f"Light 1 of {count}: which side is lit" in err) == (size != "6x7x8")


def test_one_voxel_looks_the_same_however_it_stands(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    path = tmp_path / "desk.toml"
    assert main(["test-pattern", "--ask", str(path), "--port", "sim:?size=1x1x1"]) == 2
    assert "looks the same however it stands" in capsys.readouterr().err
    assert not path.exists()


@pytest.mark.parametrize("size", ["2x2x2", "3x5x7", "1x4x3", "6x1x1", "5x5x5", "6x7x8"])
def test_what_is_shown_for_an_axis_looks_otherwise_the_other_way_round(size):
    grid = vd.Grid.parse(size)
    for axis, side in enumerate(grid):
        shown = arrow_frame(axis, grid, vd.PixelFormat.MONO1, 1.0).array()
        assert shown.any()
        if side > 1:
            assert (shown != np.flip(shown, 2 - axis)).any()


def test_a_volume_is_dithered_on_demand(run, tmp_path):
    np.save(tmp_path / "grey.npy", np.linspace(0, 1, 9**3).reshape(9, 9, 9))
    lit = []
    for options in ([], ["--dither", "ordered"]):
        done = run("push", tmp_path / "grey.npy", "--fit", "none", "--window", "0,1", *options,
                   "--port", "sim:?size=9x9x9&format=mono1", "--json")  # fmt: skip
        assert done.returncode == 0, done.stderr
        lit.append(json.loads(done.stdout)["voxels"])
    assert lit[0] > 700
    assert 200 < lit[1] < 300  # a third: the mean light of sRGB greys


def test_arrows_are_those_of_the_memory_whatever_the_profile_says(folder, tmp_path, monkeypatch):
    (folder / "desk.toml").write_text(DESK)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setattr("sys.stdin", io.StringIO("right\naway\nup\n"))
    shown = []
    monkeypatch.setattr(
        Display, "present", lambda self, frame: shown.append(self._to_show(frame).memory)
    )
    assert main(["test-pattern", "--ask", "new", "--display", "desk"]) == 0
    arrows = [arrow_frame(axis, vd.Grid(3, 7, 5), vd.PixelFormat.RGB888, 1.0) for axis in range(3)]
    assert shown == arrows

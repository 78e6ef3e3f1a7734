"""Rules that hold for all commands: sizes, quiet, notes of curves, characters that lack."""

import json
import os
import subprocess
import sys

import pytest
from conftest import DEADLINE_S, ROOT

import voxdisplay as vd
from voxdisplay.cli.command_table import ENTRIES
from voxdisplay.cli.main import cli, main
from voxdisplay.cli.test_pattern import legend

PAPER = "examples/paper-curve.json"
SMALL = "sim:?size=3x5x7&refresh=0"
JUMP = {"type": "parametric", "x": "9*floor(t) + 0.5", "y": "8*t", "z": "1.5", "t": [0, 1.5]}
POLE = {"type": "parametric", "x": "t", "y": "1/(t - 0.5)", "z": "2", "t": [0, 1]}
HOLE = {"type": "parametric", "x": "9*t", "y": "9*sin(t - 0.5)/(t - 0.5)", "z": "2", "t": [0, 1]}
# Every command that draws a scene, with what follows SCENE.
DRAWING = {
    "push": ["push", "--port", "sim:?size=16x16x16&refresh=0"],
    "push json": ["push", "--port", "sim:?size=16x16x16&refresh=0", "--json"],
    "voxelize": ["voxelize"],
    "voxelize json": ["voxelize", "--json"],
    "preview": ["preview", "-o", "{folder}/x.png", "--size", "16x16x16"],
    "plan": ["plan", "--size", "16x16x16"],
}


def arguments_of(name, path, folder):
    command, *rest = DRAWING[name]
    return [command, str(path), *(word.format(folder=folder) for word in rest)]


@pytest.mark.parametrize("notation", ["3x5x7", "3,5,7", "3X5X7", " 3, 5, 7 "])
def test_a_size_is_written_alike_everywhere(capsys, tmp_path, notation):
    assert vd.Grid.parse(notation) == (3, 5, 7)
    assert main(["plan", PAPER, "--size", notation, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["size"] == [3, 5, 7]
    assert main(["voxelize", PAPER, "--clip", notation, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["objects"][0]["clipped"] > 0
    for option in ("--size", "--display-size"):
        picture = str(tmp_path / "x.png")
        assert main(["preview", PAPER, "-o", picture, "--pixels", "40,30", option, notation]) == 0
        assert "on 3x5x7" in capsys.readouterr().err
    if " " not in notation:
        assert main(["info", "--port", f"sim:?size={notation}", "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["size"] == [3, 5, 7]


def test_the_emulator_takes_both_notations(emulator, run):
    for notation in ("3x5x7", "3,5,7"):
        running = emulator("--tcp", "127.0.0.1:0", "--size", notation)
        assert json.loads(run("info", "--port", running.port, "--json").stdout)["size"] == [3, 5, 7]


def test_a_size_of_two_numbers_names_the_option_of_pixels(capsys):
    assert main(["preview", PAPER, "-o", "x.png", "--size", "800x600"]) == 2
    assert "--pixels is the size of the picture" in capsys.readouterr().err
    assert main(["plan", PAPER, "--size", "800x600"]) == 2
    assert "--pixels" not in capsys.readouterr().err


def test_no_option_is_pixels_here_and_voxels_there():
    for name in ENTRIES:
        for option in cli.get_command(None, name).params:
            if "--size" in option.opts:
                assert "in voxels" in option.help


def has_quiet(name):
    return any("--quiet" in option.opts for option in cli.get_command(None, name).params)


def test_every_command_that_notes_anything_can_be_quiet():
    # They print results and errors alone; those of show are commands of their own.
    silent = {"protocol", "schema", "annotate", "show"}
    assert {name for name in ENTRIES if not has_quiet(name)} == silent


@pytest.mark.parametrize(
    "arguments",
    [
        ["push", PAPER, "--port", SMALL + "&format=mono1"],
        ["push", PAPER, "--port", SMALL, "--fit", "none"],
        ["push", PAPER],
        ["info"],
        ["clear"],
        ["read", "-o", "{folder}/x.npy"],
        ["test-pattern", "--port", SMALL],
        ["preview", PAPER, "-o", "{folder}/x.png", "--size", "3x5x7"],
        ["plan", PAPER, "--size", "3x5x7", "--format", "mono1"],
        ["voxelize", PAPER, "-o", "{folder}/x.csv"],
        ["conformance", "--only", "7.1/*"],
    ],
    ids=lambda arguments: arguments[0],
)
@pytest.mark.parametrize("quiet", ["-q", "--quiet"])
def test_quiet_is_quiet(capsys, tmp_path, monkeypatch, arguments, quiet):
    monkeypatch.delenv("VOXDISPLAY_PORT", raising=False)
    words = [word.format(folder=tmp_path) for word in arguments]
    assert main(words) == 0
    loud = capsys.readouterr()
    assert main([*words, quiet]) == 0
    still = capsys.readouterr()
    assert still.err == ""
    assert bool(still.out) == bool(loud.out)


def test_quiet_keeps_errors(capsys):
    assert main(["push", "nowhere.json", "-q"]) == 2
    assert "no such file" in capsys.readouterr().err
    assert main(["info", "--port", "/dev/ttyNOWHERE", "-q"]) == 3
    assert "/dev/ttyNOWHERE" in capsys.readouterr().err


@pytest.mark.parametrize("name", DRAWING)
def test_a_jump_is_noted_by_every_command(capsys, tmp_path, scene, name):
    path = scene({"objects": [JUMP]})
    assert main(arguments_of(name, path, tmp_path)) == 0
    assert "$.objects[0] (parametric): the curve jumps near t = 1:" in capsys.readouterr().err


@pytest.mark.parametrize("name", DRAWING)
def test_a_hole_is_drawn_through_and_noted_by_every_command(capsys, tmp_path, scene, name):
    path = scene({"objects": [HOLE]})
    assert main(arguments_of(name, path, tmp_path)) == 0
    noted = capsys.readouterr().err
    assert "$.objects[0] (parametric): " in noted
    assert "0.5" in noted


@pytest.mark.parametrize("name", DRAWING)
def test_a_pole_is_the_same_error_in_every_command(capsys, tmp_path, scene, name):
    path = scene({"objects": [POLE]})
    assert main(arguments_of(name, path, tmp_path)) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert "$.objects[0]: y = inf at t = 0.5 is not finite" in printed.err


# -- one colour


def test_patterns_on_one_colour_are_told_apart_without_colours(capsys):
    assert main(["test-pattern", "--port", "sim:?size=17x30x11&format=mono1"]) == 0
    printed = capsys.readouterr().out
    assert "x has one tick at its far end, y two, z three" in printed
    assert "red" not in printed
    for name in ("axes", "corners", "plane"):
        text = legend(name, vd.Grid(9, 11, 10), one_color=True)
        assert not {"red", "green", "blue", "white", "grey"} & set(text.replace(",", "").split())
    assert "look alike" in legend("corners", vd.Grid(9, 11, 10), one_color=True)
    assert "red" in legend("axes", vd.Grid(9, 11, 10), one_color=False)


def test_axes_without_room_for_ticks_are_named():
    assert "ticks of x, z:" in legend("axes", vd.Grid(7, 30, 5), one_color=True)
    assert "ticks" not in legend("axes", vd.Grid(9, 30, 8), one_color=True).partition("three")[2]


# -- characters


@pytest.fixture
def cyrillic(emulator, tmp_path):
    """A port whose name has letters that Western code pages lack."""
    link = tmp_path / "порты-куб"
    emulator("--pty", "--size", "8x8x8", "--refresh", "0", "--link", link)
    return link


def redirected(encoding, *arguments, cwd=ROOT):
    variables = {**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"}
    variables.pop("VOXDISPLAY_PORT", None)
    return subprocess.run(
        [sys.executable, "-m", "voxdisplay", *map(str, arguments)],
        capture_output=True,
        env=variables,
        cwd=cwd,
        timeout=DEADLINE_S,
        check=False,
    )


@pytest.mark.parametrize("encoding", ["cp1252", "ascii", "cp1252:strict", "latin-1:strict"])
@pytest.mark.parametrize(
    "arguments",
    [
        ["info"],
        ["info", "--json"],
        ["push", PAPER],
        ["push", PAPER, "--json"],
        ["push", PAPER, "--verify"],
        ["clear"],
        ["test-pattern"],
        ["conformance", "--only", "7.1/*"],
    ],
    ids=" ".join,
)
def test_no_command_dies_of_what_its_output_cannot_hold(cyrillic, encoding, arguments):
    done = redirected(encoding, *arguments, "--port", cyrillic)
    assert done.returncode == 0, done.stderr
    assert b"\\u043a\\u0443\\u0431" in done.stdout + done.stderr
    if "--json" in arguments:
        assert json.loads(done.stdout)


@pytest.mark.parametrize("encoding", ["cp1252:strict", "ascii:strict"])
@pytest.mark.parametrize(
    "arguments",
    [
        ["info", "--port", "/dev/куб"],
        ["push", "куб.json"],
        ["push", PAPER, "--preview", "куб.txt"],
        ["куб"],
        ["voxelize", PAPER, "-o", "куб.txt"],
        ["annotate", "куб"],
        ["plan", PAPER, "--features", "куб"],
    ],
    ids=lambda arguments: arguments[0],
)
def test_errors_can_be_printed_in_any_encoding(encoding, arguments):
    done = redirected(encoding, *arguments)
    assert done.returncode in {2, 3}
    assert b"\\u043a\\u0443\\u0431" in done.stderr
    assert b"Error: " in done.stderr or done.stderr.startswith(b"voxdisplay: ")
    assert b"fault of this program" not in done.stderr


def test_a_file_name_that_is_no_text(tmp_path):
    name = os.fsencode(tmp_path) + b"/\xff.json"
    command = [sys.executable, "-m", "voxdisplay", "push", name]
    done = subprocess.run(command, capture_output=True, cwd=ROOT, check=False)
    assert done.returncode == 2
    assert b"no such file" in done.stderr

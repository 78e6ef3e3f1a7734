"""Bad scenes, files and usage: errors with place and remedy, exit code 2, no traceback."""

import json
import subprocess

import pytest

from voxdisplay.cli import main

PAPER = "examples/paper-curve.json"


def refused(done, *words, code=2):
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    for word in words:
        assert word in done.stderr, done.stderr
    return done


def curve(**keys):
    return {"type": "parametric", "x": "t", "y": "1", "z": "2", "t": [0, 1], **keys}


SCENES = {
    "unknown key": ({**curve(), "colour": "red"}, ["$", "colour", "color"]),
    "unknown key deep": ({"objects": [curve(), curve(closd=True)]}, ["$.objects[1]", "closed"]),
    "unknown type": ({"type": "circel"}, ["circel", "circle"]),
    "unknown function": (curve(x="sine(t)"), ["$.x", "sine", "sin"]),
    "unknown name": (curve(y="radius*t"), ["$.y", "radius"]),
    "python name": (curve(z="__import__('os')"), ["$.z"]),
    "reversed range": (curve(t=[1, 0]), ["$.t"]),
    "infinite range": (curve(t=[0, "exp(1000)"]), ["$.t", "finite"]),
    "pole": (curve(x="1/(t - 0.5)"), ["$", "x = ", "t = 0.5"]),
    "not finite": (curve(y="log(t)"), ["$", "y", "t = 0"]),
    "endless power": (curve(x="9**9**9"), ["$.x"]),
    "endless curve": (curve(x="1e7*t"), ["$"]),
    "too rough": (curve(x="sin(1e12*t)"), ["$"]),
    "huge size": ({"size": [10**9, 10**9, 10**9], "objects": []}, ["$.size"]),
    "unknown colour": (curve(color="oragne"), ["$.color", "orange"]),
    "missing key": ({"type": "segment", "from": [0, 0, 0]}, ["$", "to"]),
    "text for a list": ({"objects": "all"}, ["$.objects"]),
    "a file outside": ({"type": "points", "file": "../secret.csv"}, ["$.file"]),
}


@pytest.mark.parametrize("name", SCENES)
def test_bad_scenes(capsys, scene, name):
    content, words = SCENES[name]
    path = str(scene(content))
    for arguments in (["push", path, "--port", "sim:"], ["voxelize", path]):
        code = main(arguments)
        printed = capsys.readouterr()
        refused(subprocess.CompletedProcess(arguments, code, printed.out, printed.err), *words)


@pytest.mark.parametrize("command", ["push", "voxelize", "plan"])
@pytest.mark.parametrize(
    ("content", "table", "notes"),
    [
        ({"objects": []}, "", ["the scene has no objects: there is nothing to show"]),
        (
            {"type": "points", "file": "points.csv"},
            ",x,y,z\n0,1,2,3\n1,4,5,6\n",
            ["'points.csv': x, y, z are columns 2, 3, 4 ('x', 'y', 'z') of 4, separated by commas"],
        ),
        ({"type": "points", "file": "points.csv"}, "1,2,3\n4,5,6\n", []),
    ],
)
def test_notes_of_scenes(capsys, scene, command, content, table, notes):
    path = scene(content)
    path.with_name("points.csv").write_text(table)
    assert main([command, str(path), *(["--port", "sim:"] if command == "push" else [])]) == 0
    lines = capsys.readouterr().err.splitlines()
    assert [line for line in lines if "points.csv" in line or "no objects" in line] == notes


TEXTS = {
    "broken": '{"objects": [',
    "empty": "",
    "nan": '{"type": "segment", "from": [NaN, 0, 0], "to": [1, 1, 1]}',
    "infinity": '{"type": "segment", "from": [Infinity, 0, 0], "to": [1, 1, 1]}',
    "a list": "[1, 2]",
    "deep": "[" * 100_000,
    "deep expression": json.dumps(curve(x="(" * 4000)),
    "long expression": json.dumps(curve(x="1+" * 5_000_000 + "1")),
    "many digits": '{"size": [' + "9" * 100_000 + ", 1, 1]}",
    "null bytes": '{"objects": []}\0\0',
}


@pytest.mark.parametrize("name", TEXTS)
def test_hostile_text(run, scene, name):
    done = refused(run("push", scene(TEXTS[name]), "--port", "sim:"), "scene.json")
    assert len(done.stderr) < 1000, "an error is no copy of the file"


def test_files_that_cannot_be_read(run, tmp_path):
    refused(run("push", tmp_path / "curve.json"), "curve.json")
    refused(run("push", tmp_path), "directory")
    (tmp_path / "scene.bin").write_bytes(b"\xff\xfe\x00\x80" * 10)
    refused(run("push", tmp_path / "scene.bin"), "UTF-8")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["push"], ["SCENE"]),
        (["psuh", "x"], ["psuh", "push"]),
        (
            ["push", "x", "--fitt", "none"],
            ["no such option: '--fitt'; did you mean '--fit'?", "push --help"],
        ),
        (["push", "x", "--fit", "cover"], ["contain"]),
        (["push", "x", "--timeout", "0"], ["--timeout"]),
        (["push", "x", "--timeout", "nan"], ["--timeout", "is not a number of seconds"]),
        (["push", "x", "--reconnect", "inf"], ["--reconnect"]),
        (["voxelize", PAPER, "-o", "x.obj"], [".npy"]),
        (["voxelize", PAPER, "--clip", "0x5x7"], ["128x128x128"]),
        (["plan", PAPER, "--size", "99999x9x9"], ["--size", "65535"]),
        (["voxelize", PAPER, "-o", "/nowhere/x.csv"], ["/nowhere/x.csv"]),
        (["voxelize", PAPER, "--pitch", "0.5"], ["--pitch", "--method march"]),
        (["voxelize", PAPER, "--reach", "0.5"], ["--reach", "--method march"]),
        (["voxelize", PAPER, "--method", "march", "--pitch", "0"], ["--pitch", "positive"]),
        (["voxelize", PAPER, "--method", "march", "--reach", "0.1"], ["--reach", "0.25"]),
        (["read", "--port", "sim:?size=3x5x7", "-o", "/nowhere/x.npy"], ["/nowhere/x.npy"]),
        (["read", "--port", "sim:", "-o", "x.csv"], [".npy"]),
    ],
)
def test_usage(run, arguments, words):
    refused(run(*arguments), *words)


def test_a_display_that_is_too_large_for_this_machine(monkeypatch, capsys):
    def too_large(*_shape, **_kind):
        raise MemoryError("Unable to allocate 24.0 GiB")

    monkeypatch.setattr("voxdisplay.Frame", too_large)
    assert main(["plan", PAPER, "--size", "2048,2048,2048"]) == 2
    printed = capsys.readouterr().err
    assert printed.startswith("voxdisplay: there is not enough memory: Unable to allocate 24.0 GiB")
    assert main(["--debug", "plan", PAPER]) == 2
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments",
    [
        ["annotate", "{}"],
        ["preview", PAPER, "-o", "/none{}/x.png"],
        ["push", PAPER, "{}"],
        ["push", "{}.json"],
        ["push", PAPER, "--port", "{}"],
        ["{}"],
    ],
)
def test_names_do_not_steer_the_terminal(arguments, run):
    done = run(*(word.format("a\x1b]0;b\x07\x9b31m\u202e") for word in arguments))
    assert done.returncode in {2, 3}
    assert done.stderr.replace("\n", "").isprintable(), repr(done.stderr)

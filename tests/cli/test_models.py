"""Meshes, volumes and voxel models on the command line: shown, converted, refused."""

import json
import subprocess
import sys

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.cli.main import EXIT_USAGE

CUBE = """OFF
8 6 0
0 0 0
2 0 0
2 4 0
0 4 0
0 0 6
2 0 6
2 4 6
0 4 6
4 0 3 2 1
4 4 5 6 7
4 0 1 5 4
4 1 2 6 5
4 2 3 7 6
4 3 0 4 7
"""
VALUES = np.arange(105, dtype=np.float32).reshape(7, 5, 3)


@pytest.fixture
def volume(tmp_path):
    path = tmp_path / "v.npy"
    np.save(path, VALUES)
    return path


@pytest.fixture
def mesh(tmp_path):
    pytest.importorskip("trimesh", reason="needs the extra mesh")
    path = tmp_path / "cube.off"
    path.write_text(CUBE, encoding="ascii")
    return path


def refused(done, *words):
    assert done.returncode == EXIT_USAGE
    assert not done.stdout
    assert "Traceback" not in done.stderr
    for word in words:
        assert word in done.stderr


def test_push_shows_a_volume_fitted_with_its_options(run, volume):
    options = ("--window", "0,104", "--threshold", "50", "--map", "magma")
    done = run("push", volume, "--port", "sim:?size=5x7x9", *options, "--verify", "--json")
    assert json.loads(done.stdout)["voxels"] == (VALUES >= 50).sum()
    assert "v.npy scaled by 1 to 5x7x9" in done.stderr


def test_push_shows_a_mesh_as_the_only_object(run, mesh):
    shell = run("push", mesh, "--port", "sim:?size=14x14x14", "--json", "--up", "z")
    solid = run("push", mesh, "--port", "sim:?size=14x14x14", "--json", "--fill", "solid")
    assert json.loads(solid.stdout)["voxels"] == 4 * 8 * 12
    assert json.loads(shell.stdout)["voxels"] == 4 * 8 * 12 - 2 * 6 * 10
    assert "do not say what is up" in solid.stderr
    assert "do not say what is up" not in shell.stderr


def test_plan_and_preview_take_models(run, volume, tmp_path):
    planned = run("plan", volume, "--size", "5x7x9", "--window", "0,104", "--json")
    assert json.loads(planned.stdout)["voxels"] == 104
    if not run("preview", volume, "-o", tmp_path / "a.png", "--color", "orange").returncode:
        assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("kind", ["npy", "npz", "vox", "ply"])
def test_convert_writes_what_a_display_would_show(run, volume, tmp_path, kind):
    out = tmp_path / f"out.{kind}"
    done = run("convert", volume, "-o", out, "--size", "5x7x9", "--json", "--window", "0,104")
    assert json.loads(done.stdout) == {
        "output": str(out), "size": [5, 7, 9], "format": "rgb888", "voxels": 104,
    }  # fmt: skip
    if kind == "npy":
        frame = vd.Frame((5, 7, 9))
        frame.set(np.load(out))
        assert len(frame.lit()[0]) == 104
    if kind in ("npz", "vox"):
        again = run("push", out, "--port", "sim:?size=5x7x9", "--fit", "none", "--json")
        assert json.loads(again.stdout)["voxels"] == 104


def test_convert_takes_scenes_and_notes_what_they_note(run, tmp_path):
    out = tmp_path / "out.vox"
    done = run("convert", "examples/paper-curve.json", "-o", out, "--size", "64x64x64")
    assert done.returncode == 0
    assert "scaled by 0.5" in done.stderr
    assert "voxels of 64x64x64" in done.stderr


@pytest.mark.parametrize("format_", ["mono1", "index8", "rgb565", "rgb888"])
def test_read_writes_voxels_of_every_format(run, tmp_path, format_):
    for kind in ("npy", "npz", "vox", "ply"):
        done = run("read", "--port", f"sim:?size=3x5x7&format={format_}", "-o",
                   tmp_path / f"a.{kind}", "--json")  # fmt: skip
        assert json.loads(done.stdout)["voxels"] == 0
        assert (tmp_path / f"a.{kind}").exists()


def test_files_that_cannot_be_read_are_named(run, tmp_path):
    (tmp_path / "a.vox").write_bytes(b"VOX 1234" + bytes(12))
    refused(run("push", tmp_path / "a.vox"), "a.vox")
    refused(run("push", tmp_path / "nowhere.stl"), "nowhere.stl")
    (tmp_path / "a.raw").write_bytes(bytes(105))
    refused(run("push", tmp_path / "a.raw"), "a.raw", "shape", "dtype")
    shown = run("push", tmp_path / "a.raw", "--shape", "7,5,3", "--dtype", "uint8")
    assert shown.returncode == 0
    refused(run("convert", tmp_path / "a.vox", "-o", tmp_path / "a.stl"), ".ply")
    refused(run("read", "-o", tmp_path / "a.stl"), ".ply")
    refused(run("convert", "examples/paper-curve.json", "-o", tmp_path / "no" / "a.vox"))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--window", "5"], ["--window", "0,1500"]),
        (["--window", "5,1"], ["window", "lower"]),
        (["--window", "nan,1"], ["window"]),
        (["--threshold", "high"], ["--threshold"]),
        (["--map", "magmaa"], ["magma"]),
        (["--color", "blurple"], ["blurple"]),
        (["--up", "x"], ["--up"]),
        (["--fill", "half"], ["solid"]),
    ],
)
def test_wrong_options_are_named(run, volume, options, words):
    refused(run("push", volume, *options), *words)


def test_options_for_models_are_refused_for_scenes(run):
    refused(run("push", "examples/paper-curve.json", "--fill", "solid"), "--fill", "scene")


HEAVY = {"PIL", "charset_normalizer", "cmap", "fontpkg", "lxml", "nibabel", "networkx", "nrrd",
         "pydicom", "scipy", "trimesh", "uharfbuzz"}  # fmt: skip


def loaded_by(*arguments):
    """Packages that a command has loaded when it ends."""
    script = (
        "import sys; from voxdisplay.cli.main import main\n"
        f"assert main({list(map(str, arguments))!r}) == 0\n"
        "print(*{name.split('.')[0] for name in sys.modules}, sep='\\n')"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    return set(done.stdout.split())


def test_push_of_a_scene_or_an_array_loads_no_extra(volume):
    for shown in ("examples/paper-curve.json", volume):
        names = loaded_by("push", shown, "--port", "sim:?size=16x16x16", "--quiet")
        assert "numpy" in names
        assert not names & HEAVY

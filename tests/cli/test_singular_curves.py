"""Every command treats curves without a value at single parameters alike."""

from __future__ import annotations

import json

import numpy as np
import pytest

COMMANDS = {
    "push": ["push", "--port", "sim:?size=64x64x64"],
    "voxelize": ["voxelize"],
    "voxelize --json": ["voxelize", "--json"],
    "voxelize --certified": ["voxelize", "--certified", "--json"],
    "voxelize --method march": ["voxelize", "--method", "march"],
    "voxelize --method march --json": ["voxelize", "--method", "march", "--json"],
    "plan": ["plan"],
    "preview": ["preview"],
}


def arguments(command: str, path, tmp_path) -> list[str]:
    words = [*COMMANDS[command], path]
    return [*words, "-o", tmp_path / "picture.png"] if command == "preview" else words


def scene_of(y: str, t: list[float]) -> dict[str, object]:
    circle = {"type": "circle", "center": [20, 20, 20], "radius": 9}
    curve = {"type": "parametric", "x": "30 + 4*t", "y": y, "z": "20", "t": t}
    return {"size": [64, 64, 64], "objects": [circle, curve]}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_removable_singularity_is_drawn_through_and_noted(command, run, scene, tmp_path):
    path = scene(scene_of("30 + 20*sin(t)/t", [-6, 6]))
    done = run(*arguments(command, path, tmp_path))
    assert done.returncode == 0, done.stderr
    assert "$.objects[1]" in done.stderr
    assert "y has no value at t = 0.0, and is drawn with its limit there" in done.stderr
    if "json" in command:
        found = json.loads(done.stdout)["objects"]
        assert found[0]["undefined"] == []
        assert found[1]["undefined"] == [{"axis": "y", "t": 0.0, "jump": False}]
        assert found[1]["pieces"] == 1
        assert found[1]["e_max"] < 0.8661


@pytest.mark.parametrize("command", COMMANDS)
def test_a_pole_is_an_error_with_object_axis_and_t(command, run, scene, tmp_path):
    path = scene(scene_of("30 + 1/(t - 0.25)", [-6, 6]))
    done = run(*arguments(command, path, tmp_path))
    assert done.returncode == 2
    for word in ("$.objects[1]", "y = ", "t = 0.25", "shorten the range of t"):
        assert word in done.stderr
    assert not done.stdout


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("y", ["30 + 20*t/abs(t)", "30 + 20*sign(t)", "if(t < 0, 10, 50)"])
def test_a_jump_splits_and_is_noted(command, y, run, scene, tmp_path):
    path = scene(scene_of(y, [-6, 6]))
    done = run(*arguments(command, path, tmp_path))
    assert done.returncode == 0, done.stderr
    assert "$.objects[1]" in done.stderr
    assert "jumps" in done.stderr
    if "json" in command:
        found = json.loads(done.stdout)["objects"][1]
        assert found["pieces"] == 2
        assert found["jumps"] == [pytest.approx(0, abs=1e-9)]
        assert found["gaps"] == 0


def test_what_is_pushed_is_what_is_listed(run, scene, tmp_path):
    path = scene(scene_of("30 + 20*sin(t)/t", [-6, 6]))
    table = tmp_path / "voxels.npy"
    assert run("voxelize", path, "-o", table).returncode == 0
    done = run("push", path, "--port", "sim:?size=64x64x64", "--verify", "--json")
    assert json.loads(done.stdout)["voxels"] == len(np.unique(np.load(table)[:, 1:], axis=0))


@pytest.mark.parametrize(
    ("content", "counts"),
    [
        # The same curve, written with what there was before.
        ({"x": "10+10*log10(t)", "y": "10", "z": "10", "t": [1, 10]}, 11),
        ({"x": "10+10*ln(t)/ln(10)", "y": "10", "z": "10", "t": [1, 10]}, 11),
        ({"x": "10.5+5*sign(t)", "y": "10.5+t", "z": "10", "t": [-3, 3]}, 8),
    ],
)
def test_functions_of_other_programs(content, counts, run, scene):
    done = run("voxelize", scene({"type": "parametric", **content}), "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["voxels"] == counts


def test_knots_of_cad(run, scene):
    points = [[10, 10, 10], [40, 10, 10], [40, 40, 10], [10, 40, 30], [5, 5, 5]]
    counts = []
    for knots in ([0, 0, 0, 1, 2, 2, 2], [0, 0, 0, 0, 1, 2, 2, 2, 2]):
        path = scene({"type": "bspline", "degree": 3, "knots": knots, "points": points})
        done = run("voxelize", path)
        assert done.returncode == 0, done.stderr
        counts.append(done.stdout)
    assert counts[0] == counts[1]


def test_an_endless_curve_is_refused(run, scene):
    helix = {"type": "helix", "center": [9, 9, 0], "radius": 5, "pitch": 1, "turns": 1e12}
    done = run("push", scene(helix), "--port", "sim:?size=16x16x16")
    assert done.returncode == 2
    assert "too long" in done.stderr


def test_a_view_notes_what_the_other_commands_note(run, scene):
    """In a terminal, where a view ends at once: this is none."""
    done = run("view", "--terminal", scene(scene_of("30 + 20*sin(t)/t", [-6, 6])))
    assert "$.objects[1]" in done.stderr
    assert "y has no value at t = 0.0, and is drawn with its limit there" in done.stderr
    done = run("view", "--terminal", scene(scene_of("30 + 20*t/abs(t)", [-6, 6])))
    assert "jumps" in done.stderr
    done = run("view", "--terminal", scene(scene_of("30 + 1/(t - 0.25)", [-6, 6])))
    assert done.returncode == 2
    assert "shorten the range of t" in done.stderr

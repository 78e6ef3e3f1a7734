"""Moving scenes in ``preview``, ``plan``, ``push`` and ``voxelize``; bodies in ``voxelize``."""

import json

import numpy as np
import pytest
from PIL import Image

import voxdisplay as vd

SCENE = {
    "size": [17, 18, 19],
    "duration": 2,
    "fps": 6,
    "objects": [
        {"type": "sphere", "center": ["4 + 4*time", 9, 9], "radius": "2 + time", "color": "red"},
        {"type": "segment", "from": [1, 1, 1], "to": [16, 1, 1], "part": [0, "time/2"]},
    ],
}
SMALL = ("--pixels", "96x72", "--plain")


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "moves.json"
    path.write_text(json.dumps(SCENE))
    return path


def test_a_film_has_a_picture_for_each_frame(run, scene, tmp_path):
    path = tmp_path / "x.gif"
    done = run("preview", scene, "-o", path, *SMALL)
    assert done.returncode == 0, done.stderr
    assert "12 pictures on 17x18x19 rgb888" in done.stderr
    with Image.open(path) as film:
        assert film.n_frames == 12
        film.seek(1)
        one = np.asarray(film.convert("RGB"))
        film.seek(11)
        assert (one != np.asarray(film.convert("RGB"))).any()


def test_a_film_at_another_rate(run, scene, tmp_path):
    path = tmp_path / "x.gif"
    done = run("preview", scene, "-o", path, *SMALL, "--fps", "2")
    assert "4 pictures" in done.stderr
    html = tmp_path / "x.html"
    assert "12 pictures" in run("preview", scene, "-o", html).stderr
    assert html.read_text(encoding="utf-8").count('"fps": 6.0') == 1


def test_a_moment(run, scene, tmp_path):
    begin, later, same = (tmp_path / f"{name}.png" for name in "abc")
    for path, at in ((begin, ()), (later, ("--at", "1.5")), (same, ("--at", "0"))):
        done = run("preview", scene, "-o", path, *SMALL, *at)
        assert done.returncode == 0, done.stderr
    assert begin.read_bytes() == same.read_bytes() != later.read_bytes()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--at", "2.5"), "the scene lasts 2 s"),
        (("--at", "-1"), "--at"),
        (("--at", "x"), "--at"),
    ],
)
def test_moments_that_are_not_there(run, scene, tmp_path, options, message):
    done = run("preview", scene, "-o", tmp_path / "x.png", *options)
    assert done.returncode == 2
    assert message in done.stderr


def test_a_still_scene_has_no_moments(run, tmp_path):
    done = run("preview", "examples/trefoil.json", "-o", tmp_path / "x.png", "--at", "1")
    assert done.returncode == 2
    assert "the scene does not move" in done.stderr


def test_films_are_bounded(run, tmp_path):
    path = tmp_path / "long.json"
    path.write_text(json.dumps(SCENE | {"duration": 100_000}))
    for name in ("x.gif", "x.html"):
        done = run("preview", path, "-o", tmp_path / name, "--pixels", "96x72")
        assert done.returncode == 2
        assert "600000 pictures" in done.stderr


def test_plan_names_worst_and_mean_frame(run, scene):
    # Coded so briefly as all features allow, frames would take no longer than their answers.
    done = run("plan", scene, "--baud", "115200", "--features", "line,box,dots,oct", "--json")
    facts = json.loads(done.stdout)
    assert (facts["frames"], facts["fps"], facts["duration_s"]) == (12, 6.0, 2.0)
    assert facts["worst"]["frame"] == 11
    assert facts["worst"]["time_s"] == pytest.approx(11 / 6)
    assert facts["mean"]["wire_bytes"] < facts["worst"]["wire_bytes"] == facts["wire_bytes"]
    (line,) = facts["lines"]
    assert line["frames_per_s"] < line["mean_frames_per_s"]
    moment = vd.load_scene(scene).at_frame(11)
    frame = vd.Frame((17, 18, 19))
    frame.draw(moment)
    assert facts["voxels"] == len(frame.lit()[0])
    text = run("plan", scene).stdout
    assert "12 frames in 2 s at 6 fps" in text
    assert "worst frame: 11, at 1.833 s" in text


def test_push_shows_the_beginning(run, scene):
    done = run("push", scene, "--port", "sim:?size=17x18x19", "--json")
    assert done.returncode == 0, done.stderr
    assert "its beginning is shown" in done.stderr
    frame = vd.Frame((17, 18, 19))
    frame.draw(vd.load_scene(scene).at(0))
    assert json.loads(done.stdout)["voxels"] == len(frame.lit()[0])


def test_voxelize_reports_bodies(run, scene):
    report = json.loads(run("voxelize", scene, "--json").stdout)
    ball, line = report["objects"]
    assert (ball["type"], ball["kind"], line["kind"]) == ("sphere", "surface", "curve")
    assert ball["tunnels"] == 0
    assert ball["e_max"] <= 0.5 + 1e-4
    assert line["voxels"] == 0

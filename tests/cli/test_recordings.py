"""The commands record and show, and the emulator that plays a file."""

from __future__ import annotations

import importlib.util
import json
import shutil
import subprocess
import sys
import time
import zipfile

import numpy as np
import pytest
from PIL import Image
from recordings import Spin, write_recording

from voxdisplay.shows.recording import Recording

DEADLINE_S = 60

SCENE = {
    "size": [16, 14, 12],
    "duration": 0.5,
    "fps": 24,
    "loop": True,
    "objects": [
        {
            "type": "circle",
            "center": [8, 7, 6],
            "radius": "2 + 4*time",
            "color": ["red", "blue"],
            "transform": [{"rotate": [1, 0, 0], "angle": "time", "about": [8, 7, 6]}],
        }
    ],
}


@pytest.fixture
def recorded(run, scene, tmp_path):
    """Record the scene; return the path and what was printed."""
    path = tmp_path / "spin.vxs"
    done = run("record", scene(SCENE), "-o", path, "--check", 2, "--json")
    assert done.returncode == 0, done.stderr
    return path, json.loads(done.stdout)


def test_record_and_info(run, recorded):
    path, facts = recorded
    assert {"frames": 12, "duration_s": 0.5, "fps": 24.0, "checked": 2}.items() <= facts.items()
    assert facts["bytes"] == path.stat().st_size
    done = run("show", "info", path, "--json")
    assert done.returncode == 0
    shown = json.loads(done.stdout)
    wanted = {"frames": 12, "duration_s": 0.5, "fps": 24, "grid": [16, 14, 12], "format": "rgb888"}
    assert wanted.items() <= shown.items()
    assert shown["whole"] is True
    assert shown["bytes"] == facts["bytes"]
    assert "12 frames, 0.5 s at 24 fps, in a loop" in run("show", "info", path).stdout


def test_jobs_give_the_same_bytes(run, scene, recorded, tmp_path):
    again = tmp_path / "again.vxs"
    done = run("record", scene(SCENE), "-o", again, "--jobs", 2)
    assert done.returncode == 0, done.stderr
    assert again.read_bytes() == recorded[0].read_bytes()
    assert "12 frames" in done.stderr


@pytest.mark.parametrize("format_", ["mono1", "index8"])
def test_other_displays(run, scene, tmp_path, format_):
    path = tmp_path / "a.vxs"
    done = run("record", scene(SCENE), "-o", path, "--size", "9x8x7", "--format", format_)
    assert done.returncode == 0, done.stderr
    recording = Recording(path)
    assert (recording.format.grid, recording.format.format.value) == ((9, 8, 7), format_)
    assert recording.frame(3).lit()[0].size


def test_repair(run, recorded, tmp_path):
    path, _ = recorded
    cut = tmp_path / "cut.vxs"
    cut.write_bytes(path.read_bytes()[:-300])
    done = run("show", "info", cut)
    assert "cut off or damaged" in done.stderr
    assert json.loads(run("show", "info", cut, "--json").stdout)["whole"] is False
    done = run("show", "repair", cut, "--json")
    assert done.returncode == 0, done.stderr
    target = tmp_path / "cut.repaired.vxs"
    kept = json.loads(done.stdout)
    assert kept["file"] == str(target)
    repaired = Recording(target)
    assert repaired.whole
    assert repaired.frame_count == kept["frames"] > 5
    done = run("show", "repair", cut, "-o", tmp_path / "other.vxs")
    assert f"{kept['frames']} frames" in done.stderr


def test_arrays_both_ways(run, recorded, tmp_path):
    path, _ = recorded
    arrays, again = tmp_path / "a.npz", tmp_path / "b.vxs"
    assert run("show", "convert", path, "-o", arrays).returncode == 0
    with np.load(arrays) as content:
        assert content["frames"].shape == (12, 12, 14, 16, 3)
        assert content["fps"] == 24
    done = run("show", "convert", arrays, "-o", again)
    assert done.returncode == 0, done.stderr
    first, second = Recording(path), Recording(again)
    assert second.fps == 24
    assert all(first.frame(n) == second.frame(n) for n in range(12))


def test_magicavoxel_both_ways(run, recorded, tmp_path):
    path, _ = recorded
    model, again = tmp_path / "a.vox", tmp_path / "b.vxs"
    assert run("show", "convert", path, "-o", model).returncode == 0
    done = run("show", "convert", model, "-o", again, "--fps", 24)
    assert done.returncode == 0, done.stderr
    first, second = Recording(path), Recording(again)
    assert (second.fps, second.format.grid) == (24, first.format.grid)
    assert all(first.frame(n) == second.frame(n) for n in range(12))


@pytest.mark.parametrize("suffix", ["gif", "mp4", "html"])
def test_films_of_recordings(run, recorded, tmp_path, suffix):
    if suffix == "mp4" and not has_mp4():
        pytest.skip("neither PyAV nor ffmpeg is installed")
    film, other = tmp_path / f"a.{suffix}", tmp_path / f"b.{suffix}"
    done = run("show", "convert", recorded[0], "-o", film, "--pixels", "96x64", "--fps", 12)
    assert done.returncode == 0, done.stderr
    assert "6 pictures" in done.stderr
    done = run("preview", recorded[0], "-o", other, "--pixels", "96x64", "--fps", 12)
    assert done.returncode == 0, done.stderr
    assert "6 pictures on 16x14x12" in done.stderr
    if suffix == "gif":
        with Image.open(film) as pictures:
            assert (pictures.n_frames, pictures.size) == (6, (96, 64))
        assert film.read_bytes() == other.read_bytes()


@pytest.mark.parametrize(("fps", "pictures", "ms"), [(0.05, 4, 10_000), (100, 1, 20)])
def test_films_keep_their_length_at_any_rate(run, tmp_path, fps, pictures, ms):
    """A film has a picture every ten seconds at least, and sixty a second at most."""
    np.savez(tmp_path / "a.npz", frames=np.eye(2, dtype=np.uint8).reshape(2, 1, 2, 1), fps=fps)
    for suffix in ("html", "gif"):
        done = run("show", "convert", tmp_path / "a.npz", "-o", tmp_path / f"a.{suffix}")
        assert done.returncode == 0, done.stderr
        assert f"{pictures} picture" in done.stderr
    if pictures > 1:
        with Image.open(tmp_path / "a.gif") as film:
            total = 0
            for number in range(film.n_frames):
                film.seek(number)
                total += film.info["duration"]
            assert total == pictures * ms


def has_mp4():
    return shutil.which("ffmpeg") or importlib.util.find_spec("av")


def test_a_film_of_one_bit_a_voxel_is_white(run, tmp_path):
    write_recording(tmp_path / "a.vxs", Spin(3, "mono1"))
    film = tmp_path / "a.gif"
    done = run("show", "convert", tmp_path / "a.vxs", "-o", film, "--pixels", "96x64")
    assert done.returncode == 0, done.stderr
    with Image.open(film) as pictures:
        colors = np.asarray(pictures.convert("RGB")).reshape(-1, 3).astype(int)
    brightest = colors[colors.sum(axis=1).argmax()]
    assert brightest.min() > 150


def test_moments_of_recordings(run, recorded, tmp_path):
    done = run("preview", recorded[0], "-o", tmp_path / "a.png", "--at", "0.26")
    lit = len(Recording(recorded[0]).frame(6).lit()[0])
    assert f"{lit} voxels on 16x14x12" in done.stderr
    done = run("preview", recorded[0], "-o", tmp_path / "a.png", "--at", "0.51")
    assert done.returncode == 2
    assert "the show lasts 0.5 s" in done.stderr


def test_plan_of_a_recording_counts_what_is_played(run, recorded):
    path, _ = recorded
    done = run("plan", path, "--json")
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    assert (facts["frames"], facts["fps"], facts["size"]) == (12, 24, [16, 14, 12])
    assert {"worst", "mean"} <= set(facts)
    sizes = {line["wire_bytes"] for line in facts["lines"]}
    assert len(sizes) == 1, "it is sent as it is, whatever the line"
    recording = Recording(path)
    ops = [recording.recorded_frame(n).header.size for n in range(12)]
    assert facts["worst"]["frame"] == int(np.argmax(ops))
    other = json.loads(run("plan", path, "--json", "--size", "8x8x8").stdout)
    assert other["size"] == [8, 8, 8]
    assert other["worst"]["voxels"] < facts["worst"]["voxels"]
    assert "12 frames in 0.5 s at 24 fps" in run("plan", path).stdout


def test_an_animation_of_an_led_cube(run, tmp_path):
    path = tmp_path / "cube.lcanimraw"
    manifest = {
        "formatVersion": 1, "name": "a", "size": {"x": 3, "y": 5, "z": 7}, "ledFormat": "Rgb",
        "frameCount": 4, "frameTimeUs": 50_000,
        "keyframes": [{"at": 0, "id": 1}, {"at": 3, "id": 0}],
    }  # fmt: skip
    pool = np.zeros((2, 7, 5, 3, 3), np.uint8)
    pool[1, 6, 0, 2] = 255
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("manifest.json", json.dumps(manifest))
        archive.writestr("frames.bin", pool.tobytes())
    done = run("show", "convert", path, "-o", tmp_path / "b.vxs")
    assert done.returncode == 0, done.stderr
    made = Recording(tmp_path / "b.vxs")
    assert (made.fps, made.frame_count) == (20, 4)
    assert [int(made.frame(n).array().any(axis=-1).sum()) for n in range(4)] == [1, 1, 1, 0]
    played = run("play", path, "--port", "sim:?size=3x5x7&refresh=0", "--json")
    assert json.loads(played.stdout)["frames"] == 4


@pytest.mark.parametrize("format_", ["mono1", "index8", "rgb565"])
def test_arrays_of_numpy_alone(run, tmp_path, format_):
    write_recording(tmp_path / "a.vxs", Spin(4, format_))
    source = Recording(tmp_path / "a.vxs")
    frames = np.stack([source.frame(n).array() for n in range(4)])
    np.savez_compressed(tmp_path / "a.npz", frames=frames, format=np.array(format_))
    done = run("show", "convert", tmp_path / "a.npz", "-o", tmp_path / "b.vxs", "--fps", 12.5)
    assert done.returncode == 0, done.stderr
    made = Recording(tmp_path / "b.vxs")
    assert made.fps == 12.5
    assert all(made.frame(n) == source.frame(n) for n in range(4))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"other": np.zeros(3)}, "has no array frames"),
        ({"frames": np.zeros((2, 3, 4), np.uint8)}, "no array of frames"),
        ({"frames": np.zeros((2, 3, 4, 5), np.float64)}, "no memory of a display"),
        ({"frames": np.zeros((2, 3, 4, 5, 4), np.uint8)}, "no memory of a display"),
        ({"frames": np.full((2, 3, 4, 5), 7, np.uint8), "format": np.array("mono1")}, "frame 0"),
        ({"frames": np.zeros((2, 3, 4, 5), np.uint8), "format": np.array("rgb")}, "format"),
        ({"frames": np.zeros((2, 3, 4, 5), np.uint8), "fps": np.array(-1.0)}, "fps are -1"),
        ({"frames": np.zeros((2, 3, 4, 5), np.uint8), "fps": np.array(np.nan)}, "fps are nan"),
        ({"frames": np.zeros((2, 3, 4, 5), np.uint8), "palette": np.zeros(99_999)}, "too large"),
    ],
)
def test_arrays_that_are_no_frames(run, tmp_path, content, message):
    np.savez(tmp_path / "a.npz", **content)
    done = run("show", "convert", tmp_path / "a.npz", "-o", tmp_path / "b.vxs")
    assert done.returncode == 2, done.stderr
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "b.vxs").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("show", "info", "none.vxs"), "No such file"),
        (("show", "info", "README.md"), "no recording"),
        (("show", "convert", "README.md", "-o", "a.npz"), "cannot be read"),
        (("show", "convert", "a.vxs", "-o", "a.doc"), "No such file"),
        (("show", "convert", "a.vxs", "-o", "a.gif", "--fps", "90"), "at most 60"),
        (("show", "convert", "examples/star.obj", "-o", "a.gif"), "cannot be read"),
        (("show", "convert", "a.vxs", "-o", "b.vxs"), "already"),
        (("show", "convert", "a.vxs", "-o", "b.npz"), "No such file"),
        (("record", "examples/trefoil.json", "-o", "a.npz"), "a recording is a file .vxs"),
        (
            ("record", "examples/trefoil.json", "-o", "a.vxs", "--jobs", "2", "--dask", "x"),
            "--jobs",
        ),
    ],
)
def test_bad_arguments(run, arguments, message):
    done = run(*arguments)
    assert done.returncode in {1, 2}
    assert message in done.stderr
    assert "Traceback" not in done.stderr


@pytest.fixture
def once(run, scene, tmp_path):
    """Record the scene so that it ends."""
    path = tmp_path / "once.vxs"
    done = run("record", scene(SCENE | {"loop": False}), "-o", path)
    assert done.returncode == 0, done.stderr
    return path


def test_recordings_are_played(run, once):
    port = "sim:?size=16x14x12&refresh=48"
    done = run("play", once, "--port", port, "--json")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["frames"] == 12
    assert report["shown"] > 0
    assert report["wrong"] == 0


def test_recordings_of_other_displays_are_played(run, once):
    for size, format_ in (("16x14x12", "mono1"), ("8x7x6", "rgb888"), ("30x30x30", "index8")):
        port = f"sim:?size={size}&format={format_}&refresh=48"
        done = run("play", once, "--port", port, "--json")
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout)["wrong"] == 0
        remark = "recorded for 16x14x12 rgb888; decoded, and encoded again for"
        assert done.stderr.count(f"{remark} {size} {format_}\n") == 1


def test_push_shows_the_first_frame(run, recorded):
    path, _ = recorded
    lit = len(Recording(path).frame(0).lit()[0])
    done = run("push", path, "--port", "sim:?size=16x14x12", "--verify", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["voxels"] == lit
    cut = path.with_name("cut.vxs")
    cut.write_bytes(path.read_bytes()[:200])
    assert "no whole frame" in run("push", cut, "--port", "sim:").stderr


def test_the_emulator_plays_a_file(recorded, emulator, tmp_path):
    path, _ = recorded
    dump = tmp_path / "front.npy"
    running = emulator("--show", path, "--refresh", 60, "--tcp", "127.0.0.1:0", "--dump", dump)
    recording = Recording(path)
    pictures = {recording.frame(n).array().tobytes() for n in range(12)}
    dark = bytes(len(next(iter(pictures))))
    seen = set()
    until_s = time.monotonic() + DEADLINE_S
    while not pictures <= seen and time.monotonic() < until_s:
        seen.add(np.load(dump).tobytes())
    assert pictures <= seen <= {*pictures, dark}
    assert running.stop() == 0


def refusal_of_the_emulator(*arguments):
    command = [sys.executable, "-m", "firmware_sim", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE_S, check=False)
    assert done.returncode == 2
    return done.stderr


def test_the_emulator_refuses_other_files(tmp_path):
    bad = tmp_path / "a.vxs"
    bad.write_bytes(b"GIF89a" * 100)
    assert "it is no recording" in refusal_of_the_emulator("--show", bad)
    assert "No such file" in refusal_of_the_emulator("--show", tmp_path / "none.vxs")
    assert "leave out --usbip" in refusal_of_the_emulator("--show", bad, "--usbip", "127.0.0.1:0")

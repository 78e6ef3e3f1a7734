"""Files that ``view`` and ``preview --watch`` follow: saved, half-written, gone, hostile."""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from websockets.sync.client import connect

from voxdisplay.cli import main
from voxdisplay.cli.followed_file import FollowedFile

ROOT = Path(__file__).parents[2]
DEADLINE_S = 60
HALF_WRITTEN = '{"size": [16, 16, 16], "objects": [{"type": "sph'


def text_of(count):
    """Return a scene of some voxels."""
    points = [[i + 0.5, 0.5, 0.5] for i in range(count)]
    return json.dumps({"size": [16, 16, 16], "objects": [{"type": "scatter", "points": points}]})


@contextlib.contextmanager
def started(*arguments):
    """Run ``voxdisplay`` until the block ends, then interrupt it."""
    command = [sys.executable, "-m", "voxdisplay", *map(str, arguments)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT
    ) as process:
        try:
            yield process
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(DEADLINE_S)
    assert process.returncode == 130


def eventually(condition):
    deadline_s = time.monotonic() + DEADLINE_S
    while time.monotonic() < deadline_s:
        if found := condition():
            return found
        time.sleep(0.02)
    raise TimeoutError


# -- the file alone


def test_a_file_is_saved_when_it_has_come_to_rest(tmp_path):
    path = tmp_path / "a.json"
    path.write_text("1")
    file = FollowedFile(str(path))
    assert not file.saved()
    path.write_text("22")
    assert not file.saved(), "it may still be written"
    assert file.saved()
    assert not file.saved(), "it was read"
    path.write_text("333")
    assert not file.saved()
    path.write_text("4444")
    assert [file.saved(), file.saved(), file.saved()] == [False, True, False]


def test_a_file_that_is_replaced_or_gone(tmp_path):
    path, other = tmp_path / "a.json", tmp_path / "b.json"
    path.write_text("1")
    file = FollowedFile(str(path))
    path.unlink()
    assert [file.saved(), file.saved()] == [False, False]
    other.write_text("2")
    other.replace(path)
    assert [file.saved(), file.saved()] == [False, True]


def test_what_is_no_file_never_changes(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in ("-", str(pipe), str(tmp_path), "a\0b"):
        file = FollowedFile(path)
        assert [file.saved(), file.saved()] == [False, False]


# -- preview --watch


def lit_pixels(path):
    with contextlib.suppress(OSError):
        picture = np.asarray(Image.open(io.BytesIO(path.read_bytes())).convert("L"))
        return int((picture > 60).sum())
    return 0


def test_preview_follows_and_keeps_the_last_picture(tmp_path):
    path, picture = tmp_path / "a.json", tmp_path / "a.png"
    path.write_text(text_of(1))
    with started("preview", path, "-o", picture, "--watch", "--plain", "--pixels", "64x64") as it:
        assert "1 voxel on" in it.stderr.readline()
        assert "Ctrl-C" in it.stderr.readline()
        one = lit_pixels(picture)
        path.write_text(HALF_WRITTEN)
        word = it.stderr.readline()
        assert "a.json" in word
        assert "last picture stays" in word
        assert lit_pixels(picture) == one
        path.write_text(text_of(9))
        assert "9 voxels on" in it.stderr.readline()
        assert lit_pixels(picture) > one


def test_preview_cannot_follow_stdin(tmp_path, capsys):
    assert main(["preview", "-", "-o", str(tmp_path / "a.png"), "--watch"]) == 2
    assert "--watch: stdin" in capsys.readouterr().err


def test_a_first_scene_that_is_broken_ends_it(scene, tmp_path, capsys):
    path = str(scene(HALF_WRITTEN))
    assert main(["preview", path, "-o", str(tmp_path / "a.png"), "--watch"]) == 2
    assert "stays" not in capsys.readouterr().err


# -- view


def test_a_browser_gets_what_was_saved(tmp_path):
    path = tmp_path / "a.json"
    path.write_text(text_of(1))
    with started("view", path, "--no-open") as view:
        url = view.stdout.readline().strip()
        with connect(url.replace("http", "ws") + "live") as browser:

            def voxels():
                message = browser.recv(DEADLINE_S)
                browser.send("shown")
                return json.loads(message[4 : int.from_bytes(message[:4], "little")])["voxels"]

            assert voxels() == 1
            path.write_text(HALF_WRITTEN)
            assert "last picture stays" in view.stderr.readline()
            path.write_text(text_of(5))
            assert voxels() == 5
            moving = json.loads(text_of(3)) | {"duration": 1, "fps": 10}
            path.write_text(json.dumps(moving))
            assert {voxels(), voxels(), voxels()} == {3}
            path.write_text(text_of(2))
            eventually(lambda: voxels() == 2)


def test_a_moving_scene_that_fails_later_waits_for_another(tmp_path):
    path = tmp_path / "a.json"
    points = [[1, 1, "sqrt(0.15 - time)"]]
    failing = {
        "size": [16, 16, 16], "duration": 0.4, "fps": 10,
        "objects": [{"type": "scatter", "points": points}],
    }  # fmt: skip
    path.write_text(json.dumps(failing))
    with started("view", path, "--no-open") as view:
        url = view.stdout.readline().strip()
        with connect(url.replace("http", "ws") + "live") as browser:
            browser.recv(DEADLINE_S)
            browser.send("shown")
            word = view.stderr.readline()
            assert "time = " in word
            assert "last picture stays" in word
            path.write_text(text_of(5))
            while True:
                message = browser.recv(DEADLINE_S)
                browser.send("shown")
                if b'"voxels": 5' in message:
                    break


def test_the_terminal_follows_and_says_what_is_wrong(tmp_path):
    terminal = pytest.importorskip("terminal", reason="needs a Unix terminal")
    path = tmp_path / "a.json"
    path.write_text(text_of(1))
    view = terminal.Terminal(["view", "--terminal", path])
    view.resize(20, 150)
    try:

        def plain(text):
            return re.sub(r"\x1b\[[?\d;]*[A-Za-z]", "", text)

        view.read_until(lambda came: " 1 voxels" in plain(came))
        path.write_text(HALF_WRITTEN)
        view.read_until(lambda came: "\n a.json, line 1, column 45: " in plain(came))
        path.write_text(text_of(7))
        view.read_until(lambda came: " a.json  7 voxels  arrows turn" in plain(came))
        view.press("q")
        assert view.finish()[0] == 0
        assert view.modes_restored
    finally:
        view.close()


def test_quiet_commands_follow_quietly(tmp_path):
    """The notes of what is read again are those of the command: none, if it is quiet."""
    path = tmp_path / "a.json"
    path.write_text(text_of(1))
    far = json.dumps(
        {"size": [16, 16, 16], "objects": [{"type": "scatter", "points": [[99, 1, 1]]}]}
    )
    with started("view", path, "--no-open", "--quiet") as view:
        url = view.stdout.readline().strip()
        with connect(url.replace("http", "ws") + "live") as browser:
            browser.recv(DEADLINE_S)
            browser.send("shown")
            path.write_text(far)
            message = browser.recv(DEADLINE_S)
            assert b'"voxels": 0' in message
        view.send_signal(signal.SIGINT)
        assert "outside" not in view.stderr.read()

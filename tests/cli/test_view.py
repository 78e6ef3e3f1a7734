"""``voxdisplay view`` for a browser: output, notes and refused arguments."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

import numpy as np
import pytest
from websockets.sync.client import connect

import voxdisplay as vd
from voxdisplay.cli.view import _ReadbackDisplay

ROOT = Path(__file__).parents[2]
DEADLINE_S = 60


def test_a_scene_is_shown_until_it_is_interrupted(scene):
    path = scene(
        {
            "size": [3, 5, 7],
            "objects": [{"type": "segment", "from": [0, 0, 0.5], "to": [3, 5, 0.5]}],
        }
    )
    command = [sys.executable, "-m", "voxdisplay", "view", str(path), "--no-open"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT
    ) as process:
        try:
            url = process.stdout.readline().strip()
            assert url.startswith("http://127.0.0.1:")
            with urllib.request.urlopen(url, timeout=DEADLINE_S) as page:  # noqa: S310 - http
                assert page.status == 200
            with connect(url.replace("http", "ws") + "live") as browser:
                message = browser.recv(DEADLINE_S)
            head = json.loads(message[4 : int.from_bytes(message[:4], "little")])
            assert (head["size"], head["title"]) == ([3, 5, 7], path.name)
            assert head["voxels"] > 3
        finally:
            process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=DEADLINE_S)
    assert (process.returncode, out) == (130, "")
    assert "Traceback" not in err


@pytest.mark.parametrize("kind", ["scene", "recording"])
def test_a_scene_that_moves_is_played(run, scene, tmp_path, kind):
    shown = scene(
        {
            "size": [3, 5, 7], "duration": 0.4, "fps": 10,
            "objects": [{"type": "points", "points": [[0.5, 0.5, "0.5 + 10*time"]]}],
        }
    )  # fmt: skip
    if kind == "recording":
        path, shown = shown, tmp_path / "a.vxs"
        assert run("record", path, "-o", shown).returncode == 0
    command = [sys.executable, "-m", "voxdisplay", "view", str(shown), "--no-open"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT
    ) as process:
        try:
            url = process.stdout.readline().strip()
            places = set()
            with connect(url.replace("http", "ws") + "live") as browser:
                while len(places) < 4:
                    message = browser.recv(DEADLINE_S)
                    at = int.from_bytes(message[:4], "little")
                    head = json.loads(message[4:at])
                    assert head["voxels"] == 1
                    assert not head["bitmap"]
                    places.add((head["number"], tuple(message[at : at + 3])))
                    browser.send("shown")
            assert places == {(number + 1, (0, 0, number)) for number in range(4)}
        finally:
            process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=DEADLINE_S)
    assert process.returncode == 130
    assert "Traceback" not in err


def test_a_display_that_cannot_be_read_cannot_be_watched(run):
    done = run("view", "--no-open", "--port", "sim:?size=3x5x7&features=digest")
    assert done.returncode == 1
    assert "cannot read its memory back" in done.stderr


def test_colours_that_cannot_be_known_are_noted_once(capsys):
    port = "sim:?size=3x5x7&format=index8"
    with vd.open(port) as display:
        watched = _ReadbackDisplay(display)
        frame = display.frame()
        frame.draw([(1, 2, 3)], color="#010204")
        for _ in range(2):
            display.present(frame)
            assert np.array_equal(watched.read(), frame.array())
    assert capsys.readouterr().err.count("a palette, which cannot be read back") == 1


def test_colours_of_the_default_palette_are_known(capsys):
    with vd.open("sim:?size=3x5x7&format=index8") as display:
        frame = display.frame()
        frame.draw([(1, 2, 3)], color="#ff0000")
        display.present(frame)
        _ReadbackDisplay(display).read()
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("address", ["8000", "127.0.0.1:99999"])
def test_a_bad_address_is_refused(address, run):
    done = run("view", "--no-open", "--port", "sim:", "--listen", address)
    assert done.returncode == 2
    assert "write HOST:PORT like 127.0.0.1:8000" in done.stderr


def test_an_address_that_is_taken_is_named(run):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        done = run("view", "--no-open", "--port", "sim:?size=3x5x7", "--listen", address)
    assert done.returncode == 2
    assert f"cannot listen at {address}" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_port_that_goes_away_ends_it(emulator):
    sim = emulator("--tcp", "127.0.0.1:0", "--size", "3x5x7")
    command = [sys.executable, "-m", "voxdisplay", "view", "--port", sim.port, "--no-open"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT
    ) as process:
        try:
            url = process.stdout.readline().strip()
            with connect(url.replace("http", "ws") + "live") as browser:
                browser.recv(DEADLINE_S)
                sim.stop()
                _, err = process.communicate(timeout=DEADLINE_S)
        finally:
            process.kill()
    assert process.returncode == 3
    assert "Traceback" not in err


def test_pushing_imports_nothing_of_the_view():
    script = "import sys, voxdisplay.cli.main; print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert not {"asyncio", "webbrowser", "voxdisplay.view.live"} & set(done.stdout.split())

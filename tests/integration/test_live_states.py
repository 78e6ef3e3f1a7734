"""States of the live view in words, hints, and files that are dropped on its page."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
from urllib.parse import urlsplit

import browser as browsers
import numpy as np
import pytest
from websockets.exceptions import ConnectionClosedOK
from websockets.sync.client import connect

import voxdisplay as vd

pytestmark = browsers.NEEDED

SCENE = {
    "size": [9, 9, 9],
    "view": {"angle": [0, 90]},
    "objects": [{"type": "segment", "from": [1, 4, 4], "to": [7, 4, 4], "color": "red"}],
}


@pytest.fixture(scope="module")
def emulator():
    command = [sys.executable, "-m", "firmware_sim", "--tcp", "127.0.0.1:0", "--refresh", "0"]
    command += ["--size", "3x5x7", "--view", "127.0.0.1:0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            place = json.loads(process.stdout.readline())
            with vd.open(place["port"]) as display:
                yield display, place
        finally:
            process.terminate()
            assert process.wait(browsers.DEADLINE_S) == 0


def drop(page, name, data):
    """Drop a file on a page."""
    page.run(
        f"dispatchEvent(new DragEvent('drop', {{dataTransfer: (d => (d.items.add(new File("
        f"[new Uint8Array({list(data)})], {json.dumps(name)})), d))(new DataTransfer())}})), 0"
    )


def show(display, *voxels):
    frame = display.frame()
    if voxels:
        frame.draw(np.array(voxels), "white")
    display.present(frame)


def test_an_empty_display_says_how_to_push_to_it(tab, emulator):
    display, place = emulator
    show(display)
    page = tab(place["view"])
    page.wait("current()?.n === 0 && $('hint').checkVisibility()")
    hint = page.run("$('hint').textContent")
    assert f"voxdisplay push SCENE.json --port {place['port']}" in hint
    show(display, (1, 2, 3))
    page.wait("current().n === 1 && !$('hint').checkVisibility()")
    titles = page.run(
        "[...document.querySelectorAll('#facts dt')].map(t => [t.textContent, t.title])"
    )
    assert len(titles) == 8
    assert all(title for _, title in titles)


def test_a_page_says_that_it_is_paused_behind_and_without_an_answer(tab, emulator):
    display, place = emulator
    page = tab(place["view"])
    page.wait("current() && $('state').textContent === 'live'")
    page.key(" ")
    assert page.run("$('state').textContent") == "paused"
    before = page.run("history.length")
    for z in range(3):
        show(display, (0, 0, z))
        page.wait(f"history.length === {before + z + 1}")
    page.wait("$('state').textContent === 'paused, 3 behind'")
    page.key("End")
    page.wait("$('state').textContent === 'live'")
    now = "performance.now()"
    page.run(f"arrivals = [[{now}, 1], [{now}, 5], [{now}, 9]], setState()")
    assert page.run("[$('state').dataset.is, $('state').textContent]") == [
        "behind",
        "behind: shows 25 % of the frames",
    ]
    assert page.run("heard -= 8000, setState(), $('state').textContent").startswith("no answer for")
    assert page.run("$('state').hasAttribute('data-old')")
    page.wait("$('state').textContent === 'live'")  # the server answers the next question


def test_a_scene_that_is_dropped_is_shown_and_the_live_picture_comes_back(tab, emulator):
    display, place = emulator
    show(display, (1, 2, 3))
    page = tab(place["view"])
    page.wait("current()?.n === 1")
    drop(page, "my scene.json", json.dumps(SCENE).encode())
    page.wait("current()?.n === 7 && gridSize.join() === '9,9,9'")
    page.wait("$('title').textContent === 'my scene'")
    assert page.run("camera.pitch") == pytest.approx(np.pi / 2)
    show(display, (1, 2, 3), (1, 2, 4))
    page.run("$('back').click()")
    page.wait("current()?.n === 2 && $('state').textContent === 'live'")
    moving = SCENE | {"duration": 1, "fps": 4}
    drop(page, "moves.json", json.dumps(moving).encode())
    page.wait("history.length === 4 && $('state').textContent === 'playing'")


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("a.json", b'{"objects": [{"type": "sphere"}]}', "$.objects[0]"),
        ("a.stl", b"solid of nothing", "a.stl:"),
        ("../../etc/passwd", b"root", "etc/passwd:"),
        ("a.vxs", b"\0" * 5000, "a.vxs:"),
    ],
    ids=lambda value: None if isinstance(value, bytes) else str(value),
)
def test_a_file_that_cannot_be_shown_says_why(tab, emulator, name, data, message):
    display, place = emulator
    show(display, (0, 1, 2))
    page = tab(place["view"])
    page.wait("current()?.n === 1")
    drop(page, name, data)
    page.wait("$('refusal').checkVisibility() && !$('refusal').textContent.endsWith('is read')")
    said = page.run("$('refusal').textContent")
    assert message in said
    assert "Traceback" not in said
    assert tempfile.gettempdir() not in said
    assert len(said) < 800
    assert page.run("current().n") == 1, "the last good picture stays"


def test_large_files_and_files_on_exported_pages_are_refused(tab, emulator, tmp_path):
    page = tab(emulator[1]["view"])
    page.wait("current()")
    page.run("showFile({name: 'a.ply', size: 2 ** 30})")
    assert "larger than 32 MiB" in page.run("$('refusal').textContent")
    frame = vd.Frame((3, 5, 7))
    frame.save(tmp_path / "a.html")
    page = tab((tmp_path / "a.html").as_uri())
    page.wait("painted")
    drop(page, "a.json", b"{}")
    assert "voxdisplay view" in page.run("$('refusal').textContent")


def refusal(url, messages=(), *, place=None):
    """Return what a page is told that sends messages, whatever the address says the place is."""
    for _ in range(20):
        sock = socket.create_connection((place.hostname, place.port)) if place else None
        with connect(url, sock=sock) as page:
            for message in messages:
                page.send(message)
            try:
                return json.loads(page.recv(browsers.DEADLINE_S))["error"]
            except ConnectionClosedOK:
                continue  # clients of websockets 14.0 may lose what comes right before the end
    raise AssertionError("it is told nothing")


def test_files_are_taken_from_this_computer_alone(emulator):
    url = emulator[1]["view"].replace("http", "ws") + "drop?name=a.json"
    place = urlsplit(url)
    named = url.replace(place.hostname, "192.168.0.7")
    assert "own computer" in refusal(named, place=place)
    # More of it than is taken.
    assert "32 MiB" in refusal(url, [b"x" * 65536] * 600 + [""])


def test_a_view_that_ends_says_so(tab, tmp_path):
    (tmp_path / "a.json").write_text(json.dumps(SCENE))
    command = [sys.executable, "-m", "voxdisplay", "view", str(tmp_path / "a.json"), "--no-open"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        page = tab(process.stdout.readline().strip())
        page.wait("current()?.n === 7 && $('state').textContent === 'live'")
        os.kill(process.pid, signal.SIGTERM)
        page.wait("$('state').dataset.is === 'ended'", errors=True)
        assert page.run("current().n") == 7
        page.errors.clear()

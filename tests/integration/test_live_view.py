"""Live view of an emulator in a real browser: pictures as they come, and who may see them.

Places and counts are checked, never how fast it goes.
"""

from __future__ import annotations

import contextlib
import json
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import browser as browsers
import numpy as np
import pytest
import reverse_proxy
from carriers import eventually
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

import voxdisplay as vd

ROOT = Path(__file__).parents[2]

pytestmark = browsers.NEEDED


@contextlib.contextmanager
def emulator_with_view(where="127.0.0.1:0", *options):
    """Run an emulator that is viewed; yield a display that is open on it, and the URL."""
    command = [sys.executable, "-m", "firmware_sim", "--tcp", "127.0.0.1:0", "--refresh", "0"]
    command += ["--size", "3x5x7", "--view", where, *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
        try:
            place = json.loads(process.stdout.readline())
            with vd.open(place["port"]) as display:
                yield display, place["view"]
        finally:
            process.terminate()
            assert process.wait(browsers.DEADLINE_S) == 0


@pytest.fixture(scope="module")
def emulated():
    with emulator_with_view() as both:
        yield both


@pytest.fixture
def live(emulated):
    """A dark display, the URL of its view, and the number of the dark picture."""
    display, url = emulated
    show(display)
    with connect(url.replace("http", "ws") + "live") as viewer:
        lit = True
        while lit:  # a picture from before may still be on its way
            message = viewer.recv(browsers.DEADLINE_S)
            viewer.send("shown")
            head = json.loads(message[4 : int.from_bytes(message[:4], "little")])
            lit = head["digest"] != "00000000"
    return display, url, head["number"]


def show(display, *voxels, color="white"):
    frame = display.frame()
    if voxels:
        frame.draw(np.array(voxels), color)
    display.present(frame)
    return frame


def test_what_the_device_shows_is_seen(tab, live):
    display, url, first = live
    page = tab(url)
    page.wait("current()?.n === 0")
    for number, voxels in enumerate(([(0, 0, 0)], [(1, 2, 3), (2, 4, 6)], []), first + 1):
        frame = show(display, *voxels)
        page.wait(f"current().number === {number}")
        assert page.run("current().n") == len(voxels)
        page.wait(f"$('fact-Digest')?.textContent === '{frame.digest():08x} ✓'")
    assert page.run("$('state').textContent") == "live"
    assert page.requests == [url, url.replace("http", "ws") + "live"]


def test_a_picture_that_is_not_what_the_device_says_is_marked(tab, live):
    display, url, _ = live
    show(display, (1, 2, 3))
    page = tab(url)
    page.wait("current()?.n")
    page.run("current().positions[0][0] = 2, current().proved = null, updateStatus()")
    assert "✗" in page.run("$('fact-Digest').textContent")


def test_frames_are_kept_and_stepped_through(tab, live):
    display, url, first = live
    page = tab(url)
    page.wait("current()")
    for number in range(1, 5):
        show(display, (0, 0, number))
        page.wait(f"current().number === {first + number}")
    page.key(" ")
    show(display, (2, 2, 2))
    page.wait("history.length === 6")
    assert page.run("current().number") == first + 4
    page.key(",")
    page.key(",")
    assert page.run("current().number") == first + 2
    page.key(".")
    assert page.run("current().number") == first + 3
    page.key("Home")
    assert page.run("cursor") == 0
    page.key("End")
    page.wait(f"playing && current().number === {first + 5}")
    page.run("$('scrub').value = 1, $('scrub').dispatchEvent(new Event('input'))")
    assert page.run("!playing && cursor === 1")


def test_two_browsers_of_which_one_never_paints(tab, live):
    display, url, first = live
    slow = tab(url)
    slow.wait("current()")
    slow.run("window.requestAnimationFrame = () => 0, 0")
    quick = tab(url)
    quick.wait("current()")
    for number in range(1, 8):
        show(display, (0, 0, number - 1))
        quick.wait(f"current().number === {first + number}")
    assert slow.run("history.length") <= 3  # one at first, and two under way
    assert quick.run("history.length") == 8


def test_the_page_comes_back_when_the_server_does(tab, unused_port):
    where = f"127.0.0.1:{unused_port}"
    with emulator_with_view(where) as (_, url):
        page = tab(url)
        page.wait("$('state').dataset.is === 'live' && current()")
    page.wait("$('state').dataset.is === 'ended'", errors=True)
    assert page.run("$('state').hasAttribute('data-old')"), "the picture is dimmed"
    assert page.run("getComputedStyle(canvas).opacity") < "1"
    with emulator_with_view(where) as (display, _):
        show(display, (1, 1, 1))
        page.wait("$('state').dataset.is === 'live' && current()?.n === 1", errors=True)
    # Asked why while it was closing, the server may have answered.
    assert all("CONNECTION_REFUSED" in error or "426" in error for error in page.errors)
    page.errors.clear()


def test_a_page_behind_a_proxy_says_why_it_is_refused_and_how_it_is_not(tab, live):
    _, url, _ = live
    with reverse_proxy.ReverseProxy(url) as proxy:
        page = tab(proxy.url)
        page.wait("$('state').dataset.is === 'refused'", errors=True)
        origin = proxy.url.rstrip("/")
        assert page.run("$('refusal').textContent") == (
            f"pages of {origin} may not watch this display; "
            f"to allow them, start the view with --allow-origin {origin}"
        )
        assert page.run("$('refusal').checkVisibility()")
        assert page.run("document.documentElement.scrollWidth") == 1000
    assert all("403" in error for error in page.errors)
    page.errors.clear()


@pytest.mark.parametrize("keeps_host", [False, True])
def test_a_page_behind_a_proxy_is_allowed(keeps_host, tab):
    with (
        emulator_with_view("127.0.0.1:0", "--allow-origin", "*") as (display, url),
        reverse_proxy.ReverseProxy(url, keeps_host=keeps_host) as proxy,
    ):
        page = tab(proxy.url)
        show(display, (1, 2, 3))
        page.wait("$('state').dataset.is === 'live' && current()?.n === 1")
        assert page.run("$('refusal').hidden")


def test_a_proxy_that_passes_no_websocket_is_named(tab, live):
    _, url, _ = live
    with reverse_proxy.ReverseProxy(url, passes_upgrade=False, keeps_host=True) as proxy:
        page = tab(proxy.url)
        page.wait("$('state').dataset.is === 'refused'", errors=True)
        assert "must pass on the headers Upgrade" in page.run("$('refusal').textContent")
    page.errors.clear()


NGINX = """
daemon off; pid nginx.pid; error_log stderr;
events {{ }}
http {{
  access_log off;
  server {{
    listen 127.0.0.1:{port};
    location / {{
      proxy_pass {url};
      proxy_http_version 1.1;
      proxy_set_header Upgrade $http_upgrade;
      proxy_set_header Connection upgrade;
    }}
  }}
}}
"""


@pytest.mark.skipif(shutil.which("nginx") is None, reason="nginx is not installed")
def test_behind_nginx(tab, unused_port, tmp_path):
    origin = f"http://127.0.0.1:{unused_port}"
    with emulator_with_view("127.0.0.1:0", "--allow-origin", origin) as (display, url):
        (tmp_path / "nginx.conf").write_text(NGINX.format(port=unused_port, url=url))
        command = ["nginx", "-p", str(tmp_path), "-c", str(tmp_path / "nginx.conf")]
        with subprocess.Popen(command, stderr=subprocess.DEVNULL) as nginx:
            try:
                eventually(lambda: listens_at(unused_port), "nginx's start")
                page = tab(origin + "/")
                show(display, (1, 2, 3))
                page.wait("$('state').dataset.is === 'live' && current()?.n === 1")
            finally:
                nginx.terminate()


def listens_at(port):
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)):
        return True
    return False


@pytest.fixture
def unused_port():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


def test_view_reads_a_display_back(tab, emulator):
    """The command itself, on a display that another program has drawn on before."""
    sim = emulator("--tcp", "127.0.0.1:0", "--size", "3x5x7", "--refresh", "0")
    with vd.open(sim.port) as display:
        frame = show(display, (2, 3, 5), color="red")
    command = [sys.executable, "-m", "voxdisplay", "view", "--port", sim.port, "--no-open"]
    view = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT)
    try:
        page = tab(view.stdout.readline().strip())
        page.wait("current()?.n === 1")
        assert page.run("current().positions.map(p => p[0])") == [2, 3, 5]
        page.wait(f"$('fact-Digest')?.textContent === '{frame.digest():08x} ✓'")
    finally:
        view.kill()
        view.communicate()


def test_the_command_lets_an_origin_watch():
    """What `voxdisplay view` answers besides its own page, and what it refuses to start with."""
    path = "examples/paper-curve.json"
    command = [sys.executable, "-m", "voxdisplay", "view", str(path), "--no-open"]
    allowed = ["--allow-origin", "https://cube.example.com"]
    view = subprocess.Popen([*command, *allowed], stdout=subprocess.PIPE, text=True, cwd=ROOT)
    try:
        live_url = view.stdout.readline().strip().replace("http", "ws") + "live"
        with connect(live_url, origin="https://cube.example.com") as browser:
            assert browser.recv(browsers.DEADLINE_S)
        with pytest.raises(InvalidStatus), connect(live_url, origin="https://evil.example"):
            pass
    finally:
        view.kill()
        view.communicate()
    done = subprocess.run(
        [*command, "--allow-origin", "https://x/page"], capture_output=True, text=True, cwd=ROOT,
        check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert "is no origin" in done.stderr

"""A process with 1500 open files: descriptors above 1023, which ``select`` refuses."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from terminal import Terminal

import voxdisplay as vd

resource = pytest.importorskip("resource")

ROOT = Path(__file__).parents[2]
FILES = 1500
DEADLINE_S = 120
pytestmark = pytest.mark.skipif(
    0 <= resource.getrlimit(resource.RLIMIT_NOFILE)[1] < FILES + 200,
    reason="the limit of open files is too low here",
)

# What each script begins with.
CROWDED = f"""
import os, resource, sys
hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
resource.setrlimit(resource.RLIMIT_NOFILE, ({FILES + 500}, hard))
files = [os.open(os.devnull, os.O_RDONLY) for _ in range({FILES})]
sys.path.insert(0, "tests")
"""

DRAW = """
import contextlib
import numpy as np
import voxdisplay as vd
pixels = np.random.default_rng(1).integers(0, 256, (7, 5, 3, 3)).astype(np.uint8)
with vd.open(sys.argv[1]) as display:
    frame = display.frame()
    frame.set(pixels)
    receipt = display.present(frame)
    assert receipt.digest == frame.digest()
    assert np.array_equal(display.read(), pixels)
print("drawn")
"""


def crowded(script, *arguments):
    """Run a script in a process with many open files; return what it printed."""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", CROWDED + script, *arguments],
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=DEADLINE_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("kind", ["pty", "spy", "tcp", "socket", "usbip"])
def test_a_display_is_drawn_on_and_read_back(kind, emulator, tmp_path):
    where = {"pty": ["--pty"], "spy": ["--pty"], "usbip": ["--usbip", "127.0.0.1:0"]}
    sim = emulator(*where.get(kind, ["--tcp", "127.0.0.1:0"]), "--size", "3x5x7", "--refresh", "0")
    port = sim.port
    if kind == "spy":
        port = f"spy://{port}?file={tmp_path / 'traffic.txt'}"
    elif kind == "socket":
        port = port.replace("tcp:", "socket:")
    assert crowded(DRAW, port) == "drawn\n"
    if kind == "spy":
        assert "RX" in (tmp_path / "traffic.txt").read_text()


def test_rfc2217_and_the_emulator_in_process():
    script = """
from carriers import Rfc2217Server
import socket, threading
from voxdisplay.transport import open_transport
inner, outer = socket.socketpair()
server = Rfc2217Server(inner)
transport = open_transport(server.port)
transport.write(bytes(range(256)), 5)
got = b""
while len(got) < 256:
    got += outer.recv(256)
outer.sendall(got[::-1])
back = b""
while len(back) < 256:
    back += transport.read(1)
assert back == bytes(range(256))[::-1]
transport.close()
server.close()
"""
    crowded(script)
    assert crowded(DRAW, "sim:?size=3x5x7&refresh=0") == "drawn\n"


def test_ports_are_listed_and_probed():
    script = """
from voxdisplay.cli.main import main
sys.exit(main(["ports", "--probe", "--timeout", "0.3"]))
"""
    assert "voxdisplay emulator" in crowded(script)


@pytest.mark.parametrize("kind", ["--pty", "--tcp", "--usbip"])
def test_an_emulator_with_many_open_files(kind):
    run = "import runpy; runpy.run_module('firmware_sim', run_name='__main__')"
    where = [kind] if kind == "--pty" else [kind, "127.0.0.1:0"]
    command = [sys.executable, "-c", CROWDED + run, *where, "--size", "3x5x7", "--refresh", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
        try:
            with vd.open(json.loads(process.stdout.readline())["port"]) as display:
                frame = display.frame()
                frame.draw([(1, 2, 3)], "red")
                assert display.present(frame).digest == frame.digest()
        finally:
            process.terminate()
            assert process.wait(DEADLINE_S) == 0


def test_the_live_view_of_a_tap():
    """The emulator's tap and the viewer's server, each with many open files."""
    script = """
import asyncio, threading, urllib.request
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.tap import Tap
from voxdisplay.view.live.address import parse_address
from voxdisplay.view.live.server import open_server
from voxdisplay.view.live.sources import TapSource

async def serve():
    async with open_server(source, "127.0.0.1", 0) as server:
        def fetch():
            with urllib.request.urlopen(server.url + "frame.png") as answer:
                print(answer.read()[1:4].decode())
        await asyncio.to_thread(fetch)

with Tap(Device(Config((3, 5, 7), "mono1", refresh=0))) as tap:
    source = TapSource(*parse_address(tap.address), "title")
    source.check_alive()
    asyncio.run(serve())
"""
    assert crowded(script) == "PNG\n"


def test_keys_in_a_terminal(tmp_path):
    """The keyboard is /dev/tty here, opened after the others: stdin is a file."""
    scene = tmp_path / "scene.json"
    scene.write_text(json.dumps({"size": [3, 5, 7], "objects": []}))
    code = (
        CROWDED
        + """
import numpy as np
from voxdisplay.raster.grid import Grid
from voxdisplay.view.lit_voxels import LitVoxels
from voxdisplay.view.terminal import TerminalView, run
nothing = LitVoxels(np.zeros((0, 3), np.uint16), np.zeros((0, 3), np.uint8))
run(TerminalView(Grid(3, 5, 7), "crowded", lambda: nothing, changes=False))
"""
    )
    terminal = Terminal([], code=code, stdin=subprocess.DEVNULL)
    try:
        terminal.read_until(lambda text: "crowded" in text)
        terminal.press("q")
        assert terminal.finish()[0] == 0, terminal.text
    finally:
        terminal.close()

"""``voxdisplay test-pattern`` on good displays, and on one whose axes are wired wrongly."""

import json
import subprocess
import sys

import pytest
from conftest import ROOT

# The emulator, with a fault of a kind that devices have: voxel (x, y, z) of an op is put elsewhere
# in memory, while memory is read out, and its digest taken, in scan order. It knows single voxels, and neither lines nor bricks.
FAULTY = """
import sys
from firmware_sim import grid

fault = sys.argv.pop(1)
index, init = grid.Grid.index, grid.Grid.__post_init__

def wired(self, x, y, z):
    if x >= self.nx or y >= self.ny or z >= self.nz:
        return None
    return index(self, y, x, z) if fault == "swapped" else index(self, x, y, self.nz - 1 - z)

def strides(self):
    init(self)
    x, y, z = self.strides
    changed = (y, x, z) if fault == "swapped" else (x, y, -z)
    object.__setattr__(self, "strides", changed)

grid.Grid.index, grid.Grid.__post_init__ = wired, strides
grid.Grid.leaves = lambda *_: False
from firmware_sim.__main__ import main
sys.exit(main())
"""
# On cubes alone could x and y be swapped; here they may, and z differs.
SIZE = "12x12x7"


@pytest.fixture
def faulty():
    running = []

    def start(fault, *more):
        command = [sys.executable, "-c", FAULTY, fault, "--tcp", "127.0.0.1:0", "--size", SIZE]
        command += ["--features", "dots,read,digest"]
        process = subprocess.Popen([*command, *more], stdout=subprocess.PIPE, text=True, cwd=ROOT)
        running.append(process)
        return json.loads(process.stdout.readline())["port"]

    yield start
    for process in running:
        process.kill()
        process.wait()
        process.stdout.close()


@pytest.mark.parametrize(
    ("pattern", "format_"),
    [
        ("axes", "rgb888"),
        ("axes", "rgb565"),
        ("axes", "index8"),
        ("axes", "mono1"),
        ("plane", "rgb888"),
        ("plane", "mono1"),
        ("all", "index8"),
    ],
)
def test_a_good_display(run, format_, pattern):
    port = f"sim:?size=9x11x10&format={format_}&refresh=0"
    done = run("test-pattern", "--port", port, "--pattern", pattern, "--check")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "read back: all as meant" in done.stdout
    for line in ("x grows right: yes", "y grows away: yes", "z grows up: yes"):
        assert (line in done.stdout) is (pattern != "all")


def test_json(run):
    done = run(
        "test-pattern", "--port", "sim:?size=3x5x7", "--pattern", "corners", "--check", "--json"
    )
    result = json.loads(done.stdout)
    assert set(result) == {"port", "device", "pattern", "brightness_percent", "check"}
    right = {axis: {"right": True, "shown": f"+{axis}"} for axis in "xyz"}
    assert result["check"] == {"right": True, "differing_voxels": 0, "axes": right}


def test_without_a_check_nothing_is_claimed(run):
    done = run("test-pattern", "--port", "sim:?size=3x5x7", "--json")
    assert json.loads(done.stdout)["check"] is None
    assert "yes" not in run("test-pattern", "--port", "sim:?size=3x5x7").stdout


@pytest.mark.parametrize("format_", ["rgb888", "mono1"])
@pytest.mark.parametrize(
    ("fault", "lines"),
    [
        ("swapped", ["x grows right: no: swapped, it is shown along +y", "z grows up: yes"]),
        ("mirrored", ["x grows right: yes", "z grows up: no: mirrored, it is shown along -z"]),
    ],
)
def test_a_display_whose_axes_are_wired_wrongly(run, faulty, fault, lines, format_):
    port = faulty(fault, "--format", format_)
    done = run("test-pattern", "--port", port, "--check")
    assert done.returncode == 1, done.stdout + done.stderr
    assert all(line in done.stdout for line in lines), done.stdout
    assert "voxels differ" in done.stdout
    assert "Traceback" not in done.stderr


def test_its_digest_gives_it_away_even_without_a_check(run, faulty):
    done = run("test-pattern", "--port", faulty("swapped"))
    assert done.returncode == 1
    assert "digest" in done.stderr

"""``voxdisplay test-pattern`` on correct displays, and on one with swapped or mirrored axes."""

import json
import subprocess
import sys

import pytest
from conftest import ROOT

# The emulator with an addressing fault: ops write voxel (x, y, z) to another place in memory, while
# runs, read-back and digest use scan order.
FAULTY = """
import sys
from array import array
from firmware_sim.memory import Page

fault = sys.argv.pop(1)
nx, ny, nz = 12, 12, 7
plot = Page.plot

def wired(index):
    x, y, z = index % nx, index // nx % ny, index // nx // ny
    return y + nx * (x + ny * z) if fault == "swapped" else x + nx * (y + ny * (nz - 1 - z))

def fill(self, starts, count, pixel):
    self.plot([start + k for start in starts for k in range(count)], pixel)

Page.plot = lambda self, indices, pixel: plot(self, array("Q", map(wired, indices)), pixel)
Page.fill = fill
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


@pytest.mark.parametrize(
    ("fault", "lines"),
    [
        ("swapped", ["x grows right: no: swapped, it is shown along +y", "z grows up: yes"]),
        ("mirrored", ["x grows right: yes", "z grows up: no: mirrored, it is shown along -z"]),
    ],
)
def test_a_display_whose_axes_are_wired_wrongly(run, faulty, fault, lines):
    done = run("test-pattern", "--port", faulty(fault, "--format", "mono1"), "--check")
    assert done.returncode == 1, done.stdout + done.stderr
    assert all(line in done.stdout for line in lines), done.stdout
    assert "voxels differ" in done.stdout
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("fault", "line"), [("swapped", "x grows right: no"), ("mirrored", "z grows up: no")]
)
def test_a_display_of_many_colours_that_is_wired_wrongly(run, faulty, fault, line):
    """Its pattern comes by other ops than one of a single colour, by runs too perhaps."""
    done = run("test-pattern", "--port", faulty(fault), "--check")
    assert done.returncode == 1, done.stdout + done.stderr
    assert line in done.stdout
    assert "voxels differ" in done.stdout


def test_its_digest_gives_it_away_even_without_a_check(run, faulty):
    done = run("test-pattern", "--port", faulty("swapped"))
    assert done.returncode == 1
    assert "digest" in done.stderr

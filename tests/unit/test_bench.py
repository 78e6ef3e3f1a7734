"""The table of tools/bench.py runs; what it measures is not tested."""

import subprocess
import sys
from pathlib import Path

BENCH = Path(__file__).parents[2] / "tools" / "bench.py"


def test_the_table_of_curves_runs():
    command = [sys.executable, str(BENCH), "curves", "--quick", "--repeats", "1"]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "this engine" in run.stdout
    assert "bytes a voxel" in run.stdout


def test_the_table_of_bodies_runs():
    command = [sys.executable, str(BENCH), "bodies", "--quick", "--repeats", "1"]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    assert run.stdout.count("shell  this") == run.stdout.count("solid  this") == 1


def test_the_table_of_pictures_runs():
    command = [sys.executable, str(BENCH), "view", "--quick", "--repeats", "1"]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "paper curve" in run.stdout


def test_the_table_of_ports_runs():
    command = [sys.executable, str(BENCH), "ports", "--quick", "--repeats", "1"]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    ports = (
        "bare pty",
        "/dev/pts/N",
        "tcp://",
        "socket://",
        "rfc2217://",
        "usb:",
        "usbip://",
        "sim:",
    )
    for port in ports:
        assert f"\n{port} " in run.stdout


def test_the_table_of_the_link_runs():
    command = [sys.executable, str(BENCH), "link", "--quick", "--repeats", "1"]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "paper R=40 w=4" in run.stdout
    assert "framing" in run.stdout


def test_the_table_of_streams_runs():
    command = [sys.executable, str(BENCH), "stream", "--quick", "--repeats", "1"]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    assert run.stdout.count("\nhead, 8 bit ") == 2


def test_the_table_of_goodput_runs():
    command = [sys.executable, str(BENCH), "goodput", "--quick"]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    assert run.stdout.count("\n") == 3


def test_the_table_of_scale_runs():
    command = [sys.executable, str(BENCH), "scale", "--quick", "--repeats", "1"]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    for row in ("\n32^3 mono1 ", "\n48^3 rgb888 ", "\nmoving, spread "):
        assert row in run.stdout


def test_the_table_of_playing_runs():
    command = [sys.executable, str(BENCH), "play", "--quick"]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    assert run.stdout.count("\n") == 2 + 3 * (4 + 3 * 2)
    assert all(
        f"{show:<19}{kind:<10}" in run.stdout
        for show in ("rotating curve", "100 moving Beziers", "tumbling torus")
        for kind in ("object", "scene", "recording", "playlist")
    )

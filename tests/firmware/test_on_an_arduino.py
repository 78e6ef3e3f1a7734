"""The sketch for Arduino boards, compiled by the tool chain of Debian and run by libsimavr."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from c_device import COMPILER, FIRMWARE

ROOT = FIRMWARE.parent
MAKE = shutil.which("make")
THERE = (
    MAKE,
    COMPILER,
    shutil.which("avr-g++"),
    Path("/usr/share/arduino/hardware/arduino/avr/cores/arduino/main.cpp").exists() or None,
)
pytestmark = pytest.mark.skipif(
    None in THERE, reason="not all there: make, cc, avr-g++ (gcc-avr), arduino-core-avr"
)


def make(target: str, build: Path) -> None:
    subprocess.run([str(MAKE), "-s", "-C", str(FIRMWARE), target, f"BUILD={build}"], check=True)


@pytest.fixture
def uno(tmp_path: Path) -> Iterator[str]:
    """The port of an emulated Uno that runs the sketch."""
    if not Path("/usr/include/simavr/sim_avr.h").exists():
        pytest.skip("no libsimavr-dev")
    make("uno-emulated", tmp_path)
    with subprocess.Popen(
        [tmp_path / "simavr", tmp_path / "led_cube.elf"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        assert process.stdout is not None
        port = next(line for line in process.stdout if line.startswith("{"))
        yield json.loads(port)["port"]
        assert process.poll() is None, "the board has ended"
        process.terminate()


def voxdisplay(command: str, port: str, *words: str | Path) -> Any:
    done = subprocess.run(
        [sys.executable, "-m", "voxdisplay", command, "--port", port, "--no-reset", "--json"]
        + [str(word) for word in words],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads(done.stdout)


def test_the_folder_for_the_arduino_ide_has_all_that_the_sketch_needs(tmp_path: Path) -> None:
    make("sketch", tmp_path)
    names = {path.name for path in (tmp_path / "led_cube").iterdir()}
    assert {"led_cube.ino", "voxel_device_config.h", "voxel_device.h", "session.c"} <= names


def test_the_sketch_fits_an_uno_and_shows_a_scene(uno: str) -> None:
    sent = voxdisplay(
        "push", uno, "--timeout", "30", "--verify", ROOT / "examples" / "trefoil.json"
    )
    assert sent["verified"] is True
    assert sent["device"]["size"] == [8, 8, 8]


@pytest.mark.slow
def test_all_checks_of_the_kit_hold(uno: str) -> None:
    assert voxdisplay("conformance", uno, "--timeout", "5")["conforms"] is True

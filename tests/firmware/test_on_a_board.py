"""The reference device on bare Cortex-M boards, as qemu emulates them: UARTs and interrupts.

What is quick is tried on the board whose UART is quick; ``-m "arm and slow"`` is all of it on both.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from c_device import FIRMWARE, Grid
from emulated_board import BOARDS, MISSING, EmulatedBoard, FaultyLine

import voxdisplay as vd

ROOT = FIRMWARE.parent
EXAMPLES = sorted((ROOT / "examples").glob("*.json"))
QUICK, LEISURELY = BOARDS
# A busy machine may silence a board for seconds.
PATIENT = ("--timeout", "30")
MOVING = {
    "size": [9, 8, 7],
    "duration": 1,
    "fps": 8,
    "objects": [{"type": "circle", "center": [4.5, 4, "1 + 5*time"], "radius": 3}],
}
pytestmark = [
    pytest.mark.arm,
    pytest.mark.skipif(MISSING, reason="not all there: make, arm-none-eabi-gcc, qemu-system-arm"),
]
on_both = pytest.mark.parametrize(
    "name", [QUICK, pytest.param(LEISURELY, marks=pytest.mark.slow)], ids=str
)


@pytest.fixture
def board(tmp_path: Path, request: pytest.FixtureRequest, name: str) -> Iterator[EmulatedBoard]:
    """A board of the test's name, whose grid and format the test gives."""
    grid: Grid
    grid, pixel_format = request.param
    with EmulatedBoard(name, grid, pixel_format, tmp_path) as board:
        yield board


def with_display(*grid: int, pixel_format: str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("board", [(grid, pixel_format)], indirect=True, ids=["display"])


def voxdisplay(command: str, port: str, *words: str | Path) -> Any:
    """Run a command on a port; return its JSON."""
    done = subprocess.run(
        [sys.executable, "-m", "voxdisplay", command, "--port", port, "--no-reset", "--json"]
        + [str(word) for word in words],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("name", BOARDS)
@with_display(3, 5, 7, pixel_format="index8")
def test_all_checks_of_the_kit_hold(board: EmulatedBoard) -> None:
    assert voxdisplay("conformance", board.port)["conforms"] is True


@pytest.mark.parametrize("name", [LEISURELY])
@with_display(33, 31, 29, pixel_format="rgb888")
def test_pushed_scenes_are_read_back_as_they_were_sent(board: EmulatedBoard) -> None:
    for example in ("trefoil.json", "house.json", "star.json"):
        sent = voxdisplay("push", board.port, *PATIENT, "--verify", ROOT / "examples" / example)
        assert sent["verified"] is True


@pytest.mark.slow
@pytest.mark.parametrize("name", BOARDS)
@with_display(65, 63, 61, pixel_format="rgb565")
def test_every_example_is_read_back_as_it_was_sent(board: EmulatedBoard) -> None:
    for example in EXAMPLES:
        assert voxdisplay("push", board.port, *PATIENT, "--verify", example)["verified"], example


@on_both
@with_display(9, 8, 7, pixel_format="index8")
def test_a_recording_is_shown_frame_by_frame(board: EmulatedBoard, tmp_path: Path) -> None:
    scene, recording = tmp_path / "moving.json", tmp_path / "moving.vxs"
    scene.write_text(json.dumps(MOVING))
    command = [sys.executable, "-m", "voxdisplay", "record", scene, "-o", recording]
    subprocess.run([*command, "--format", "index8", "--quiet"], check=True)
    played = voxdisplay("play", board.port, *PATIENT, "--late", "delay", recording)
    assert (played["shown"], played["dropped"], played["wrong"]) == (8, 0, 0)


def noise(display: vd.Display, seed: int) -> vd.Frame:
    frame = display.frame()
    array = frame.array()
    frame.set(np.random.default_rng(seed).integers(0, 256, array.shape).astype(array.dtype))
    return frame


@on_both
@with_display(17, 9, 13, pixel_format="index8")
def test_frames_come_through_a_line_with_faults(board: EmulatedBoard) -> None:
    faults = repeated = 0
    for seed in range(4):
        with (
            FaultyLine(board.port, seed=seed, error_rate=1 / 1500) as line,
            vd.open(line.port, no_reset=True, timeout_s=20) as display,
        ):
            frame = noise(display, seed)
            repeated += display.present(frame).retransmitted
            assert np.array_equal(display.read(), frame.array())
        faults += line.faults
    assert faults > 5
    assert repeated > 0


@on_both
@with_display(33, 31, 29, pixel_format="index8")
def test_a_board_that_restarts_in_mid_frame_shows_the_whole_frame(board: EmulatedBoard) -> None:
    with (
        FaultyLine(board.port, when_sent=(9000, board.restart)) as line,
        vd.open(line.port, no_reset=True, timeout_s=20) as display,
    ):
        boot = display.info.boot
        frame = noise(display, 0)
        sent = display.present(frame).wire_bytes
        assert np.array_equal(display.read(), frame.array())
        assert display.info.boot != boot
    assert sent > 33 * 31 * 29 + 9000

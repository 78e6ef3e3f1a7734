"""The reference device on a bare Cortex-M3, as qemu emulates it: its UART, its interrupts."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from c_device import FIRMWARE, FORMATS, Grid

ROOT = FIRMWARE.parent
MAKE, COMPILER, EMULATOR = map(shutil.which, ("make", "arm-none-eabi-gcc", "qemu-system-arm"))
pytestmark = [
    pytest.mark.arm,
    pytest.mark.skipif(
        None in (MAKE, COMPILER, EMULATOR),
        reason="not all there: make, arm-none-eabi-gcc, qemu-system-arm",
    ),
]


@pytest.fixture
def board(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[str]:
    """The port of a board whose grid and format the test gives."""
    grid: Grid
    grid, pixel_format = request.param
    options = [f"-DVXD_N{axis}={side}" for axis, side in zip("XYZ", grid, strict=True)]
    options += [f"-DVXD_FORMAT={FORMATS.index(pixel_format) + 1}"]
    options += ["-DVXD_MAX_PAYLOAD=1024", "-DVXD_RING=16384"]
    make = [str(MAKE), "-s", "-C", str(FIRMWARE), "board", f"BUILD={tmp_path}"]
    subprocess.run([*make, f"OPTIONS={' '.join(options)}"], check=True)
    machine = [str(EMULATOR), "-M", "mps2-an385", "-nographic", "-monitor", "none"]
    with subprocess.Popen(
        [*machine, "-serial", "pty", "-kernel", tmp_path / "mps2-an385.elf"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        found = re.search(r"redirected to (\S+)", process.stdout.readline())
        assert found is not None
        yield found[1]
        assert process.poll() is None
        process.terminate()


def voxdisplay(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "voxdisplay", *words], capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize("board", [((3, 5, 7), "index8")], indirect=True, ids=["index8"])
def test_all_checks_of_the_kit_hold(board: str) -> None:
    done = voxdisplay("conformance", "--port", board, "--no-reset", "--json")
    assert done.returncode == 0, done.stdout + done.stderr
    assert json.loads(done.stdout)["conforms"] is True


@pytest.mark.parametrize("board", [((33, 31, 29), "rgb888")], indirect=True, ids=["rgb888"])
def test_pushed_scenes_are_read_back_as_they_were_sent(board: str) -> None:
    for example in ("trefoil.json", "house.json", "star.json"):
        done = voxdisplay(
            "push", "--port", board, "--no-reset", "--verify", str(ROOT / "examples" / example)
        )
        assert done.returncode == 0, done.stdout + done.stderr

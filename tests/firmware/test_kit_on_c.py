"""The conformance kit and pushed scenes on the reference device in C, on its own terminal."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import c_device
import pytest
from c_device import Grid, TerminalDevice, all_features, build

pytestmark = pytest.mark.skipif(c_device.COMPILER is None, reason="no C compiler (cc)")

EXAMPLES = Path(__file__).parents[2] / "examples"
NONE: frozenset[str] = frozenset()


def voxdisplay(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "voxdisplay", *words], capture_output=True, text=True, check=False
    )


SET_UPS: list[tuple[Grid, str, frozenset[str], float]] = [
    ((3, 5, 7), "index8", all_features("index8", ticks=True), 100),
    ((4, 4, 4), "mono1", all_features("mono1"), 0),
    ((300, 2, 2), "rgb565", all_features("rgb565"), 0),
    ((3, 5, 7), "rgb888", NONE, 0),
]


@pytest.mark.parametrize(
    ("grid", "pixel_format", "features", "refresh"),
    SET_UPS,
    ids=["index8-at-100-hz", "mono1", "rgb565-wide", "rgb888-without-features"],
)
def test_all_checks_of_the_kit_hold(
    grid: Grid, pixel_format: str, features: frozenset[str], refresh: float
) -> None:
    with TerminalDevice(build(grid, pixel_format, features), refresh=refresh) as port:
        done = voxdisplay("conformance", "--port", port, "--no-reset", "--json")
    assert done.returncode == 0, done.stdout + done.stderr
    assert json.loads(done.stdout)["conforms"] is True


@pytest.mark.parametrize(
    ("example", "pixel_format"),
    [
        ("trefoil.json", "rgb888"),
        ("house.json", "index8"),
        ("lissajous.json", "mono1"),
        ("sphere.json", "rgb565"),
    ],
)
def test_a_pushed_scene_is_read_back_as_it_was_sent(example: str, pixel_format: str) -> None:
    program = build((33, 31, 29), pixel_format, all_features(pixel_format))
    with TerminalDevice(program, refresh=100) as port:
        done = voxdisplay("push", "--port", port, "--no-reset", "--verify", str(EXAMPLES / example))
    assert done.returncode == 0, done.stdout + done.stderr

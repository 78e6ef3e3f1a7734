"""Hostile bytes to the reference device's core, watched by the compiler's sanitizers."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import c_device
import pytest
from c_device import FIRMWARE

MAKE = shutil.which("make")
pytestmark = pytest.mark.skipif(
    None in (c_device.COMPILER, MAKE), reason="not all there: make, a C compiler (cc)"
)


@pytest.mark.parametrize(
    "options",
    ["-DVXD_FORMAT=VXD_INDEX8 -DVXD_NX=7", "-DVXD_FORMAT=VXD_MONO1 -DVXD_NX=300 -DVXD_NY=2"],
    ids=["index8", "mono1-wide"],
)
def test_the_sanitizers_find_nothing(tmp_path: Path, options: str) -> None:
    words = [str(MAKE), "-s", "-C", str(FIRMWARE), "fuzz", f"BUILD={tmp_path}", "CLANG="]
    done = subprocess.run(
        [*words, f"OPTIONS={options}", "FUZZ=0.5 3"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    received, sent = done.stdout.split(" bytes in, ")
    assert int(received) >= 500_000
    assert int(sent.removesuffix(" bytes out\n")) > 10_000

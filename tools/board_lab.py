"""Runs the tests marked ``arm``: the reference device on bare Cortex-M boards, emulated by qemu.

    python tools/board_lab.py                      # all of them, on all boards: some minutes
    python tools/board_lab.py -k emcraft-sf2       # what comes behind goes to pytest
    python tools/board_lab.py --quick              # those that the test command runs, too

The conformance kit, every example read back, a recording, a line with faults, and a board that
restarts in mid-frame. Needs Debian's tool chain and emulator, and no root.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# Programs, and the packages that have them.
NEEDED = {
    "make": "make",
    "arm-none-eabi-gcc": "gcc-arm-none-eabi",
    "qemu-system-arm": "qemu-system-arm",
}


def main() -> int:
    """Run the tests, or say what is missing; return pytest's exit code, or 2."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="without those marked slow")
    options, pytest_arguments = parser.parse_known_args()
    missing = sorted(pack for name, pack in NEEDED.items() if shutil.which(name) is None)
    if missing:
        print("missing; as root: apt-get install --no-install-recommends " + " ".join(missing))
        return 2
    mark = "arm and not slow" if options.quick else "arm"
    command = [sys.executable, "-m", "pytest", "-m", mark, "--durations=0", *pytest_arguments]
    tests = [path for path in sorted(ROOT.glob("tests/**/test_*.py")) if _has_mark(path)]
    return subprocess.run([*command, *map(str, tests)], cwd=ROOT, check=False).returncode


def _has_mark(path: Path) -> bool:
    return "pytest.mark.arm" in path.read_text(encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())

"""All that a change must pass: format, lint, types, and the tests with their import rules.

``python tools/check.py`` runs everything, ``--fast`` what takes seconds, ``--fix`` mends what tools
can mend. Needs an environment with the extra ``dev``.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# What must be covered in all its branches: the wire and both of its ends.
COVERED = ["voxdisplay/wire", "voxdisplay/link", "firmware_sim"]
# Two processes, whatever the machine has: tests wait for other programs, which want a core, too.
# Each begins with half of the tests; who has none left takes from the other.
SHARED = ["-n", "2", "--dist", "worksteal"]


def steps(*, fast: bool, fix: bool) -> dict[str, list[str]]:
    """Give the commands, by name, as arguments to the interpreter."""
    ruff_format = ["-m", "ruff", "format"] + ([] if fix else ["--check"])
    ruff_check = ["-m", "ruff", "check"] + (["--fix"] if fix else [])
    if fast:
        tests = ["-m", "pytest", "-q", "tests/conformance", "tests/unit/test_architecture.py"]
    else:
        coverage = [f"--cov={package}" for package in COVERED]
        tests = ["-m", "pytest", *SHARED, "-m", "not slow and not kernel"]
        tests += ["--durations=25", "--cov-branch", *coverage]
        tests += ["--cov-report=term-missing:skip-covered", "--cov-fail-under=100"]
    return {
        "format": [*ruff_format, "."],
        "lint": [*ruff_check, "."],
        "types": ["-m", "mypy"],
        "tests": tests,
    }


def main() -> int:
    """Run the steps; give 0 if all passed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--fast", action="store_true", help="only what takes seconds")
    parser.add_argument("--fix", action="store_true", help="let the tools mend what they can")
    options = parser.parse_args()
    failed = []
    for name, arguments in steps(fast=options.fast, fix=options.fix).items():
        began_s = time.monotonic()
        print(f"== {name}", flush=True)
        if subprocess.run([sys.executable, *arguments], cwd=ROOT, check=False).returncode:
            failed.append(name)
        print(f"== {name}: {time.monotonic() - began_s:.1f} s", flush=True)
    print("failed: " + ", ".join(failed) if failed else "all passed")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())

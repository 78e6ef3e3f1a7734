"""All checks that a change must pass: format, lint, types, and the tests with their import rules.

``python tools/check.py`` runs everything, ``--fast`` what takes seconds, ``--fix`` mends what tools
can mend. Needs an environment with the extra ``dev``. ``--lowest``, ``--newest`` and ``--wheel``
make environments of their own and run the tests in them: with the lowest versions that
pyproject.toml declares, with the newest that there are, and with a built wheel outside the
repository; ``--smoke`` makes these quick.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
from collections.abc import Iterable, Sequence
from pathlib import Path

import environments
from environments import LOCKED, LOWEST, NEWEST, ROOT

# What must be covered in all its branches: the wire and both of its ends.
COVERED = ["voxdisplay/wire", "voxdisplay/link", "firmware_sim"]
# Two processes, whatever the machine has: tests wait for other programs, which want a core, too.
# Each begins with half of the tests; who has none left takes from the other.
SHARED = ["-n", "2", "--dist", "worksteal"]
USUAL = ["-m", "not slow and not kernel"]
PACKAGES = ["voxdisplay", "firmware_sim"]
# The tables of figures take a minute, and tell nothing of other versions.
UNIT_TESTS = ["tests/unit", "--ignore=tests/unit/test_bench.py"]


class Steps:
    """Commands that are run one after the other, and the names of those that failed."""

    def __init__(self) -> None:
        self.failed: list[str] = []

    def run(self, name: str, command: Iterable[str | Path], cwd: Path = ROOT) -> None:
        """Run a command, and note if it fails."""
        began_s = time.monotonic()
        print(f"== {name}", flush=True)
        # The packages of the environment, whatever the caller has put first.
        environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        done = subprocess.run([*map(str, command)], cwd=cwd, env=environment, check=False)
        if done.returncode:
            self.failed.append(name)
        print(f"== {name}: {time.monotonic() - began_s:.1f} s", flush=True)


def check_here(steps: Steps, *, fast: bool, fix: bool) -> None:
    """Run all checks in the environment of this interpreter."""
    ruff_format = ["-m", "ruff", "format"] + ([] if fix else ["--check"])
    ruff_check = ["-m", "ruff", "check"] + (["--fix"] if fix else [])
    if fast:
        tests = ["-m", "pytest", "-q", "tests/conformance", "tests/unit/test_architecture.py"]
    else:
        coverage = [f"--cov={package}" for package in COVERED]
        tests = ["-m", "pytest", *SHARED, *USUAL, "--durations=25", "--cov-branch", *coverage]
        tests += ["--cov-report=term-missing:skip-covered", "--cov-fail-under=100"]
    commands = {
        "format": [*ruff_format, "."],
        "lint": [*ruff_check, "."],
        "types": ["-m", "mypy"],
        "tests": tests,
    }
    for name, arguments in commands.items():
        steps.run(name, [sys.executable, *arguments])


def check_versions(
    steps: Steps, versions: str, pythons: Sequence[str], work: Path, *, smoke: bool
) -> None:
    """Run the tests with other versions of the dependencies, on each interpreter."""
    if smoke:  # the two ends of what is supported
        pythons = pythons[:1] if versions == LOWEST else pythons[-1:]
    for number, python in enumerate(pythons):
        folder = work / f"{versions}-{number}"
        interpreter = environments.make(folder, python, versions, install=["-e", "."])
        name = f"{versions} versions, {_describe(interpreter)}"
        steps.run(f"smoke: {name}", [interpreter, "tools/smoke.py", "examples"])
        steps.run(f"tests: {name}", _tests(interpreter, *(UNIT_TESTS if smoke else ["tests"])))


def check_wheel(steps: Steps, python: str, work: Path, *, smoke: bool) -> None:
    """Run commands of what is built, and the tests of the sdist on the wheel, elsewhere."""
    built = work / "dist"
    environments.run_uv("build", "--out-dir", built)
    sdist, wheel = next(built.glob("*.tar.gz")), next(built.glob("*.whl"))
    for path in (sdist, wheel):
        folder = work / path.suffix.strip(".")
        interpreter = environments.make(folder, python, LOCKED, install=[str(path)])
        steps.run(f"smoke: {path.name}", [interpreter, ROOT / "tools/smoke.py", ROOT / "examples"])
    with tarfile.open(sdist) as archive:
        archive.extractall(work / "unpacked", filter="data")
    (outside,) = (work / "unpacked").iterdir()
    for package in PACKAGES:
        shutil.rmtree(outside / package)
    tests = ["tests/cli/test_help.py", "tests/cli/test_documents.py"] if smoke else ["tests"]
    steps.run(f"tests: {wheel.name}", _tests(interpreter, *tests), cwd=outside)


def _tests(interpreter: Path, *tests: str) -> list[str | Path]:
    return [interpreter, "-m", "pytest", "-q", *SHARED, *USUAL, *tests]


def _describe(python: Path) -> str:
    code = "import platform; print('Python', platform.python_version())"
    return subprocess.check_output([python, "-c", code], text=True).strip()


def main() -> int:
    """Run the checks that are asked for; return 0 if all passed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--fast", action="store_true", help="only what takes seconds")
    parser.add_argument("--fix", action="store_true", help="let the tools mend what they can")
    parser.add_argument("--lowest", action="store_true", help="with the lowest declared versions")
    parser.add_argument("--newest", action="store_true", help="with the newest versions there are")
    parser.add_argument("--wheel", action="store_true", help="with a built wheel, outside of here")
    parser.add_argument("--smoke", action="store_true", help="of these three only what is quick")
    parser.add_argument(
        "--python", type=int, action="append", metavar="MINOR",
        help="for these three: Python 3.MINOR; default: the oldest supported and the newest found",
    )  # fmt: skip
    options = parser.parse_args()
    steps = Steps()
    if not (options.lowest or options.newest or options.wheel):
        check_here(steps, fast=options.fast, fix=options.fix)
    else:
        pythons = [_python(minor) for minor in options.python or ()] or environments.find_pythons()
        with tempfile.TemporaryDirectory(prefix="voxdisplay-") as folder:
            work = Path(folder)
            for versions, wanted in ((LOWEST, options.lowest), (NEWEST, options.newest)):
                if wanted:
                    check_versions(steps, versions, pythons, work, smoke=options.smoke)
            if options.wheel:
                check_wheel(steps, pythons[-1], work, smoke=options.smoke)
    print("failed: " + ", ".join(steps.failed) if steps.failed else "all passed")
    return bool(steps.failed)


def _python(minor: int) -> str:
    found = environments.find_python(minor)
    if found is None:
        raise SystemExit(f"Python 3.{minor} was not found")
    return found


if __name__ == "__main__":
    sys.exit(main())

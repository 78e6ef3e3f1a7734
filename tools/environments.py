"""Fresh virtual environments with the lowest, newest or locked versions of all dependencies.

Knows nothing of what is run in them.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LOCK = ROOT / "constraints.txt"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
LOWEST, NEWEST, LOCKED = "lowest", "newest", "locked"

# The oldest Python that may be asked for, and more minor versions than there will be for years.
_OLDEST = int(PROJECT["requires-python"].removeprefix(">=3."))
_MINORS = range(_OLDEST, _OLDEST + 10)


def find_python(minor: int) -> str | None:
    """Return the path of an interpreter of Python 3.``minor``, or None if there is none.

    Looks on the PATH, then among the versions of pyenv, whose commands on the PATH only work for
    the versions that are switched on.
    """
    if sys.version_info.minor == minor:
        return sys.executable
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"), "versions")
    versions = sorted(pyenv.glob(f"3.{minor}.*"), key=_release, reverse=True)
    candidates = [
        shutil.which(f"python3.{minor}"),
        *(str(path / "bin/python") for path in versions),
    ]
    return next((path for path in candidates if path and _works(path, minor)), None)


def find_pythons() -> list[str]:
    """Return the interpreters to test with: of the oldest supported Python, and of the newest."""
    found = [path for path in map(find_python, _MINORS) if path]
    if not found:
        raise SystemExit(f"no Python 3.{_OLDEST} or newer was found")
    return list(dict.fromkeys([found[0], found[-1]]))


def make(
    folder: Path, python: str, versions: str, *, install: Iterable[str], extra: str = "test"
) -> Path:
    """Make an environment in a folder; return the path of its interpreter.

    Parameters
    ----------
    folder : Path
        Is made anew.
    python : str
        Path of the interpreter.
    versions : str
        `LOWEST`: the lowest that pyproject.toml declares, as far as this Python can install it;
        `NEWEST`: the newest that there are; `LOCKED`: those of constraints.txt.
    install : iterable of str
        What to install of the project itself, as arguments of pip: a wheel, ``-e .``.
    extra : str
        The extra whose dependencies are installed.

    """
    run_uv("venv", "--python", python, "--clear", folder)
    interpreter = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    wanted = folder / "requirements.txt"
    how = {
        # Old versions without a wheel for this Python were never meant for it, and do not build.
        LOWEST: ["--resolution", "lowest-direct", "--only-binary", ":all:"],
        NEWEST: ["--upgrade", "--refresh"],
        LOCKED: ["--constraint", LOCK],
    }[versions]
    run_uv("pip", "compile", "--python", interpreter, "--extra", extra, *how,
           "--output-file", wanted, ROOT / "pyproject.toml")  # fmt: skip
    run_uv("pip", "install", "--python", interpreter, "--requirement", wanted)
    run_uv("pip", "install", "--python", interpreter, "--no-deps", *install)
    return interpreter


def run_uv(*arguments: str | Path) -> None:
    """Run uv, which the extra ``dev`` installs; leave the program if it fails."""
    command = [sys.executable, "-m", "uv", "--quiet", *map(str, arguments)]
    done = subprocess.run(command, cwd=ROOT, check=False, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}\n{done.stdout}{done.stderr}")


def _release(path: Path) -> tuple[int, ...]:
    return tuple(map(int, re.findall(r"\d+", path.name)))


def _works(python: str, minor: int) -> bool:
    code = f"import sys, venv; sys.exit(sys.version_info[:2] != (3, {minor}))"
    try:
        return not subprocess.run([python, "-c", code], capture_output=True, check=False).returncode
    except OSError:
        return False

"""Smoke test of an installed voxdisplay: import, every command's help, and the commands by name.

Run by the interpreter of an environment, in any folder: ``python smoke.py EXAMPLES``. Knows the
installed package only, never the repository.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import click

import voxdisplay as vd
from voxdisplay.cli.main import cli

TIMEOUT_S = 120


def run(program: str, *arguments: str | Path, cwd: Path) -> str:
    """Run an installed program; return what it prints, or leave with what went wrong."""
    path = shutil.which(program, path=str(Path(sys.executable).parent))
    if path is None:
        raise SystemExit(f"{program} is not installed")
    command = [path, *map(str, arguments)]
    environment = {key: value for key, value in os.environ.items() if key != "VOXDISPLAY_PORT"}
    done = subprocess.run(
        command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=TIMEOUT_S,
        check=False,
    )  # fmt: skip
    if done.returncode or "Traceback" in done.stderr:
        raise SystemExit(f"{' '.join(command)}: exit {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def main() -> None:
    """Try everything once; leave with a message if something fails."""
    examples = Path(sys.argv[1]).resolve()
    for name in vd.__all__:
        getattr(vd, name)
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        run("voxdisplay", "--version", cwd=here)
        run("voxdisplay-sim", "--help", cwd=here)
        names = cli.list_commands(click.Context(cli))
        for name in names:
            run("voxdisplay", name, "--help", cwd=here)
        curve = examples / "trefoil.json"
        run("voxdisplay", "push", curve, "--port", "sim:", "--verify", "--capture", "log", cwd=here)
        run("voxdisplay", "annotate", "log", cwd=here)
        run("voxdisplay", "preview", curve, "-o", "picture.png", cwd=here)
        run("voxdisplay", "voxelize", curve, "-o", "voxels.npy", cwd=here)
        run("voxdisplay", "conformance", "--port", "sim:?size=3x5x7", "--only", "7.1", cwd=here)
        for name in ("protocol", "schema"):
            path = Path(run("voxdisplay", name, cwd=here).strip())
            if not path.stat().st_size:
                raise SystemExit(f"{path} is empty")
    print(f"smoke: {len(names)} commands of voxdisplay {vd.__version__} work")


if __name__ == "__main__":
    main()

"""Commands whose stdin, stdout or stderr is closed, full, or not read."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import DEADLINE_S, ROOT

PUSH = "push examples/paper-curve.json --port sim:?size=3x5x7"
FULL = "No space left on device"


def shell(ends, command=PUSH):
    """Run a command with redirections in bash; return the finished process."""
    line = f"$vox {command} {ends}; exit ${{PIPESTATUS[0]}}"
    return subprocess.run(
        ["/bin/bash", "-c", line],
        env={**os.environ, "vox": f"{sys.executable} -m voxdisplay"},
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=DEADLINE_S,
        check=False,
    )


@pytest.mark.parametrize("ends", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_what_is_closed_is_not_missed(ends):
    done = shell(ends)
    assert done.returncode == 0, done.stderr
    assert "Error" not in done.stderr
    assert ("proved" in done.stdout) == (" >&-" not in f" {ends}")


def test_a_reader_that_leaves():
    for command in (PUSH, "ports"):
        done = shell("| head -c 0", command)
        assert done.returncode in {0, 2}, "2, unless all was written before it left"
        assert "Traceback" not in done.stderr
        assert "BrokenPipe" not in done.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_a_disk_that_is_full():
    for command in (PUSH, "push --help"):
        done = shell("> /dev/full", command)
        assert done.returncode == 2
        assert FULL in done.stderr
        assert "Traceback" not in done.stderr
    done = shell("> /dev/full", "view --no-open examples/paper-curve.json")
    assert (done.returncode, FULL in done.stderr) == (2, True)
    assert "listen" not in done.stderr, "the address is not to blame"
    done = shell("--capture /dev/full")
    assert (done.returncode, done.stdout) == (2, "")
    assert FULL in done.stderr
    done = shell("2> /dev/full")
    assert done.returncode == 0, "notes are not the result"
    assert "proved" in done.stdout

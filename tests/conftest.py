"""The emulator as a process of its own, and the command line as one."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

# No test asserts times: the machine may be busy.
settings.register_profile("patient", deadline=None)
settings.load_profile("patient")

ROOT = Path(__file__).parents[1]
# A shell starts what runs in the background with SIGINT ignored, and children inherit that: the
# programs that tests interrupt would not hear it.
signal.signal(signal.SIGINT, signal.default_int_handler)
# And nohup with SIGHUP ignored. What has a handler is its default again in a new program.
if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:
    signal.signal(signal.SIGHUP, lambda _number, _frame: None)
# For a program that hangs; nothing is measured by it. An emulated machine needs more patience.
DEADLINE_S = 60 * int(os.environ.get("TEST_PATIENCE", "1"))


@pytest.fixture(autouse=True)
def numpy_raises():
    """Have numpy raise in every test, as some programs do: the package must not mind."""
    with np.errstate(all="raise"):
        yield


@dataclass
class Emulator:
    """A running emulator."""

    process: subprocess.Popen
    port: str

    def stop(self):
        self.process.terminate()
        return self.process.wait(DEADLINE_S)


@pytest.fixture
def emulator():
    """Start emulators by their arguments; end them after the test."""
    running = []

    def start(*arguments):
        command = [sys.executable, "-m", "firmware_sim", *map(str, arguments)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT)
        running.append(process)
        return Emulator(process, json.loads(process.stdout.readline())["port"])

    yield start
    for process in running:
        process.kill()
        process.wait()
        process.stdout.close()


@pytest.fixture
def run():
    """Run ``voxdisplay``; return the finished process."""

    def run(*arguments, stdin="", cwd=ROOT, **environment):
        variables = {**os.environ, **environment}
        if "VOXDISPLAY_PORT" not in environment:
            variables.pop("VOXDISPLAY_PORT", None)
        return subprocess.run(
            [sys.executable, "-m", "voxdisplay", *map(str, arguments)],
            input=stdin,
            capture_output=True,
            text=True,
            cwd=cwd,
            env=variables,
            timeout=DEADLINE_S,
            check=False,
        )

    return run


@pytest.fixture
def scene(tmp_path):
    """Write a scene file; return its path."""

    def write(content, name="scene.json"):
        path = tmp_path / name
        path.write_text(content if isinstance(content, str) else json.dumps(content))
        return path

    return write

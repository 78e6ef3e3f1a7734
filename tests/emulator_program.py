"""The emulator's program, run in this process with its arguments."""

import os
from pathlib import Path

from firmware_sim import command_line

WAIT = 20  # seconds after which a test has failed; none takes so long
ROOT = Path(__file__).parents[1]


def exit_code(arguments: list[str]) -> int:
    """Run the program with a signal to stop that has come already; return its exit code."""
    stop, stopper = os.pipe()
    os.write(stopper, b"\0")
    try:
        return command_line.run(arguments, stop)
    except SystemExit as end:
        return end.code
    finally:
        os.close(stop)
        os.close(stopper)

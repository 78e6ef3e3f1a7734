"""Entry point of the command ``voxdisplay`` and of ``python -m voxdisplay``.

Importing the commands takes longer than a user needs for Ctrl-C. Nothing is open yet that would
have to be closed, so until the command line handles signals itself, SIGINT ends the process at
once, without a traceback. This module imports only what is built in before its handler is
installed.
"""

import _signal  # signal itself imports enum, and could be interrupted there
import atexit
import gc
import os
import sys

_EXIT_INTERRUPT = 130


def _exit_interrupted(*_signal_and_frame: object) -> None:
    os.write(2, b"interrupted\n")
    os._exit(_EXIT_INTERRUPT)


def main() -> int:
    """Run the command line and return its exit code."""
    # At exit the interpreter searches all that was loaded for cycles, 1/20 of a short push. The
    # process ends anyway, and whatever has to be closed is closed by its `with` block.
    atexit.register(gc.freeze)
    handled = _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler
    if handled:  # it is ignored in a background job of a script, and stays so
        _signal.signal(_signal.SIGINT, _exit_interrupted)
    from voxdisplay.cli import main as run_command  # noqa: PLC0415 - behind the handler

    if handled:
        _signal.signal(_signal.SIGINT, _signal.default_int_handler)
    return run_command()


if __name__ == "__main__":
    sys.exit(main())

"""The command ``voxdisplay``, from its first moment on: what must be there before it is imported.

Importing takes longer than a person needs for Ctrl-C, and nothing is open yet that would have to be
closed: so until the command itself can be interrupted, it ends at once, without a traceback.
"""

import _signal  # what signal is made of: that itself would import enum, and be interrupted there
import os
import sys

_EXIT_INTERRUPT = 130


def _leave(*_told: object) -> None:
    os.write(2, b"interrupted\n")
    os._exit(_EXIT_INTERRUPT)


def main() -> int:
    """Run the command line; give its exit code."""
    usual = _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler
    if usual:  # and not ignored, as it is for a job in the background of a script
        _signal.signal(_signal.SIGINT, _leave)
    from voxdisplay.cli import main as command  # noqa: PLC0415 - that is the point

    if usual:
        _signal.signal(_signal.SIGINT, _signal.default_int_handler)
    return command()


if __name__ == "__main__":
    sys.exit(main())

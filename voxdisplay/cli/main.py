"""The command ``voxdisplay``, and what its exit codes mean."""

from __future__ import annotations

import sys
import traceback
from typing import Final

import click

from voxdisplay import __version__
from voxdisplay.cli.conformance import conformance
from voxdisplay.cli.device_commands import clear, info, read
from voxdisplay.cli.output import (
    note,
    open_missing_streams,
)
from voxdisplay.cli.plan import plan_command
from voxdisplay.cli.ports import ports
from voxdisplay.cli.preview import preview
from voxdisplay.cli.push import push
from voxdisplay.cli.signals import (
    TerminationSignal,
    raise_termination_signals,
    report_termination,
)
from voxdisplay.cli.test_pattern import test_pattern
from voxdisplay.cli.view import view
from voxdisplay.cli.voxelize import voxelize
from voxdisplay.errors import (
    CurveError,
    MissingExtra,
    ProtocolError,
    SceneError,
    TransportError,
    VoxDisplayError,
)

EXIT_REFUSED: Final = 1
EXIT_USAGE: Final = 2
EXIT_PIPE: Final = 3
EXIT_PROTOCOL: Final = 4
EXIT_INTERNAL: Final = 70

_EXIT_CODES: tuple[tuple[type[VoxDisplayError], int], ...] = (
    (SceneError, EXIT_USAGE),
    (CurveError, EXIT_USAGE),
    (MissingExtra, EXIT_USAGE),
    (TransportError, EXIT_PIPE),
    (ProtocolError, EXIT_PROTOCOL),
    (VoxDisplayError, EXIT_REFUSED),
)


@click.group(
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="""Exit codes: 0 done; 1 the device refused, or shows something else; 2 usage or scene;
    3 the port; 4 the device broke the protocol; 70 a fault of this program; 130 interrupted;
    143 ended by SIGTERM; 129 the terminal was closed.

    Shell completion: eval "$(_VOXDISPLAY_COMPLETE=bash_source voxdisplay)", likewise zsh_source
    and fish_source.""",
)
@click.version_option(__version__, prog_name="voxdisplay")
@click.option("--debug", is_flag=True, help="Show a traceback with an error.")
def cli(*, debug: bool) -> None:
    """Draw on a volumetric display.

    \b
    voxdisplay push examples/paper-curve.json                      the built-in emulator
    voxdisplay push examples/paper-curve.json --port /dev/ttyUSB0  a display
    """  # noqa: D301 - \b keeps click from filling the lines
    del debug  # read where errors are caught


_SHOW = (push, preview, view, test_pattern, clear)
_ASK = (voxelize, plan_command, info, ports, read, conformance)
for command in (*_SHOW, *_ASK):
    cli.add_command(command)


def main(arguments: list[str] | None = None) -> int:
    """Run a command line; give its exit code."""
    arguments = sys.argv[1:] if arguments is None else arguments
    debug = "--debug" in arguments
    open_missing_streams()
    try:
        with raise_termination_signals():
            # A command that ends by click's Exit gives its code; all others give nothing.
            ended = cli.main(arguments, prog_name="voxdisplay", standalone_mode=False)
    except click.ClickException as error:
        error.show()
        return EXIT_USAGE
    except (click.Abort, KeyboardInterrupt, TerminationSignal) as why:
        return report_termination(why)
    except SystemExit as left:  # click's answer to a reader that has left, and to completion
        return EXIT_USAGE if left.code else 0
    except VoxDisplayError as error:
        if debug:
            traceback.print_exc()
        note(f"voxdisplay: {error}")
        if error.hint:
            note(f"  {error.hint}")
        return next(code for kind, code in _EXIT_CODES if isinstance(error, kind))
    except OSError as error:  # a pipe's are TransportErrors: what is left is our own output
        note(f"voxdisplay: the output cannot be written: {error.strerror}")
        return EXIT_USAGE
    except Exception as error:  # noqa: BLE001 - a fault of ours, and no excuse for a traceback
        if debug:
            traceback.print_exc()
        return _unforeseen(error)
    return ended if isinstance(ended, int) else 0


def _unforeseen(error: Exception) -> int:
    """Say what nobody has foreseen; give the exit code."""
    if isinstance(error, MemoryError):
        note(f"voxdisplay: there is not enough memory: {error}")
        note("  take a smaller size, or draw less")
        return EXIT_USAGE
    note(f"voxdisplay: a fault of this program: {type(error).__name__}: {error}")
    note("  please report it with what voxdisplay --debug ... prints")
    return EXIT_INTERNAL


if __name__ == "__main__":
    sys.exit(main())

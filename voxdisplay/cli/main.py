"""The command ``voxdisplay``: dispatch, errors and exit codes."""

from __future__ import annotations

import io
import os
import sys
from typing import Final

import click

from voxdisplay.cli.command_table import LazyGroup
from voxdisplay.cli.output import open_streams, print_stderr, print_stdout
from voxdisplay.cli.signals import (
    TerminationSignal,
    raise_termination_signals,
    report_termination,
)
from voxdisplay.errors import (
    BodyError,
    CurveError,
    MissingExtra,
    ProfileError,
    ProtocolError,
    RecordingError,
    SceneError,
    TransportError,
    VoxDisplayError,
    did_you_mean,
)

EXIT_REFUSED: Final = 1
EXIT_USAGE: Final = 2
EXIT_PIPE: Final = 3
EXIT_PROTOCOL: Final = 4
EXIT_INTERNAL: Final = 70

_EXIT_CODES: tuple[tuple[type[VoxDisplayError], int], ...] = (
    (SceneError, EXIT_USAGE),
    (CurveError, EXIT_USAGE),
    (BodyError, EXIT_USAGE),
    (RecordingError, EXIT_USAGE),
    (ProfileError, EXIT_USAGE),
    (MissingExtra, EXIT_USAGE),
    (TransportError, EXIT_PIPE),
    (ProtocolError, EXIT_PROTOCOL),
    (VoxDisplayError, EXIT_REFUSED),
)


def _print_version(context: click.Context, _parameter: click.Parameter, value: bool) -> None:
    if value and not context.resilient_parsing:
        from voxdisplay import __version__  # noqa: PLC0415 - reads the package's metadata

        print_stdout(f"voxdisplay, version {__version__}")
        context.exit()


@click.group(
    cls=LazyGroup,
    invoke_without_command=True,
    subcommand_metavar="COMMAND [ARGS]...",
    context_settings={"help_option_names": ["--help", "-h"], "max_content_width": 100},
    epilog="""Exit codes: 0 done; 1 the device refused, or shows something else; 2 usage or scene;
    3 the port; 4 the device broke the protocol; 70 a fault of this program; 130 interrupted;
    143 ended by SIGTERM; 129 the terminal was closed.

    \b
    Shell completion, for the start-up file of the shell:
      bash  eval "$(_VOXDISPLAY_COMPLETE=bash_source voxdisplay)"
      zsh   eval "$(_VOXDISPLAY_COMPLETE=zsh_source voxdisplay)"
      fish  _VOXDISPLAY_COMPLETE=fish_source voxdisplay | source
    """,
)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_version,
    help="Show the version and exit.",
)
@click.option("--debug", is_flag=True, help="Show a traceback with an error.")
@click.pass_context
def cli(context: click.Context, *, debug: bool) -> None:
    """Draw on a volumetric display.

    \b
    Examples:
      voxdisplay push curve.json                      on the built-in emulator
      voxdisplay push curve.json --port /dev/ttyUSB0  on a display
      voxdisplay push --help                          options and examples of push
    """  # noqa: D301 - \b keeps click from filling the lines
    del debug  # read where errors are caught
    if context.invoked_subcommand is None:
        print_stderr(context.get_help())
        context.exit(EXIT_USAGE)


def main(arguments: list[str] | None = None) -> int:
    """Run a command line and return its exit code."""
    arguments = sys.argv[1:] if arguments is None else arguments
    open_streams()
    if os.environ.get("_VOXDISPLAY_COMPLETE", "").startswith("fish_"):
        from voxdisplay.cli import fish_completion  # noqa: PLC0415 - only for completion

        fish_completion.register()
    try:
        with raise_termination_signals():
            # A command that ends by click's Exit returns its code; all others return None.
            ended = cli.main(arguments, prog_name="voxdisplay", standalone_mode=False)
    except click.ClickException as usage_error:
        _print_usage_error(usage_error)
        return EXIT_USAGE
    except (click.Abort, KeyboardInterrupt, TerminationSignal) as cause:
        return report_termination(cause)
    except SystemExit as ended_by_click:  # a reader that has left, or completion
        return EXIT_USAGE if ended_by_click.code else 0
    except Exception as failure:  # noqa: BLE001 - no error ends in a traceback
        if "--debug" in arguments:
            import traceback  # noqa: PLC0415 - takes time to load

            traceback.print_exc()
        return _report_error(failure)
    return ended if isinstance(ended, int) else 0


def _print_usage_error(failure: click.ClickException) -> None:
    if isinstance(failure, click.NoSuchOption):  # whose text differs from release to release
        hint = did_you_mean(failure.option_name, failure.possibilities or ())
        text = f"no such option: {failure.option_name!r}" + (f"; {hint}" if hint else "")
        failure = click.UsageError(text, failure.ctx)
    shown = io.StringIO()
    failure.show(shown)
    print_stderr(shown.getvalue().removesuffix("\n"))


def _report_error(failure: Exception) -> int:
    """Print an error with its hint and return the exit code."""
    match failure:
        case VoxDisplayError():
            text, hint = str(failure), failure.hint
            code = next(code for kind, code in _EXIT_CODES if isinstance(failure, kind))
        case OSError():  # a pipe's are TransportErrors: what is left is our own output
            text, hint = f"the output cannot be written: {failure.strerror}", None
            code = EXIT_USAGE
        case MemoryError():
            text = f"there is not enough memory: {failure}"
            hint, code = "take a smaller size, or draw less", EXIT_USAGE
        case _:
            text = f"a fault of this program: {type(failure).__name__}: {failure}"
            hint = "please report it with what voxdisplay --debug ... prints"
            code = EXIT_INTERNAL
    print_stderr(f"voxdisplay: {text}")
    if hint:
        print_stderr(f"  {hint}")
    return code


if __name__ == "__main__":
    sys.exit(main())

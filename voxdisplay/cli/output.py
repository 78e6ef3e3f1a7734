"""Output of the commands: results to stdout, notes and progress bars to stderr.

Nothing that is printed can fail for the characters that a stream's encoding lacks: they are
escaped with a backslash.
"""

from __future__ import annotations

import contextlib
import errno
import io
import json
import os
import sys
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Final, TextIO

import click

from voxdisplay.printable_text import printable_lines

if TYPE_CHECKING:
    from voxdisplay.display.device_info import DeviceInfo

_QUIET: Final = "voxdisplay.cli.quiet"


def open_streams() -> None:
    """Prepare stdin, stdout and stderr.

    A stream that the program was started without is opened on the null device: else a port would
    get the number of stderr. Characters that the encoding lacks are written as escapes.
    """
    while (null := os.open(os.devnull, os.O_RDWR)) <= 2:  # the lowest number that is free
        continue
    os.close(null)
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: PTH123, SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def set_quiet(context: click.Context) -> None:
    """Make `note` and `progress_bar` silent for the command of a context."""
    context.meta[_QUIET] = True


def is_quiet() -> bool:
    """Return whether the command that runs was given ``--quiet``."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.meta.get(_QUIET))


def print_stdout(text: str) -> None:
    """Print lines to stdout."""
    _write(sys.stdout, text)


def note(text: str) -> None:
    """Print a line to stderr, unless the command is quiet."""
    if not is_quiet():
        print_stderr(text)


def print_stderr(text: str) -> None:
    """Print lines to stderr, if it can still be written; what they quote is made printable."""
    print_drawing(printable_lines(text))


def print_drawing(text: str) -> None:
    """Print text of our own to stderr, escape sequences included, if it can still be written."""
    try:
        _write(sys.stderr, text)
    except OSError as failure:
        # What Python flushes at its end then goes to the null device, without a complaint: of a
        # closed terminal all, of a full disk only what was to be printed here.
        lost = (sys.stdout, sys.stderr) if failure.errno == errno.EIO else (sys.stderr,)
        for stream in lost:
            redirect_to_null(stream)


def _write(stream: TextIO, text: str) -> None:
    # Not click.echo: it takes another encoding than the stream's where that is ASCII.
    stream.write(text + "\n")
    stream.flush()


def redirect_to_null(stream: TextIO) -> None:
    """Send what is left in a stream's buffer, and all that follows, to the null device."""
    null = os.open(os.devnull, os.O_WRONLY)
    with contextlib.suppress(OSError, ValueError):
        os.dup2(null, stream.fileno())
    os.close(null)


def print_json(result: dict[str, Any]) -> None:
    """Print the result of a command as one JSON object."""
    print_stdout(json.dumps(result, allow_nan=False))


def device_json(info: DeviceInfo) -> dict[str, Any]:
    """Return the keys of a device that several commands print."""
    return {
        "size": list(info.grid),
        "format": info.format.value,
        "protocol": info.protocol,
        "firmware": info.firmware,
    }


def plural(count: int, noun: str) -> str:
    """Return a count with its noun: "1 voxel", "2 voxels"."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}".replace(",", " ")


@contextlib.contextmanager
def progress_bar(label: str) -> Iterator[Callable[[int, int], None] | None]:
    """Show a bar on a terminal, once there is more than one step to wait for.

    Yields
    ------
    callable or None
        Takes the steps done and their total; None if nothing is shown.

    """
    stream = sys.stderr
    if is_quiet() or not stream.isatty():
        yield None
        return
    with contextlib.ExitStack() as stack:
        bar: Any = None

        def update(done: int, total: int) -> None:
            nonlocal bar
            if bar is None and total > 1:
                shown = click.progressbar(length=total, label=label, file=stream)
                bar = stack.enter_context(shown)
            if bar is not None:
                bar.length = total
                bar.update(done - bar.pos)

        yield update

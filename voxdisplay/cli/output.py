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
    from voxdisplay.display.display import Display
    from voxdisplay.display.receipt import Receipt

EXIT_LOST: Final = 3  # as of a port that fails
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


def parts_json(display: Display, receipt: Receipt | None = None) -> dict[str, Any]:
    """Return the key of a display that is made of several; none for any other.

    Parameters
    ----------
    display : Display
    receipt : Receipt, optional
        Of a frame, of which each part is told what became of its share.

    """
    if not display.parts:
        return {}
    found = [part.as_json() for part in display.parts]
    for entry, part in zip(found, getattr(receipt, "parts", ()), strict=False):
        entry.update(_receipt_json(part.receipt))
    skew_s = getattr(receipt, "skew_s", None)
    return {"parts": found} | ({} if skew_s is None else {"skew_s": round(skew_s, 6)})


def _receipt_json(receipt: Receipt | None) -> dict[str, Any]:
    if receipt is None:
        return {"shown": False}
    return {
        "shown": True,
        "voxels": receipt.voxels,
        "packets": receipt.packets,
        "wire_bytes": receipt.wire_bytes,
        "retransmitted": receipt.retransmitted,
        "elapsed_s": round(receipt.elapsed_s, 6),
        "digest": None if receipt.digest is None else f"{receipt.digest:08x}",
    }


def exit_if_lost(display: Display) -> None:
    """End the command with the exit code of a port if a part of the display is lost."""
    lost = [part.profile.name for part in display.parts if part.state == "lost"]
    if lost:
        print_stderr(f"voxdisplay: lost, and not shown there: {', '.join(lost)}")
        raise click.exceptions.Exit(EXIT_LOST)


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

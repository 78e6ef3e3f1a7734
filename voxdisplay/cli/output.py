"""Standard streams of the commands: notes on stderr, JSON on stdout, progress bars.

Results go to stdout, everything else to stderr.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import sys
from collections.abc import Callable, Iterator
from typing import Any

import click

import voxdisplay as vd


def note(text: str) -> None:
    """Print a line to stderr, if it is still open."""
    try:
        click.echo(text, err=True)
    except OSError as error:
        # What Python would flush at its end goes nowhere, without complaint: with the terminal
        # everything, but with a disk that is full only what was to be said.
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for stream in (sys.stdout, sys.stderr) if error.errno == errno.EIO else (sys.stderr,):
            with contextlib.suppress(OSError, ValueError):
                os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def print_json(result: dict[str, Any]) -> None:
    """Print the result for a script."""
    click.echo(json.dumps(result, allow_nan=False))


def device_json(info: vd.DeviceInfo) -> dict[str, Any]:
    """Give what a script wants to know of a device."""
    return {
        "size": list(info.grid),
        "format": info.format.value,
        "protocol": info.protocol,
        "firmware": info.firmware,
    }


def plural(count: int, thing: str) -> str:
    """Write a count: "1 voxel", "2 voxels"."""
    return f"{count:,} {thing}{'' if count == 1 else 's'}".replace(",", " ")


@contextlib.contextmanager
def progress_bar(what: str, *, hidden: bool = False) -> Iterator[Callable[[int, int], None] | None]:
    """Show a bar on a terminal, once there is more than one step to wait for."""
    stream = sys.stderr
    if hidden or not stream.isatty():
        yield None
        return
    with click.progressbar(length=1, label=what, file=stream) as bar:
        bar.hidden = True

        def update(done: int, total: int) -> None:
            bar.length, bar.hidden = total, total <= 1
            bar.update(done - bar.pos)

        yield update


def open_missing_streams() -> None:
    """Open what the program was started without: a port must not get the number of stderr."""
    while (nowhere := os.open(os.devnull, os.O_RDWR)) <= 2:  # the lowest that is free
        continue
    os.close(nowhere)
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: PTH123, SIM115

"""How a command ends that is told to: by Ctrl-C, SIGTERM, or a terminal that is closed.

Whatever it does then, it unwinds: the port is closed, and the picture is what ``--on-exit`` says.
"""

from __future__ import annotations

import contextlib
import errno
import os
import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType
from typing import Any, Final, Literal

import click

import voxdisplay as vd

OnExit = Literal["keep", "blank"]
EXIT_INTERRUPT: Final = 130
_WORDS: Final = {"SIGTERM": "terminated", "SIGHUP": "the terminal was closed"}

on_exit_option = click.option(
    "--on-exit",
    type=click.Choice(["keep", "blank"]),
    default="keep",
    show_default=True,
    help="What the display shows when the command is ended by Ctrl-C, SIGTERM or a closed "
    "terminal: its last whole picture, or nothing.",
)


class EndedError(BaseException):
    """A signal asked the program to end. Like `KeyboardInterrupt`, it is nobody's error."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.exit_code = 128 + number
        self.word = _WORDS[signal.Signals(number).name]


@contextlib.contextmanager
def ended_by_signals() -> Iterator[None]:
    """Have signals raise `EndedError`, but those that are ignored, as under nohup."""

    def end(number: int, _frame: FrameType | None) -> None:
        raise EndedError(number)

    before: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():
        for name in _WORDS:
            number = getattr(signal, name, None)  # not every system has all
            if number is not None and signal.getsignal(number) is signal.SIG_DFL:
                before[number] = signal.signal(number, end)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def leaving(display: vd.Display, on_exit: OnExit) -> Iterator[None]:
    """Close the display, as ``--on-exit`` says if the program is told to end."""
    try:
        yield
    except (KeyboardInterrupt, EndedError):
        say(_leave(display, on_exit))
        raise
    finally:
        display.close()


def _leave(display: vd.Display, on_exit: OnExit) -> str:
    if on_exit == "keep":
        return "the display keeps its last whole picture"
    try:
        display.close(blank=True)
    except vd.VoxDisplayError as error:
        return f"the display could not be made dark: {error}"
    return "the display is dark"


def told_to_end(why: BaseException) -> int:
    """Say why a command has ended before it was done; give the exit code."""
    if isinstance(why, EndedError):
        say(why.word)
        return why.exit_code
    say("interrupted")
    return EXIT_INTERRUPT


def say(text: str) -> None:
    """Tell a person something, if there still is one."""
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


def have_streams() -> None:
    """Open what the program was started without: a port must not get the number of stderr."""
    while (nowhere := os.open(os.devnull, os.O_RDWR)) <= 2:  # the lowest that is free
        continue
    os.close(nowhere)
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: PTH123, SIM115

"""How a command ends that is told to: by Ctrl-C, SIGTERM, or a terminal that is closed.

Whatever it does then, it unwinds: the port is closed, and the picture is what ``--on-exit`` says.
"""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType
from typing import Any, Final, Literal

import click

import voxdisplay as vd
from voxdisplay.cli.output import note

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


class TerminationSignal(BaseException):
    """A signal asked the program to end. Like `KeyboardInterrupt`, it is nobody's error."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.exit_code = 128 + number
        self.word = _WORDS[signal.Signals(number).name]


@contextlib.contextmanager
def raise_termination_signals() -> Iterator[None]:
    """Have signals raise `TerminationSignal`, but those that are ignored, as under nohup."""

    def end(number: int, _frame: FrameType | None) -> None:
        raise TerminationSignal(number)

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
def close_on_exit(display: vd.Display, on_exit: OnExit) -> Iterator[None]:
    """Close the display, as ``--on-exit`` says if the program is told to end."""
    try:
        yield
    except (KeyboardInterrupt, TerminationSignal):
        note(_close_as_chosen(display, on_exit))
        raise
    finally:
        display.close()


def _close_as_chosen(display: vd.Display, on_exit: OnExit) -> str:
    if on_exit == "keep":
        return "the display keeps its last whole picture"
    try:
        display.close(blank=True)
    except vd.VoxDisplayError as error:
        return f"the display could not be made dark: {error}"
    return "the display is dark"


def report_termination(why: BaseException) -> int:
    """Say why a command has ended before it was done; give the exit code."""
    if isinstance(why, TerminationSignal):
        note(why.word)
        return why.exit_code
    note("interrupted")
    return EXIT_INTERRUPT

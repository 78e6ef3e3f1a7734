"""Signal handling and clean shutdown of commands.

Ctrl-C, SIGTERM and SIGHUP unwind a command: the port is closed, and ``--on-exit`` chooses the last
picture.
"""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType
from typing import TYPE_CHECKING, Any, Final, Literal

from voxdisplay.cli.output import note, print_stderr
from voxdisplay.errors import VoxDisplayError

if TYPE_CHECKING:
    from voxdisplay.display.display import Display

OnExit = Literal["keep", "blank"]
EXIT_INTERRUPT: Final = 130
_REASONS: Final = {"SIGTERM": "terminated", "SIGHUP": "the terminal was closed"}


class TerminationSignal(BaseException):
    """A signal asked the program to end. Like `KeyboardInterrupt`, it is no error.

    Parameters
    ----------
    number : int
        The signal.

    """

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.exit_code = 128 + number
        self.reason = _REASONS[signal.Signals(number).name]


@contextlib.contextmanager
def raise_termination_signals() -> Iterator[None]:
    """Have signals raise `TerminationSignal`, except those that are ignored, as under nohup."""

    def terminate(number: int, _frame: FrameType | None) -> None:
        raise TerminationSignal(number)

    before: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():
        for name in _REASONS:
            number = getattr(signal, name, None)  # not every system has all
            if number is not None and signal.getsignal(number) is signal.SIG_DFL:
                before[number] = signal.signal(number, terminate)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def close_on_exit(display: Display, on_exit: OnExit) -> Iterator[None]:
    """Close the display; after a signal, with the picture that ``--on-exit`` chooses."""
    try:
        yield
    except (KeyboardInterrupt, TerminationSignal):
        _close_as_chosen(display, on_exit)
        raise
    except BaseException:
        display.close(flush=False)
        raise
    else:
        display.close()


def _close_as_chosen(display: Display, on_exit: OnExit) -> None:
    if on_exit == "keep":
        display.close(flush=False)
        note("the display keeps its last whole picture")
        return
    try:
        display.close(blank=True)
    except VoxDisplayError as failure:
        print_stderr(f"the display could not be made dark: {failure}")
    else:
        note("the display is dark")


def report_termination(cause: BaseException) -> int:
    """Print why a command has ended before it was done; return the exit code."""
    if isinstance(cause, TerminationSignal):
        print_stderr(cause.reason)
        return cause.exit_code
    print_stderr("interrupted")
    return EXIT_INTERRUPT

"""Keys of the terminal that a command runs on, read without waiting."""

from __future__ import annotations

import contextlib
import os
import re
import select
import sys
from collections.abc import Iterator

_KEY = re.compile(rb"\x1b[\[O][0-9;]*[A-Za-z~]|.", re.DOTALL)


class Keyboard:
    """Keys that were pressed.

    Parameters
    ----------
    descriptor : int or None
        Of a terminal that is read key by key; None: there is no terminal.

    """

    def __init__(self, descriptor: int | None) -> None:
        self._descriptor = descriptor

    def pressed(self) -> list[bytes]:
        """Return the keys since the last call, each as the terminal sends it."""
        if self._descriptor is None or not select.select([self._descriptor], [], [], 0)[0]:
            return []
        with contextlib.suppress(OSError):
            if data := os.read(self._descriptor, 1024):
                return _KEY.findall(data)
        self._descriptor = None  # the terminal is gone
        return []


@contextlib.contextmanager
def open_keyboard() -> Iterator[Keyboard]:
    """Yield the keyboard of the terminal on stdin, without echo; restore it."""
    try:
        import termios  # noqa: PLC0415 - not on every system
        import tty  # noqa: PLC0415
    except ModuleNotFoundError:
        yield Keyboard(None)
        return
    descriptor = sys.stdin.fileno()
    # Only the program in the foreground may change the terminal: in the background it would stop.
    if not sys.stdin.isatty() or os.getpgrp() != os.tcgetpgrp(descriptor):
        yield Keyboard(None)
        return
    before = termios.tcgetattr(descriptor)
    try:
        tty.setcbreak(descriptor)
        yield Keyboard(descriptor)
    finally:
        with contextlib.suppress(termios.error):  # when the terminal is gone
            termios.tcsetattr(descriptor, termios.TCSAFLUSH, before)

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
    try:
        descriptor = sys.stdin.fileno()
        # Only the program in the foreground may change the terminal: else it would be stopped.
        usable = os.isatty(descriptor) and os.getpgrp() == os.tcgetpgrp(descriptor)
        before = termios.tcgetattr(descriptor) if usable else None
    except (AttributeError, OSError, ValueError, termios.error):  # stdin is None, closed or no file
        before = None
    if before is None:
        yield Keyboard(None)
        return
    try:
        tty.setcbreak(descriptor)
        yield Keyboard(descriptor)
    finally:
        with contextlib.suppress(termios.error):  # when the terminal is gone
            termios.tcsetattr(descriptor, termios.TCSAFLUSH, before)

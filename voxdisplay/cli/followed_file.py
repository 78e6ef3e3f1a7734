"""A file that a command follows: whether it was saved, and what is said when it cannot be read."""

from __future__ import annotations

import os
import stat
import threading
from collections.abc import Callable
from typing import Final

import click

import voxdisplay as vd
from voxdisplay.cli.output import print_stderr

POLL_S: Final = 0.2
"""How often a file is looked at, in seconds."""
READ_ERRORS: Final = (vd.VoxDisplayError, OSError, MemoryError, click.UsageError)
"""What reading and drawing a file that was saved half-written may raise."""


class FollowedFile:
    """A file that others save.

    Parameters
    ----------
    path : str
        ``-`` and what is no regular file never change.

    """

    def __init__(self, path: str) -> None:
        self._path = path
        self._read = self._seen = self._signature()

    def _signature(self) -> tuple[int, int, int] | None:
        """Return what changes when it is saved; None if there is nothing to be read."""
        try:
            found = os.stat(self._path)  # noqa: PTH116 - one call, without an object
        except (OSError, ValueError):
            return None
        if not stat.S_ISREG(found.st_mode):
            return None
        return found.st_mtime_ns, found.st_size, found.st_ino

    def saved(self) -> bool:
        """Return whether it was saved since it was read last, and has come to rest.

        At rest is what looks as it did at the call before: ask at intervals of `POLL_S`.
        """
        now = self._signature()
        at_rest, self._seen = now == self._seen, now
        if now in {None, self._read} or not at_rest:
            return False
        self._read = now
        return True

    def follow(self, act: Callable[[], object], until: threading.Event) -> None:
        """Act whenever the file was saved, until an event; errors are printed, and waited out."""
        while not until.wait(POLL_S):
            if self.saved():
                try:
                    act()
                except READ_ERRORS as error:
                    print_failure(error)


def failure_text(error: BaseException) -> str:
    """Return what is said of an error in a file that is followed."""
    return f"{error}; the last picture stays until the file is saved again"


def print_failure(error: BaseException) -> None:
    """Print what is said of an error in a file that is followed."""
    print_stderr(f"voxdisplay: {failure_text(error)}")

"""Waiting on one descriptor with a deadline, whatever its number.

``select.select`` takes no descriptor above 1023, and a process that is not fresh has such ones.
Knows no port.
"""

from __future__ import annotations

import selectors
import sys
from typing import Final


def _selector_class() -> type[selectors.BaseSelector]:
    """Return the selector for ttys and sockets alike, that holds no descriptor where it can.

    An epoll or kqueue descriptor would be shared after a fork. On macOS only kqueue waits on ttys.
    """
    if sys.platform == "darwin":
        return selectors.DefaultSelector
    return getattr(selectors, "PollSelector", selectors.DefaultSelector)


_SELECTOR: Final = _selector_class()


class Readiness:
    """Waits until a descriptor can be read or written.

    A descriptor that is closed, or whose other end is, counts as ready: the call that follows says
    what is wrong.

    Parameters
    ----------
    descriptor : int

    """

    def __init__(self, descriptor: int) -> None:
        self._readable, self._writable = _SELECTOR(), _SELECTOR()
        self._readable.register(descriptor, selectors.EVENT_READ)
        self._writable.register(descriptor, selectors.EVENT_WRITE)

    def readable(self, timeout_s: float) -> bool:
        """Wait for at most so long; return True if there is something to read."""
        return bool(self._readable.select(max(timeout_s, 0.0)))

    def writable(self, timeout_s: float) -> bool:
        """Wait for at most so long; return True if something can be written."""
        return bool(self._writable.select(max(timeout_s, 0.0)))

    def close(self) -> None:
        """Release the selectors; the descriptor stays open. Twice is fine."""
        self._readable.close()
        self._writable.close()

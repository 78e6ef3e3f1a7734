"""Re-entrant lock whose waiters are not overtaken by the thread that releases it.

With a plain lock a thread that presents in a loop would have it again before any other wakes up.
"""

from __future__ import annotations

import threading
import time
from types import TracebackType
from typing import Self


class FairLock:
    """Re-entrant lock: of the threads that want it, each has it in turn."""

    def __init__(self) -> None:
        # Re-entrant itself, so that an interrupt in `acquire` never locks its own thread out.
        self._lock = threading.RLock()
        # Held by the thread whose turn is next. Re-entrant for a signal handler or a finaliser that
        # runs while that thread waits, and uses the display.
        self._next = threading.RLock()
        self._owner: int | None = None
        self._depth = 0

    def acquire(self, timeout_s: float | None = None) -> bool:
        """Wait for the lock; return whether it was acquired in time.

        Parameters
        ----------
        timeout_s : float, optional
            None waits without end.

        """
        me = threading.get_ident()
        if self._owner == me:
            self._depth += 1
            return self._lock.acquire()
        deadline_s = None if timeout_s is None else time.monotonic() + timeout_s
        if not self._next.acquire(timeout=_left_s(deadline_s)):
            return False
        try:
            if not self._lock.acquire(timeout=_left_s(deadline_s)):
                return False
            self._owner, self._depth = me, 1
            return True
        finally:
            self._next.release()

    @property
    def is_reentered(self) -> bool:
        """True if the calling thread holds it more than once, as a signal handler may."""
        return self._owner == threading.get_ident() and self._depth > 1

    def release(self) -> None:
        """Release the lock, once for each `acquire`."""
        self._depth -= 1
        if not self._depth:
            self._owner = None
        self._lock.release()

    def __enter__(self) -> Self:
        self.acquire()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.release()


def _left_s(deadline_s: float | None) -> float:
    if deadline_s is None:
        return -1
    return min(max(0.0, deadline_s - time.monotonic()), threading.TIMEOUT_MAX)

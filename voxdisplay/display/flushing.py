"""Waiting until frames that were handed over are displayed, the same for all kinds of display.

Must not know how frames are sent.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar, Protocol

from voxdisplay.display.connection import MAX_WAIT_S, Clock
from voxdisplay.errors import TransportTimeout


class WaitingQueue(Protocol):
    """Queue of frames, as far as it is waited for."""

    @property
    def busy(self) -> bool:
        """True if a frame is neither displayed nor skipped."""

    @property
    def has_unwaited(self) -> bool:
        """True if that holds of a frame that nobody waits for."""


class Flushing:
    """Operations whose frames can be waited for.

    Attributes
    ----------
    queue : WaitingQueue

    """

    longest_wait_s: ClassVar[float] = MAX_WAIT_S  # of one call of `pump`
    queue: WaitingQueue
    _clock: Clock

    def pump(self, *, wait: bool = True, within_s: float = MAX_WAIT_S) -> None:
        """Send, and handle what comes; wait for that, at most so long."""
        raise NotImplementedError

    def flush(self, timeout_s: float = math.inf) -> None:
        """Wait until no frame is queued.

        Raises
        ------
        TransportTimeout
            If that takes longer than ``timeout_s``.

        """
        if not self._pump_while(lambda: self.queue.busy, timeout_s):
            raise TransportTimeout(
                f"the last frame was not shown within {timeout_s:g} s",
                hint="it is still on its way: call flush again, or allow more time",
            )

    def flush_unwaited(self, timeout_s: float) -> bool:
        """Wait until no frame is queued that nobody waits for; return whether that was in time."""
        return self._pump_while(lambda: self.queue.has_unwaited, timeout_s)

    def _pump_while(self, is_busy: Callable[[], bool], timeout_s: float) -> bool:
        deadline_s = self._clock() + timeout_s
        while is_busy():
            if (left_s := deadline_s - self._clock()) <= 0:
                return False
            self.pump(within_s=min(left_s, self.longest_wait_s))
        return True

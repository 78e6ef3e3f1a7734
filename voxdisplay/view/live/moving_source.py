"""Source of the pictures of a moving scene or a recording, each at its time.

Must not know where they come from.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Hashable

from voxdisplay.errors import TransportClosed
from voxdisplay.view.live.snapshot_message import Snapshot


def due_ordinal(elapsed_s: float, fps: float) -> int:
    """Return the number of the picture that is due, counted on through all repeats."""
    return math.floor(elapsed_s * fps + 1e-6)


class MovingSource:
    """Pictures that follow each other from when they are first watched, again and again.

    Parameters
    ----------
    count : int
        How many there are.
    fps : float
        Pictures per second.
    snapshot : callable
        Returns a picture by its number from 0 to ``count - 1``.
    title : str
        Of them all.
    clock : callable
        Returns seconds.

    """

    def __init__(
        self,
        count: int,
        fps: float,
        snapshot: Callable[[int], Snapshot],
        title: str,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._count, self._fps, self._snapshot, self._title = count, fps, snapshot, title
        self._clock = clock
        self._began_s: float | None = None
        self._last = -1
        self._closing = threading.Event()

    def resend(self) -> None:
        """See `Source.resend`."""
        self._last = -1

    def next(self) -> tuple[Hashable, Snapshot]:
        """See `Source.next`. Pictures whose time is over are left out."""
        if self._began_s is None:
            self._began_s = self._clock()
        while (due := due_ordinal(self._clock() - self._began_s, self._fps)) <= self._last:
            following_s = self._began_s + (self._last + 1) / self._fps
            if self._closing.wait(max(0.0, following_s - self._clock())):
                raise TransportClosed(f"{self._title} is closed")
        self._last = due
        return due, self._snapshot(due % self._count)

    def check_alive(self) -> None:
        """See `Source.check_alive`. There is nothing to check."""

    def close(self) -> None:
        """See `Source.close`."""
        self._closing.set()

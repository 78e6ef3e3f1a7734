"""Refresh ticks of a device as the clock of a player: which tick the next swap will be on.

Every swap that is started takes one tick, or as many as the device holds it for, as long as there
is always a whole frame. Ticks that it missed, and a refresh that is not quite what it announced,
are found out from when its reports come. Must not know frames or a clock: the time is an argument.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final

_WINDOW: Final = 32  # swaps, of which one was reported in time
_AHEAD_S: Final = 0.1  # host or device may be kept waiting for so long, and no tick is missed
_OVERDUE: Final = 8.0  # ticks after which a swap did not just have a late report
_FORGET: Final = 0.98
_OVERLOADED: Final = 10.0  # a fifth of the swaps missed their ticks


class TickClock:
    """Numbers of the ticks of swaps.

    Parameters
    ----------
    refresh_hz : float
        As announced.

    Attributes
    ----------
    refresh_hz : float
    ahead : int
        How many swaps should be started and not displayed.
    next : int
        The tick of the swap to be started next.
    last : int or None
        The tick of the swap that was started last; None before the first.

    """

    def __init__(self, refresh_hz: float) -> None:
        self.refresh_hz = refresh_hz
        self.ahead = max(2, min(8, round(refresh_hz * _AHEAD_S)))
        self._missed = 0.0
        self.restart()

    def restart(self) -> None:
        """Begin again at tick 0."""
        self.next = 0
        self.last: int | None = None
        self._valid_from = 0
        self._expected_s: float | None = None  # of tick 0
        self._origins_s: deque[float] = deque(maxlen=_WINDOW)

    @property
    def is_overloaded(self) -> bool:
        """True if the line or the host cannot fill the ticks."""
        return self._missed > _OVERLOADED

    def place(self, now: float) -> float | None:
        """Return the ticks since tick 0; None before the first report."""
        return (now - min(self._origins_s)) * self.refresh_hz if self._origins_s else None

    def is_early(self, now: float, tick: int, oldest: int | None) -> bool:
        """Return whether there is time before the swap of a tick has to be started.

        Parameters
        ----------
        now : float
        tick : int
        oldest : int or None
            As of `take`.

        """
        if (place := self.place(now)) is None:
            return False
        return tick - place > self.ahead or (oldest is not None and tick - oldest >= self.ahead)

    def take(self, now: float, oldest: int | None) -> int:
        """Return the tick of the swap that is started now.

        Parameters
        ----------
        now : float
        oldest : int or None
            The tick of the oldest swap that is not reported; None if the device has no frame that
            waits for its tick.

        """
        self._missed *= _FORGET
        place = self.place(now)
        if place is not None:
            if oldest is None:
                self._leave_out(math.floor(place) + 1 - self.next)
            elif place - oldest > _OVERDUE and oldest >= self._valid_from:
                self._shift(math.floor(place - oldest))
                self._valid_from = self.next
        self.next += 1
        return self.next - 1

    def put_back(self) -> None:
        """Return the tick that was taken last: nothing was started."""
        self.next -= 1

    def hold(self, tick: int) -> int:
        """Start a swap at a tick from `take` or later; return how many ticks the last one stays."""
        stays = 0 if self.last is None else tick - self.last
        self.next, self.last = tick + 1, tick
        return stays

    def _leave_out(self, ticks: int) -> None:
        if ticks > 0:
            self._missed += 1
            self.next += ticks

    def _shift(self, ticks: int) -> None:
        """Give later numbers to swaps that were started: they have missed their ticks."""
        self._leave_out(ticks)
        if ticks < 0:
            self.next += ticks
        if self.last is not None:
            self.last += ticks

    def note_swap(self, tick: int, now: float, tolerance: float) -> None:
        """Record a swap.

        Parameters
        ----------
        tick : int
            From `take`.
        now : float
            When its report came.
        tolerance : float
            Ticks by which device and host may differ, at least 1.

        """
        if tick < self._valid_from:
            return
        self._origins_s.append(now - tick / self.refresh_hz)
        origin_s = min(self._origins_s)
        if self._expected_s is None or len(self._origins_s) < _WINDOW:
            self._expected_s = origin_s if self._expected_s is None else self._expected_s
            if not self._valid_from:  # the first report may have been late
                self._expected_s = min(self._expected_s, origin_s)
            return
        behind = (origin_s - self._expected_s) * self.refresh_hz
        if abs(behind) < max(1.0, tolerance) - 0.25:
            return
        ticks, before = round(behind), self.next
        self._shift(ticks)
        self._valid_from = max(before, self.next)  # those on their way have earlier numbers
        self._origins_s.clear()

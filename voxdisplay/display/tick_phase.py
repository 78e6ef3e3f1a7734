"""Phases of the refresh ticks of several devices, and when to send them their COMMITs.

Devices tick by clocks of their own. They swap within one period of each other as long as no tick of
any of them falls between the first and the last COMMIT. Must not know frames, or wait: the time is
an argument.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from typing import Final

_WINDOW: Final = 16  # swaps, of which one was reported in time
_VALID_S: Final = 4.0  # after which two clocks may have drifted apart
_GUARD_S: Final = 4e-3  # in which all COMMITs are at the devices, whose reports are late by as much


class TickPhase:
    """Estimate of when a device ticks.

    Its tick lies between a COMMIT and the report of the swap, if they are less than one period
    apart; the closest pair tells best.

    Parameters
    ----------
    refresh_hz : float
        As announced; more than 0.

    Attributes
    ----------
    period_s : float

    """

    def __init__(self, refresh_hz: float) -> None:
        self.period_s = 1 / refresh_hz
        self._committed_s = -math.inf
        self._reports: deque[tuple[float, float]] = deque(maxlen=_WINDOW)  # delay, time

    def note_commit(self, now: float) -> None:
        """Record that a COMMIT was sent."""
        self._committed_s = now

    def note_swap(self, now: float) -> None:
        """Record that the swap after the last COMMIT was reported."""
        delay_s = now - self._committed_s
        if 0 <= delay_s < self.period_s:
            self._reports.append((delay_s, now))

    def next_tick(self, now: float) -> float | None:
        """Return the time of the next tick, or shortly after it; None if it is not known."""
        recent = [report for report in self._reports if now - report[1] < _VALID_S]
        if not recent:
            return None
        _, seen_s = min(recent)
        return now + (seen_s - now) % self.period_s


def commit_delay(phases: Sequence[TickPhase], now: float) -> float:
    """Return after how many seconds no device will tick while COMMITs are sent to all.

    Parameters
    ----------
    phases : sequence of TickPhase
        Of the devices that tick.
    now : float

    Returns
    -------
    float
        0 if it is now, or if that cannot be told: phases are not known, or rates differ.

    """
    ticks = [phase.next_tick(now) for phase in phases]
    after_s = sorted(tick - now for tick in ticks if tick is not None)
    if len(after_s) < len(phases) or len({phase.period_s for phase in phases}) != 1:
        return 0.0
    cycle = [*after_s, after_s[0] + phases[0].period_s]
    guard_s = min(_GUARD_S, max(later - earlier for earlier, later in pairwise(cycle)) / 2)
    if after_s[0] > guard_s:
        return 0.0
    return next(earlier for earlier, later in pairwise(cycle) if later - earlier > guard_s)

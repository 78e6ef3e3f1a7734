"""`PlayReport`: figures of a show that was played, in memory that does not grow.

Must not know displays or clocks.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import asdict, dataclass
from typing import Any


class Distribution:
    """Counts of values, rounded to three digits and to a tenth: memory is bounded."""

    def __init__(self) -> None:
        self._counts: Counter[float] = Counter()

    def add(self, value: float) -> None:
        """Count a value."""
        self._counts[float(f"{round(value, 1):.3g}")] += 1

    def quantile(self, share: float) -> float:
        """Return the least value that a share of all does not exceed; 0 without any."""
        wanted = share * sum(self._counts.values())
        seen = 0
        for value in sorted(self._counts):
            seen += self._counts[value]
            if seen >= wanted:
                return value
        return 0.0


@dataclass(frozen=True, slots=True)
class PlayReport:
    """Figures of a show that was played.

    Attributes
    ----------
    frames : int
        Frames that were due.
    shown, dropped : int
        Those that the device has displayed, and those left out because a newer one was due.
    fps : float
        Frames shown per second.
    late_ms : dict
        ``p50``, ``p95``, ``max``: how long after its time each was displayed, as reported.
    gap_ms : dict
        ``p5``, ``p50``, ``p95``, ``max``: times between the swaps of two frames.
    ticks : dict of str to int
        The same in refresh ticks: how often so many; empty for a device without.
    wrong : int
        Frames whose digest was not the one that was known beforehand.
    repaired : int
        Those of them after which the display was right again.
    wire_bytes : int
        Bytes sent.
    seconds : float

    """

    frames: int
    shown: int
    dropped: int
    fps: float
    late_ms: dict[str, float]
    gap_ms: dict[str, float]
    ticks: dict[str, int]
    wrong: int
    repaired: int
    wire_bytes: int
    seconds: float

    def as_json(self) -> dict[str, Any]:
        """Return it as plain values, rounded."""
        return asdict(self) | {"fps": round(self.fps, 3), "seconds": round(self.seconds, 3)}


class PlayMeter:
    """Collector of the figures.

    Parameters
    ----------
    refresh_hz : float
        Refresh ticks of the device; 0: it has none.

    """

    def __init__(self, refresh_hz: float) -> None:
        self.frames = self.shown = 0
        self._late_ms, self._gap_ms = Distribution(), Distribution()
        self._ticks = TickEstimator(refresh_hz) if refresh_hz else None
        self._last_s: float | None = None
        self._gaps_s, self._gaps = 0.0, 0

    def note_swap(self, now: float, due_s: float | None) -> None:
        """Count a swap.

        Parameters
        ----------
        now : float
            When the device's report came.
        due_s : float or None
            When the frame was due; None if it repeats the one before.

        """
        if self._ticks:
            self._ticks.add(now, fresh=due_s is not None)
        if due_s is None:
            return
        self.shown += 1
        self._late_ms.add(1000 * (now - due_s))
        if self._last_s is not None:
            self._gap_ms.add(1000 * (now - self._last_s))
            self._gaps_s += now - self._last_s
            self._gaps += 1
        self._last_s = now

    @property
    def fps(self) -> float:
        """Frames displayed per second, without pauses; 0 with less than two."""
        return self._gaps / self._gaps_s if self._gaps_s else 0.0

    def note_break(self) -> None:
        """Record a pause or seek: the next interval means nothing."""
        self._last_s = None
        if self._ticks:
            self._ticks.note_break()

    def report(self, *, seconds: float, wrong: int, repaired: int, wire_bytes: int) -> PlayReport:
        """Return the figures.

        Parameters
        ----------
        seconds : float
            How long it took in all.
        wrong, repaired, wire_bytes : int

        """
        late, gap = self._late_ms, self._gap_ms
        frames = max(self.frames, self.shown)
        return PlayReport(
            frames=frames,
            shown=self.shown,
            dropped=frames - self.shown,
            fps=self.fps,
            late_ms={
                "p50": late.quantile(0.5),
                "p95": late.quantile(0.95),
                "max": late.quantile(1),
            },
            gap_ms={
                "p5": gap.quantile(0.05),
                "p50": gap.quantile(0.5),
                "p95": gap.quantile(0.95),
                "max": gap.quantile(1),
            },
            ticks=self._ticks.counts() if self._ticks else {},
            wrong=wrong,
            repaired=repaired,
            wire_bytes=wire_bytes,
            seconds=seconds,
        )


_EARLY_TICKS = 0.25  # a report may seem so early, because the phase is known that well
_PHASE_SWAPS = 16  # the least late of so many was not late: clocks drift, and the first may be late
_KEPT_SWAPS = 64


class TickEstimator:
    """Refresh ticks of swaps, from the times at which their reports came.

    Reports come late, never early, and there is at most one swap a tick: so a report that was late
    is found out by the ones that follow it.

    Parameters
    ----------
    refresh_hz : float

    """

    def __init__(self, refresh_hz: float) -> None:
        self._refresh_hz = refresh_hz
        self._origin_s: float | None = None
        self._late: list[float] = []  # ticks, of the last swaps
        self._swaps: list[tuple[int, bool]] = []  # tick, fresh
        self._counts: Counter[int] = Counter()
        self._last_fresh: int | None = None

    def add(self, now: float, *, fresh: bool) -> None:
        """Add a swap; ``fresh`` if it shows another frame."""
        if self._origin_s is None:
            self._origin_s = now
        place = (now - self._origin_s) * self._refresh_hz
        tick = math.floor(place + _EARLY_TICKS)
        self._note_late(place - tick)
        later = tick
        for index in range(len(self._swaps) - 1, -1, -1):
            before, was_fresh = self._swaps[index]
            if before < later:
                break
            later -= 1
            self._swaps[index] = later, was_fresh
        self._swaps.append((tick, fresh))
        if len(self._swaps) > _KEPT_SWAPS:
            self._settle(1)

    def _note_late(self, ticks: float) -> None:
        """Correct the phase of the ticks, by which reports are never early."""
        self._late.append(ticks)
        if ticks < 0 or len(self._late) == _PHASE_SWAPS:
            assert self._origin_s is not None  # noqa: S101 - set by the first swap
            self._origin_s += min(self._late) / self._refresh_hz
            self._late.clear()

    def _settle(self, count: int) -> None:
        for tick, fresh in self._swaps[:count]:
            if not fresh:
                continue
            if self._last_fresh is not None:
                self._counts[max(1, tick - self._last_fresh)] += 1
            self._last_fresh = tick
        del self._swaps[:count]

    def note_break(self) -> None:
        """Have the next interval not counted."""
        self._settle(len(self._swaps))
        self._last_fresh = self._origin_s = None

    def counts(self) -> dict[str, int]:
        """Return how often there were so many ticks between two frames."""
        self._settle(len(self._swaps))
        return {str(ticks): self._counts[ticks] for ticks in sorted(self._counts)}

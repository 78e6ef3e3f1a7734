"""Counts of presented, shown and dropped frames, and the intervals between swaps.

Must not know frames or a clock: the time is an argument.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

_KEPT_INTERVALS = 1000


@dataclass(frozen=True, slots=True)
class Playback:
    """Counts of the frames that were presented, and the intervals between their swaps.

    Attributes
    ----------
    presented : int
        Frames that were handed over.
    shown : int
        Those that the device has reported to be on display.
    dropped : int
        Those that were not sent because a newer one came before their turn, or were refused.
    fps : float
        Mean rate of the frames shown, from the first to the last; 0 with less than two.
    intervals_s : tuple of float
        Seconds between swaps, as the device's reports have come; of the last 1000.
    wrong : int
        Frames that nobody waited for whose digest was not theirs.
    repaired : int
        How often the display was right again after that.

    """

    presented: int
    shown: int
    dropped: int
    fps: float
    intervals_s: tuple[float, ...]
    wrong: int
    repaired: int


class PlaybackMeter:
    """Counter of frames.

    Parameters
    ----------
    presented : int
        Frames that are on their way already.

    """

    def __init__(self, presented: int = 0) -> None:
        self._presented = presented
        self._shown = self._dropped = self._wrong = self._repaired = 0
        self._is_wrong = False
        self._first_s = self._last_s = 0.0
        self._before_first = 0
        self._intervals_s: deque[float] = deque(maxlen=_KEPT_INTERVALS)

    def note_presented(self) -> None:
        """Count a frame that was handed over."""
        self._presented += 1

    def note_dropped(self, count: int = 1) -> None:
        """Count frames that will not be shown."""
        self._dropped += count

    def note_wrong(self) -> None:
        """Count a frame that is displayed wrongly."""
        self._wrong += 1
        self._is_wrong = True

    def note_right(self) -> None:
        """Record that the display shows what it should."""
        self._repaired += self._is_wrong
        self._is_wrong = False

    def note_shown(self, count: int, now: float) -> None:
        """Count frames that were displayed since the last report; it names the last of them."""
        if not count:
            return
        if self._shown:
            self._intervals_s.extend([(now - self._last_s) / count] * count)
        else:
            self._first_s, self._before_first = now, count
        self._shown += count
        self._last_s = now

    def reading(self) -> Playback:
        """Return the counts so far."""
        seconds = self._last_s - self._first_s
        return Playback(
            presented=self._presented,
            shown=self._shown,
            dropped=self._dropped,
            fps=(self._shown - self._before_first) / seconds if seconds else 0.0,
            intervals_s=tuple(self._intervals_s),
            wrong=self._wrong,
            repaired=self._repaired,
        )

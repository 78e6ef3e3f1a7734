"""Position of a player on its schedule: speed, pause and seek.

Must not know a clock: the time is an argument.
"""

from __future__ import annotations


class PlayClock:
    """Position that moves with the time.

    It is computed from the moment at which it was set last, so that nothing accumulates.

    Parameters
    ----------
    now : float
        Seconds on any monotonic clock.
    position_s : float
        Where it begins, in seconds of the schedule.
    speed : float
        Seconds of the schedule per second.

    """

    def __init__(self, now: float, position_s: float = 0.0, speed: float = 1.0) -> None:
        self.speed = speed
        self.paused = False
        self._set_s, self._position_s = now, position_s

    def position(self, now: float) -> float:
        """Return the position at a time."""
        return self._position_s if self.paused else self._moving(now)

    def _moving(self, now: float) -> float:
        return self._position_s + (now - self._set_s) * self.speed

    def moment(self, position_s: float) -> float:
        """Return the time at which a position is reached, unless it is paused until then."""
        return self._set_s + (position_s - self._position_s) / self.speed

    def seek(self, position_s: float, now: float) -> None:
        """Go to a position."""
        self._set_s, self._position_s = now, position_s

    def pause(self, now: float) -> None:
        """Stop; twice is fine."""
        self.seek(self.position(now), now)
        self.paused = True

    def resume(self, now: float) -> None:
        """Go on; twice is fine."""
        self.seek(self.position(now), now)
        self.paused = False

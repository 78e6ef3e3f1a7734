"""How long nothing was heard, what has been asked since, and when to ask (section 9.3).

Knows a clock only as the ``now`` it is told, and packets only as tags of STATUS.
"""

from __future__ import annotations

from voxdisplay.errors import TransportTimeout
from voxdisplay.wire import spec

FIRST_TIMEOUT_S = 0.25  # before a round trip has been measured
LEAST_TIMEOUT_S = 0.05  # section 9.3
# Of the first question, which costs next to nothing: on a fast line much goes lost in 50 ms.
FIRST_QUESTION_S = 0.02


class Silence:
    """The patience of one link.

    Parameters
    ----------
    now : float
    patience_s : float
        How long silence may last, besides a refresh period: a device that waits for its tick may
        be unable to answer.

    """

    def __init__(self, now: float, patience_s: float) -> None:
        self._patience_s = patience_s
        self._tick_s = 0.0
        self._first_timeout_s = FIRST_TIMEOUT_S
        self._round_trip_s: float | None = None
        self._heard_s = self._progress_s = self._asked_s = now
        self._backoff = 1
        self._doubt = False
        self._only_greets = False  # in doubt, it has answered HELLO
        self._asked: dict[int, float] = {}  # tag -> when

    def begin(self, now: float, refresh: int) -> None:
        """Begin a session with a device of ``refresh`` ticks per 1000 seconds."""
        self._tick_s = 1000 / refresh if refresh else 0.0
        # At most a round trip: the device may have had to start first.
        greeted_s = min(now - self._heard_s, self._patience_s / 4)
        self._first_timeout_s = max(FIRST_TIMEOUT_S, 2 * greeted_s)
        self._only_greets = self._doubt
        self.rest(now)

    def forget(self, *, doubt: bool = False) -> None:
        """Await no answer any more; ``doubt`` if that is because none came.

        Then a device that only answers HELLO is as good as silent.
        """
        self._asked.clear()
        self._backoff = 1
        self._doubt = doubt

    def rest(self, now: float) -> None:
        """Note that nothing is waited for: silence so far says nothing."""
        if not self._doubt:
            self.progress(now)

    def heard(self, now: float) -> None:
        """Note that the device has said something."""
        self._heard_s = now
        self._doubt = self._only_greets = False

    def progress(self, now: float) -> None:
        """Note that something has arrived."""
        self.heard(now)
        self._progress_s = now
        self._backoff = 1

    def excuse(self, seconds: float) -> None:
        """Take off a time in which the caller was away, and nobody listened."""
        self._heard_s += seconds
        self._progress_s += seconds

    @property
    def asking(self) -> bool:
        """Whether a STATUS is without answer."""
        return bool(self._asked)

    @property
    def may_ask(self) -> bool:
        """Whether there may be another STATUS without answer."""
        return len(self._asked) < spec.LIMIT_MAX_STATUS

    @property
    def ask_due_s(self) -> float:
        """When to ask: often enough that all questions fit into the patience."""
        first_s = timeout_s = self._first_timeout_s
        if self._round_trip_s is not None:
            first_s = max(FIRST_QUESTION_S, 2 * self._round_trip_s)
            timeout_s = max(LEAST_TIMEOUT_S, first_s)
        pause_s = min(timeout_s * self._backoff, self._patience_s / 8)
        return max(self._heard_s + first_s + self._tick_s, self._asked_s + pause_s)

    @property
    def end_s(self) -> float:
        """When silence has lasted too long."""
        return self._heard_s + self._patience_s + self._tick_s

    def ask(self, tag: int, now: float) -> None:
        """Note that a STATUS goes out."""
        self._asked[tag] = self._asked_s = now
        self._backoff *= 2

    def answered(self, tag: int, now: float) -> None:
        """Note that the answer to a STATUS has come; those asked before it will get none."""
        if tag in self._asked:
            self.measure(now - self._asked[tag])
            tags = list(self._asked)
            for earlier in tags[: tags.index(tag) + 1]:
                del self._asked[earlier]
            self._backoff = 1

    def measure(self, seconds: float) -> None:
        """Learn from a round trip; one that the caller has slept through tells little."""
        seconds = min(seconds, self._patience_s / 4)
        before = self._round_trip_s
        self._round_trip_s = seconds if before is None else before + (seconds - before) / 8

    def error(self, now: float) -> TransportTimeout:
        """Give what is raised for silence."""
        if self._only_greets:
            return TransportTimeout(
                f"the device answers HELLO, and has said nothing else for "
                f"{now - self._heard_s:.1f} s",
                hint="its firmware may be stuck, or the line loses most of what it says",
            )
        return TransportTimeout(
            f"the device has been silent for {now - self._heard_s:.1f} s",
            hint="is it still plugged in and switched on?",
        )

    def check(self, now: float) -> None:
        """Lose patience, if it is time.

        Raises
        ------
        TransportTimeout
            If the device has been silent, or nothing has moved, for too long.

        """
        if self._asked and now >= self.end_s:
            raise self.error(now)
        if now - self._progress_s > 2 * (self._patience_s + self._tick_s):
            raise TransportTimeout(
                f"the device answers, but nothing has moved for {now - self._progress_s:.1f} s",
                hint="its firmware may be stuck: switch it off and on",
            )

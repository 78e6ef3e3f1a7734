"""How long nothing was heard, what has been asked since, and when to ask (section 9.3).

Knows a clock only as the ``now`` it is told, and packets only as tags of STATUS.
"""

from __future__ import annotations

from voxdisplay.errors import TransportTimeout
from voxdisplay.wire import spec

INITIAL_TIMEOUT_S = 0.25  # before a round trip has been measured
MIN_TIMEOUT_S = 0.05  # section 9.3
# Of the first question, which costs next to nothing: on a fast line much goes lost in 50 ms.
MIN_FIRST_POLL_S = 0.02


class SilenceTimer:
    """The patience of one link.

    Parameters
    ----------
    now : float
    timeout_s : float
        How long silence may last, besides a refresh period: a device that waits for its tick may
        be unable to answer.

    """

    def __init__(self, now: float, timeout_s: float) -> None:
        self._timeout_s = timeout_s
        self._refresh_period_s = 0.0
        self._initial_timeout_s = INITIAL_TIMEOUT_S
        self._round_trip_s: float | None = None
        self._heard_s = self._progress_s = self._polled_s = now
        self._backoff = 1
        self._polls_timed_out = False
        self._only_hello_answered = False  # in doubt, it has answered HELLO
        self._outstanding_polls: dict[int, float] = {}  # tag -> when

    def open_session(self, now: float, refresh: int) -> None:
        """Begin a session with a device of ``refresh`` ticks per 1000 seconds."""
        self._refresh_period_s = 1000 / refresh if refresh else 0.0
        # At most a round trip: the device may have had to start first.
        greeted_s = min(now - self._heard_s, self._timeout_s / 4)
        self._initial_timeout_s = max(INITIAL_TIMEOUT_S, 2 * greeted_s)
        self._only_hello_answered = self._polls_timed_out
        self.note_idle(now)

    def cancel_polls(self, *, doubt: bool = False) -> None:
        """Await no answer any more; ``doubt`` if that is because none came.

        Then a device that only answers HELLO is as good as silent.
        """
        self._outstanding_polls.clear()
        self._backoff = 1
        self._polls_timed_out = doubt

    def note_idle(self, now: float) -> None:
        """Note that nothing is waited for: silence so far says nothing."""
        if not self._polls_timed_out:
            self.note_progress(now)

    def note_packet(self, now: float) -> None:
        """Note that the device has said something."""
        self._heard_s = now
        self._polls_timed_out = self._only_hello_answered = False

    def note_progress(self, now: float) -> None:
        """Note that something has arrived."""
        self.note_packet(now)
        self._progress_s = now
        self._backoff = 1

    def extend(self, seconds: float) -> None:
        """Take off a time in which the caller was away, and nobody listened."""
        self._heard_s += seconds
        self._progress_s += seconds

    @property
    def poll_outstanding(self) -> bool:
        """Whether a STATUS is without answer."""
        return bool(self._outstanding_polls)

    @property
    def may_poll(self) -> bool:
        """Whether there may be another STATUS without answer."""
        return len(self._outstanding_polls) < spec.LIMIT_MAX_STATUS

    @property
    def poll_due_s(self) -> float:
        """When to ask: often enough that all questions fit into the patience."""
        first_s = timeout_s = self._initial_timeout_s
        if self._round_trip_s is not None:
            first_s = max(MIN_FIRST_POLL_S, 2 * self._round_trip_s)
            timeout_s = max(MIN_TIMEOUT_S, first_s)
        pause_s = min(timeout_s * self._backoff, self._timeout_s / 8)
        return max(self._heard_s + first_s + self._refresh_period_s, self._polled_s + pause_s)

    @property
    def deadline_s(self) -> float:
        """When silence has lasted too long."""
        return self._heard_s + self._timeout_s + self._refresh_period_s

    def note_poll(self, tag: int, now: float) -> None:
        """Note that a STATUS goes out."""
        self._outstanding_polls[tag] = self._polled_s = now
        self._backoff *= 2

    def note_poll_answer(self, tag: int, now: float) -> None:
        """Note that the answer to a STATUS has come; those asked before it will get none."""
        if tag in self._outstanding_polls:
            self.sample_round_trip(now - self._outstanding_polls[tag])
            tags = list(self._outstanding_polls)
            for earlier in tags[: tags.index(tag) + 1]:
                del self._outstanding_polls[earlier]
            self._backoff = 1

    def sample_round_trip(self, seconds: float) -> None:
        """Learn from a round trip; one that the caller has slept through tells little."""
        seconds = min(seconds, self._timeout_s / 4)
        before = self._round_trip_s
        self._round_trip_s = seconds if before is None else before + (seconds - before) / 8

    def timeout_error(self, now: float) -> TransportTimeout:
        """Give what is raised for silence."""
        if self._only_hello_answered:
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
        if self._outstanding_polls and now >= self.deadline_s:
            raise self.timeout_error(now)
        if now - self._progress_s > 2 * (self._timeout_s + self._refresh_period_s):
            raise TransportTimeout(
                f"the device answers, but nothing has moved for {now - self._progress_s:.1f} s",
                hint="its firmware may be stuck: switch it off and on",
            )

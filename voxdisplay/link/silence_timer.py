"""Silence timer: when to poll with STATUS, and when to give up (protocol.md, section 9.3).

Must not know packets but by the tags of STATUS, nor a clock: the time is an argument.
"""

from __future__ import annotations

from voxdisplay.errors import TransportTimeout
from voxdisplay.wire import spec

INITIAL_TIMEOUT_S = 0.25  # before a round trip has been measured
MIN_TIMEOUT_S = 0.05  # section 9.3
# Of the first poll, which costs next to nothing: on a fast line much is lost in 50 ms.
MIN_FIRST_POLL_S = 0.02


class SilenceTimer:
    """Timers of one link: for polls, for silence, and for talk without progress.

    Parameters
    ----------
    now : float
    timeout_s : float
        How long silence may last, besides a refresh period: a device that waits for its refresh
        tick may be unable to answer.

    Attributes
    ----------
    held_s : float
        Time for which frames on their way are held, in which the device may be unable to answer,
        too.

    """

    def __init__(self, now: float, timeout_s: float) -> None:
        self.held_s = 0.0
        self._timeout_s = timeout_s
        self._refresh_period_s = 0.0
        self._initial_timeout_s = INITIAL_TIMEOUT_S
        self._round_trip_s: float | None = None
        self._heard_s = self._progress_s = self._polled_s = now
        self._backoff = 1
        self._polls_timed_out = False
        self._only_hello_answered = False  # since polls timed out
        self._outstanding_polls: dict[int, float] = {}  # tag -> when it was sent

    def open_session(self, now: float, refresh: int) -> None:
        """Start a session with a device of ``refresh`` ticks per 1000 seconds."""
        self._refresh_period_s = 1000 / refresh if refresh else 0.0
        # At most a round trip: the device may have had to start first.
        handshake_s = min(now - self._heard_s, self._timeout_s / 4)
        self._initial_timeout_s = max(INITIAL_TIMEOUT_S, 2 * handshake_s)
        self._only_hello_answered = self._polls_timed_out
        self.note_idle(now)

    def cancel_polls(self, *, timed_out: bool = False) -> None:
        """Forget the outstanding polls.

        Parameters
        ----------
        timed_out : bool
            Whether that is because no answer came. Then a device that answers HELLO alone counts
            as silent.

        """
        self._outstanding_polls.clear()
        self._backoff = 1
        self._polls_timed_out = timed_out

    def note_idle(self, now: float) -> None:
        """Restart the timers, because no answer is due: silence so far means nothing."""
        if not self._polls_timed_out:
            self.note_progress(now)

    def note_packet(self, now: float) -> None:
        """Restart the timer for silence: a packet has come."""
        self._heard_s = now
        self._polls_timed_out = self._only_hello_answered = False

    def note_progress(self, now: float) -> None:
        """Restart all timers: something was delivered."""
        self.note_packet(now)
        self._progress_s = now
        self._backoff = 1

    def extend(self, seconds: float) -> None:
        """Extend the deadlines by a time in which the caller did not read the pipe."""
        self._heard_s += seconds
        self._progress_s += seconds

    @property
    def poll_outstanding(self) -> bool:
        """True if a STATUS is without answer."""
        return bool(self._outstanding_polls)

    @property
    def may_poll(self) -> bool:
        """True if the protocol allows another STATUS without answer."""
        return len(self._outstanding_polls) < spec.LIMIT_MAX_STATUS

    @property
    def poll_due_s(self) -> float:
        """Time of the next poll, early enough for all polls to fit into the timeout."""
        first_s = timeout_s = self._initial_timeout_s
        if self._round_trip_s is not None:
            first_s = max(MIN_FIRST_POLL_S, 2 * self._round_trip_s)
            timeout_s = max(MIN_TIMEOUT_S, first_s)
        pause_s = min(timeout_s * self._backoff, self._timeout_s / 8)
        waits_s = self._refresh_period_s + self.held_s
        return max(self._heard_s + first_s + waits_s, self._polled_s + pause_s + self.held_s)

    @property
    def deadline_s(self) -> float:
        """Time at which silence has lasted too long."""
        return self._heard_s + self._timeout_s + self._refresh_period_s + self.held_s

    def note_poll(self, tag: int, now: float) -> None:
        """Record that a STATUS is sent."""
        self._outstanding_polls[tag] = self._polled_s = now
        self._backoff *= 2

    def note_poll_answer(self, tag: int, now: float) -> None:
        """Record the answer to a STATUS; earlier ones will not be answered any more."""
        if tag in self._outstanding_polls:
            self.sample_round_trip(now - self._outstanding_polls[tag])
            tags = list(self._outstanding_polls)
            for answered in tags[: tags.index(tag) + 1]:
                del self._outstanding_polls[answered]
            self._backoff = 1

    def sample_round_trip(self, seconds: float) -> None:
        """Update the smoothed round-trip time; what the caller slept through is cut off."""
        seconds = min(seconds, self._timeout_s / 4)
        before = self._round_trip_s
        self._round_trip_s = seconds if before is None else before + (seconds - before) / 8

    def timeout_error(self, now: float) -> TransportTimeout:
        """Return the error for an expired silence deadline."""
        if self._only_hello_answered:
            return TransportTimeout(
                f"the device answers HELLO, and has sent nothing else for "
                f"{now - self._heard_s:.1f} s",
                hint="its firmware may be stuck, or the line loses most of what it sends",
            )
        return TransportTimeout(
            f"the device has been silent for {now - self._heard_s:.1f} s",
            hint="is it still plugged in and switched on?",
        )

    def check(self, now: float) -> None:
        """Raise `TransportTimeout` if a deadline has passed.

        That is the one for silence, or, twice as long, the one for answers without progress.
        """
        if self._outstanding_polls and now >= self.deadline_s:
            raise self.timeout_error(now)
        longest_s = self._timeout_s + self._refresh_period_s + self.held_s
        if now - self._progress_s > 2 * longest_s:
            raise TransportTimeout(
                f"the device answers, but nothing was delivered for {now - self._progress_s:.1f} s",
                hint="its firmware may be stuck: switch it off and on",
            )

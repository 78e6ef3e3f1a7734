"""Barrier at which the parts of a display wait until all of them hold a frame.

One thread then sends all COMMITs, one right after the other: threads that wake up would each wait
for the interpreter. Must not know frames.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Collection, Sequence
from typing import Final, Protocol, TypeAlias

from voxdisplay.display.connection import Clock
from voxdisplay.display.handshake import closed_meanwhile
from voxdisplay.display.tick_phase import TickPhase, commit_delay

_POLL_S: Final = 0.02  # after which a part that went away is noticed
_MAX_DELAYS: Final = 4  # of a thread that is woken up too late for a gap between ticks


class Member(Protocol):
    """A part that waits, as the barrier sees it."""

    @property
    def is_present(self) -> bool:
        """False while its device is gone, and for ever if it is not waited for."""

    @property
    def is_cancelled(self) -> bool:
        """True when it must not wait any longer."""

    @property
    def tick_phase(self) -> TickPhase | None:
        """When its device ticks; None if it has no ticks."""


_Arrival: TypeAlias = tuple[Member, Callable[[], None]]


class SwapBarrier:
    """Barrier for one frame: opens once, when all members that are present have arrived.

    Parameters
    ----------
    members : collection of Member
        Those that are waited for. One that goes away meanwhile is not.
    clock, sleep : callable
        Return seconds, and wait for some.

    """

    def __init__(
        self,
        members: Collection[Member],
        clock: Clock = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._changed = threading.Condition()
        self._awaited = list(members)
        self._arrived: list[_Arrival] = []
        self._is_led = False  # a thread sends the COMMITs
        self._is_open = False
        self._clock, self._sleep = clock, sleep

    def wait(self, member: Member, commit: Callable[[], None]) -> None:
        """Arrive, wait for the others, and return when its COMMIT was sent.

        Parameters
        ----------
        member : Member
        commit : callable
            Sends the COMMIT, without waiting. It is called by the thread of any member, while that
            of this one waits here.

        Raises
        ------
        LocalProtocolError
            If the member was cancelled.

        """
        arrival = member, commit
        with self._changed:
            self._arrived.append(arrival)
            self._drop(member)
            while not self._is_open:
                if self._is_led:
                    self._changed.wait()
                elif member.is_cancelled:
                    self._arrived.remove(arrival)
                    raise closed_meanwhile()
                elif any(other.is_present for other in self._awaited):
                    self._changed.wait(_POLL_S)
                else:
                    self._is_led = True
                    arrived, self._arrived = self._arrived, []
                    break
            else:
                if arrival in self._arrived:  # it came when the others had theirs sent
                    self._commit(arrival)
                return
        self._lead(arrived)

    def _lead(self, arrived: Sequence[_Arrival]) -> None:
        """Send the COMMITs of some members together."""
        try:
            self._wait_for_gap([member for member, _ in arrived])
            for arrival in arrived:
                self._commit(arrival)
        finally:
            with self._changed:
                self._is_open = True
                self._changed.notify_all()

    def _commit(self, arrival: _Arrival) -> None:
        member, commit = arrival
        commit()
        if phase := member.tick_phase:
            phase.note_commit(self._clock())

    def _wait_for_gap(self, members: Collection[Member]) -> None:
        """Wait until none of the devices will tick while their COMMITs are sent."""
        phases = [phase for member in members if (phase := member.tick_phase)]
        if len(phases) > 1:
            for _ in range(_MAX_DELAYS):
                if not (delay_s := commit_delay(phases, self._clock())):
                    return
                self._sleep(delay_s)

    def leave(self, member: Member) -> None:
        """Be waited for no longer: it has arrived, or will not."""
        with self._changed:
            self._drop(member)

    def _drop(self, member: Member) -> None:
        self._awaited = [other for other in self._awaited if other is not member]
        if not self._awaited:
            self._changed.notify_all()

"""`Player`: plays a schedule of shows on an open display.

Each iteration of its loop starts the frame whose turn it is, has the next one prepared, and turns
the link while it waits. Must not know how frames are made or encoded.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from voxdisplay.display.connection import Clock
from voxdisplay.display.display_operations import DisplayOperations
from voxdisplay.display.frame_queue import Picture
from voxdisplay.display.tick_clock import TickClock
from voxdisplay.shows.frame_schedule import FrameSchedule, Slot
from voxdisplay.shows.play_clock import PlayClock
from voxdisplay.shows.play_report import PlayMeter, PlayReport
from voxdisplay.shows.preparing import FrameSource

Turn: TypeAlias = Callable[[], AbstractContextManager[DisplayOperations]]
Pacing: TypeAlias = Literal["device", "host"]
Late: TypeAlias = Literal["drop", "delay"]

_MIN_WAIT_S: Final = 1e-4  # below, sums of times may not grow
_MAX_WAIT_S: Final = 0.02  # then the observer has its turn
_WORKER_WAIT_S: Final = 0.003  # while another process prepares frames
_FLUSH_S: Final = 30.0
_LEAST_HOLD: Final = 2  # ticks


@dataclass(frozen=True, slots=True)
class _Swap:
    """A swap that was started: its tick, and when its frame is due; None if it repeats one."""

    tick: int | None
    due_s: float | None


class Player:
    """One playing of a schedule.

    Parameters
    ----------
    turn : callable
        Returns a context in which the display's operations may be used.
    clock : callable
        Returns seconds, on any monotonic clock.
    schedule : FrameSchedule
    source : FrameSource
        Prepares its frames.
    start_s, speed : float
        Where it begins, and seconds of the schedule per second.
    pacing : {"device", "host"}
        Whether each refresh tick of the device gets a frame, or each frame its time.
    late : {"drop", "delay"}
        Whether frames that are late are left out, or all that follow wait for them. The latter
        is always paced by the host.
    observer : callable, optional
        Called with the player at least every 20 ms; it may call `pause`, `seek` and `stop`.

    Attributes
    ----------
    schedule : FrameSchedule
    shown : int
        Frames displayed so far.

    """

    def __init__(
        self,
        turn: Turn,
        clock: Clock,
        schedule: FrameSchedule,
        source: FrameSource,
        *,
        start_s: float = 0.0,
        speed: float = 1.0,
        pacing: Pacing = "device",
        late: Late = "drop",
        observer: Callable[[Player], None] | None = None,
    ) -> None:
        self.schedule = schedule
        self._turn, self._clock, self._source = turn, clock, source
        self._delays = late == "delay"
        self._observer = observer
        with turn() as operations:
            refresh_hz = operations.refresh_hz
            # Two frames on their way may be held for as long as the protocol allows together.
            self._longest_hold = operations.max_hold_ticks // 2
            operations.queue.restart_playback()
            self._bytes_before = operations.wire_bytes
            self._reconnects = operations.reconnects
        by_ticks = pacing == "device" and refresh_hz and not self._delays
        self._ticks = TickClock(refresh_hz) if by_ticks else None
        self._meter = PlayMeter(refresh_hz)
        self._play = PlayClock(clock(), start_s, speed)
        self._swaps: dict[int, _Swap] = {}  # by ticket
        self._stopped = False
        self._restart()

    # -- controls

    @property
    def paused(self) -> bool:
        """True while it is paused."""
        return self._play.paused

    @property
    def position_s(self) -> float:
        """Position in seconds of the schedule."""
        return min(self._play.position(self._clock()), self.schedule.duration_s)

    @property
    def shown(self) -> int:
        """Number of frames displayed so far."""
        return self._meter.shown

    @property
    def asked_fps(self) -> float:
        """Frames per second that are due where it is."""
        slot = self._last or self.schedule.slot_at(self._play.position(self._clock()))
        return 1 / self._period_s(slot) if slot else 0.0

    def pause(self) -> None:
        """Pause, or go on."""
        now = self._clock()
        if self.paused:
            self._play.resume(now)
        else:
            self._play.pause(now)
            if self._last and self._last.begins_s > self._play.position(now):
                self._play.seek(self._last.begins_s, now)  # not back to what was shown before
        self._restart()

    def seek(self, seconds: float) -> None:
        """Go forward, or back, by some seconds; while it is paused, the frame there is shown."""
        now = self._clock()
        position_s = max(0.0, self._play.position(now) + seconds)
        last = self.schedule.frames
        if position_s >= self.schedule.duration_s and last:
            end = self.schedule.slot(last - 1)
            position_s = end.begins_s if end else 0.0
        self._play.seek(position_s, now)
        self._restart()

    def stop(self) -> None:
        """End with this iteration."""
        self._stopped = True

    def _restart(self) -> None:
        """Begin at the position of now: what was played before has been counted."""
        now = self._clock()
        self._began_s = now
        self._tick_position_s = self._play.position(now)  # of tick 0
        self._last: Slot | None = None  # started last
        self._last_ticket = 0
        self._last_picture: Picture | None = None
        # Those that are on their way count when they are displayed; their ticks say nothing now.
        self._swaps = {ticket: _Swap(None, swap.due_s) for ticket, swap in self._swaps.items()}
        self._meter.note_break()
        self._source.clear()
        if self._ticks:
            self._ticks.restart()

    # -- the loop

    def run(self) -> PlayReport:
        """Play to the end, or until it is stopped.

        Raises
        ------
        TransportError, DeviceError, DesyncError
            As of `Display.present`.

        """
        with self._turn() as operations:
            queue = operations.queue
            queue.on_shown = self._note_shown
            if first := self.schedule.slot_at(self._tick_position_s):
                self._request(operations, first)
        try:
            return self._run()
        finally:
            queue.on_shown = lambda _ticket, _now: None

    def _run(self) -> PlayReport:
        began_s = self._clock()
        self._play.seek(self._tick_position_s, began_s)  # the first frame is ready now
        self._began_s = began_s
        while not self._stopped and self._iterate():
            if self._observer is not None:
                self._observer(self)
        with self._turn() as operations:
            if not self._stopped:
                operations.flush(_FLUSH_S)
            playback = operations.queue.playback.reading()
            return self._meter.report(
                seconds=self._clock() - began_s,
                wrong=playback.wrong,
                repaired=playback.repaired,
                wire_bytes=operations.wire_bytes - self._bytes_before,
            )

    def _iterate(self) -> bool:
        """Do what is due, and wait a little; return False at the end."""
        with self._turn() as operations:
            if operations.reconnects != self._reconnects:  # time went on meanwhile
                self._reconnects = operations.reconnects
                self._restart()
            if self._ticks and self._ticks.is_overloaded:
                self._ticks = None
            if self._ticks and not self.paused:
                by_holds = self._longest_hold >= _LEAST_HOLD
                fill = self._hold_frames if by_holds else self._fill_ticks
                wake_s = fill(operations, self._ticks)
            else:
                wake_s = self._start_due(operations)
            if wake_s is None:
                return False
            left_s = min(wake_s - self._clock(), _MAX_WAIT_S)
            if self._source.busy:
                left_s = min(left_s, _WORKER_WAIT_S)
            operations.pump(wait=left_s > 0, within_s=max(left_s, _MIN_WAIT_S))
        return True

    def _period_s(self, slot: Slot) -> float:
        return (slot.ends_s - slot.begins_s) / self._play.speed

    def _request(self, operations: DisplayOperations, slot: Slot) -> None:
        self._source.request(slot, operations.queue.encoding_for, self._period_s(slot))

    def _start(
        self,
        operations: DisplayOperations,
        slot: Slot,
        picture: Picture,
        tick: int | None,
        hold_ticks: int = 0,
    ) -> None:
        """Start a frame."""
        due_s = max(self._play.moment(slot.begins_s), self._began_s)
        self._meter.frames += slot.ordinal - self._last.ordinal if self._last else 1
        began_s = time.thread_time()
        self._last_ticket = operations.queue.start_unwaited(picture, hold_ticks)
        self._swaps[self._last_ticket] = _Swap(tick, due_s)
        self._last, self._last_picture = slot, picture
        operations.send_encoded()
        self._source.note_encoding(time.thread_time() - began_s)

    def _note_shown(self, ticket: int, now: float) -> None:
        """Record a swap; those before it whose reports were lost have happened, too."""
        for started in [each for each in self._swaps if each <= ticket]:
            swap = self._swaps.pop(started)
            self._meter.note_swap(now, swap.due_s)
            if swap.tick is not None and self._ticks and started == ticket:
                period_s = self._period_s(self._last) if self._last else 0.0
                self._ticks.note_swap(swap.tick, now, period_s / 2 * self._ticks.refresh_hz)

    # -- paced by the host's clock

    def _start_due(self, operations: DisplayOperations) -> float | None:
        """Start the frame that is due; return when to look again, or None at the end."""
        now = self._clock()
        after = self._last.ordinal if self._last else -1
        position_s = self._play.position(now)
        due = self._due(position_s)
        if due is None:
            return None
        if not operations.queue.may_start:
            return now + _MAX_WAIT_S
        if not self.paused:
            self._request_ahead(operations, now, due)
        elif after < due.ordinal:
            self._request(operations, due)
        ready = self._source.newest(after, due.ordinal)
        if ready is None:
            waits = self.paused or after < due.ordinal
            following_s = now + _MAX_WAIT_S if waits else self._play.moment(due.ends_s)
            return max(following_s, now + _MIN_WAIT_S)
        slot, picture = ready
        if self._delays and self._play.moment(slot.begins_s) < now:
            self._play.seek(slot.begins_s, now)
        self._start(operations, slot, picture, None)
        return self._clock()

    def _due(self, position_s: float) -> Slot | None:
        """Return the frame that is due at a position; None if the last one has had its time."""
        if self._delays and self._last:
            following = self.schedule.slot(self._last.ordinal + 1)
            return (
                following
                if following and following.begins_s <= position_s
                else (self._last if position_s < self._last.ends_s else following)
            )
        if due := self.schedule.slot_at(position_s):
            return due
        frames = self.schedule.frames
        end = self.schedule.slot(frames - 1) if frames else None
        return None if self._last == end else end  # the last one is never left out

    def _request_ahead(self, operations: DisplayOperations, now: float, due: Slot) -> None:
        """Request the frames that will be due when they are ready."""
        after = self._last.ordinal if self._last else due.ordinal - 1
        pending = self._source.pending(after)
        while len(pending) < self._source.prefetch:
            ordinal = max(pending, default=after) + 1
            ready_s = self._play.position(now + (len(pending) + 1) * self._source.estimate_s)
            slot = self.schedule.slot_at(ready_s)
            if slot is None or slot.ordinal < ordinal or self._delays or not self._last:
                slot = self.schedule.slot(ordinal)
            if slot is None:
                return
            self._request(operations, slot)
            pending.append(slot.ordinal)

    # -- paced by the device's ticks

    def _fill_ticks(self, operations: DisplayOperations, ticks: TickClock) -> float | None:
        """Start what the next tick shows; return when to look again, or None at the end."""
        queue = operations.queue
        now = self._clock()
        step_s = self._play.speed / ticks.refresh_hz
        if queue.backlog >= ticks.ahead or not queue.line_is_free:
            self._request_next(operations, ticks.next, step_s)
            return now + _MAX_WAIT_S
        waiting = [swap.tick for swap in self._swaps.values() if swap.tick is not None]
        tick = ticks.take(now, min(waiting, default=None) if queue.backlog else None)
        slot = self._due(self._tick_position_s + tick * step_s)
        if slot is None:
            return None
        if self._last is None or slot.ordinal > self._last.ordinal:
            self._request(operations, slot)
            after = self._last.ordinal if self._last else -1
            if ready := self._source.newest(after, slot.ordinal):
                self._start(operations, *ready, tick)
                return now
            if queue.backlog > 1 or self._last is None:
                ticks.put_back()
                return now + _WORKER_WAIT_S
        self._repeat(operations, tick)
        return now

    def _repeat(self, operations: DisplayOperations, tick: int, hold_ticks: int = 0) -> None:
        """Start a frame that shows what the one before it shows."""
        if self._last_picture is not None:
            queue = operations.queue
            self._last_ticket = queue.repeat(self._last_ticket, self._last_picture, hold_ticks)
            self._swaps[self._last_ticket] = _Swap(tick, None)

    def _hold_frames(self, operations: DisplayOperations, ticks: TickClock) -> float | None:
        """Start the frame that follows, and have the device hold it until its tick.

        Only frames that stay for longer than a hold may last are repeated. Returns when to look
        again, or None at the end.
        """
        queue = operations.queue
        now = self._clock()
        step_s = self._play.speed / ticks.refresh_hz
        due = ticks.next
        if self._last is not None:
            ends = (self._last.ends_s - self._tick_position_s) / step_s
            due = max(due, math.ceil(ends - 1e-6))
        if ticks.last is not None:
            due = min(due, ticks.last + self._longest_hold)
        waiting = [swap.tick for swap in self._swaps.values() if swap.tick is not None]
        oldest = min(waiting, default=None) if queue.backlog else None
        is_end = self._due(self._tick_position_s + due * step_s) is None
        early = ticks.is_early(now, due, oldest) and (queue.backlog > 0 or is_end)
        most = 2 if ticks.place(now) is None else ticks.ahead
        if early or queue.backlog >= most or not queue.line_is_free:
            self._request_next(operations, ticks.next, step_s)
            return now + _MAX_WAIT_S
        ticks.next = due
        tick = ticks.take(now, oldest)
        slot = self._due(self._tick_position_s + tick * step_s)
        if slot is None:
            return None
        if self._last is not None and slot.ordinal <= self._last.ordinal:
            self._repeat(operations, tick, ticks.hold(tick))
            return now
        self._request(operations, slot)
        ready = self._source.newest(self._last.ordinal if self._last else -1, slot.ordinal)
        if ready is None:
            ticks.put_back()
            return now + _WORKER_WAIT_S
        self._start(operations, *ready, tick, ticks.hold(tick))
        return now

    def _request_next(self, operations: DisplayOperations, tick: int, step_s: float) -> None:
        """Request the frames that follow, as soon as there is time for it."""
        position_s = self._tick_position_s + tick * step_s
        for _ in range(self._source.prefetch):
            if self._last is not None:
                ticks = math.ceil((self._last.ends_s - position_s) / step_s - 1e-6)
                position_s += max(0, ticks) * step_s
            if slot := self.schedule.slot_at(position_s + 1e-9):
                self._request(operations, slot)
                position_s = max(slot.ends_s, position_s + step_s)

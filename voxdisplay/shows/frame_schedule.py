"""Frame schedule: shows in a row, and which frame is due at a time.

All times follow from the numbers of turn, segment and frame; none is the sum of earlier ones. Must
not know a clock.
"""

from __future__ import annotations

import bisect
import math
import random
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

from voxdisplay.shows.show import Show

_ROUNDING = 1e-6  # frames: times that are computed twice may differ in their last bits


@dataclass(frozen=True, slots=True)
class Segment:
    """Part of a show that is played once.

    Attributes
    ----------
    show : Show
    start_s, until_s : float
        The part, in seconds of the show; by default all of it. A still picture stays until
        ``until_s``.
    speed : float
        Seconds of the show per second of the schedule.

    """

    show: Show
    start_s: float = 0.0
    until_s: float = math.inf
    speed: float = 1.0

    @property
    def end_s(self) -> float:
        """End of the part, in seconds of the show."""
        show = self.show
        if show.frame_count == 1:
            return self.until_s if math.isfinite(self.until_s) else max(show.duration, 1 / show.fps)
        return min(self.until_s, show.frame_count / show.fps)

    @property
    def length_s(self) -> float:
        """Seconds of the schedule; 0 or less for a part that is empty."""
        return (self.end_s - self.start_s) / self.speed

    @property
    def first(self) -> int:
        """Number of its first frame."""
        return self.number_at(self.start_s)

    @property
    def frames(self) -> int:
        """Count of its frames."""
        show = self.show
        last = min(math.ceil(self.end_s * show.fps - _ROUNDING), show.frame_count) - 1
        return max(last - self.first + 1, 1)

    def number_at(self, show_s: float) -> int:
        """Return the number of the frame that is due at a time of the show."""
        return min(math.floor(show_s * self.show.fps + _ROUNDING), self.show.frame_count - 1)


@dataclass(frozen=True, slots=True)
class Slot:
    """A frame in its place on the schedule.

    Attributes
    ----------
    ordinal : int
        Its number among all frames of the schedule.
    segment : int
        Index of its segment.
    number : int
        Its number in the show.
    begins_s, ends_s : float
        When it is due, and when the next one is, in seconds of the schedule.

    """

    ordinal: int
    segment: int
    number: int
    begins_s: float
    ends_s: float


class FrameSchedule:
    """Segments that are played one after the other, and again if it repeats.

    Parameters
    ----------
    segments : sequence of Segment
    turns : int
        How often they are played; 0: for ever.
    shuffle : bool
        Whether each turn has another order: always the same for the same turn.

    Raises
    ------
    ValueError
        If there is nothing to play.

    """

    def __init__(
        self, segments: Sequence[Segment], turns: int = 1, *, shuffle: bool = False
    ) -> None:
        self.segments = tuple(segment for segment in segments if segment.length_s > 0)
        if not self.segments:
            raise ValueError("there is nothing to play: the part of each show is empty")
        self.turns = turns
        self._shuffle = shuffle
        self.turn_s = math.fsum(segment.length_s for segment in self.segments)
        self.turn_frames = sum(segment.frames for segment in self.segments)
        self._order = (-1, tuple(range(len(self.segments))))
        self._place(self._order[1])

    @property
    def duration_s(self) -> float:
        """Seconds in all; infinity if it repeats for ever."""
        return self.turns * self.turn_s if self.turns else math.inf

    @property
    def frames(self) -> int | None:
        """Count of all frames; None if it repeats for ever."""
        return self.turns * self.turn_frames or None

    def repeated(self, turns: int) -> FrameSchedule:
        """Return the same with another number of turns; 0: for ever."""
        return FrameSchedule(self.segments, turns, shuffle=self._shuffle)

    def _place(self, order: tuple[int, ...]) -> None:
        lengths = [self.segments[index].length_s for index in order]
        counts = [self.segments[index].frames for index in order]
        self._starts = [0.0, *accumulate(lengths)][:-1]
        self._before = [0, *accumulate(counts)][:-1]

    def _order_of(self, turn: int) -> tuple[int, ...]:
        if self._shuffle and self._order[0] != turn:
            order = list(range(len(self.segments)))
            random.Random(turn).shuffle(order)
            self._order = turn, tuple(order)
            self._place(self._order[1])
        return self._order[1]

    def slot_at(self, time_s: float) -> Slot | None:
        """Return the frame that is due at a time; None before the beginning and after the end."""
        if time_s < 0:
            return None
        turn = math.floor(time_s / self.turn_s + 1e-12)
        if self.turns and turn >= self.turns:
            return None
        order = self._order_of(turn)
        within_s = max(0.0, time_s - turn * self.turn_s)
        place = bisect.bisect_right(self._starts, within_s + 1e-9) - 1
        segment = self.segments[order[place]]
        since_s = within_s - self._starts[place]
        number = segment.number_at(segment.start_s + since_s * segment.speed)
        number = min(number, segment.first + segment.frames - 1)
        return self._slot(turn, place, number)

    def slot(self, ordinal: int) -> Slot | None:
        """Return a frame by its number among all; None if there are not so many."""
        turn, within = divmod(ordinal, self.turn_frames)
        if ordinal < 0 or (self.turns and turn >= self.turns):
            return None
        order = self._order_of(turn)
        place = bisect.bisect_right(self._before, within) - 1
        number = self.segments[order[place]].first + within - self._before[place]
        return self._slot(turn, place, number)

    def _slot(self, turn: int, place: int, number: int) -> Slot:
        index = self._order_of(turn)[place]
        segment = self.segments[index]
        base_s = turn * self.turn_s + self._starts[place]
        end_s = base_s + segment.length_s
        step_s = 1 / (segment.show.fps * segment.speed)
        since_first = number - segment.first
        lead_s = segment.first / segment.show.fps - segment.start_s  # 0 or less
        begins_s = base_s + max(0.0, lead_s / segment.speed + since_first * step_s)
        last = since_first == segment.frames - 1
        ends_s = end_s if last else base_s + lead_s / segment.speed + (since_first + 1) * step_s
        ordinal = turn * self.turn_frames + self._before[place] + since_first
        return Slot(ordinal, index, number, begins_s, ends_s)

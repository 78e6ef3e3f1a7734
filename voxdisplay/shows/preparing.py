"""Preparation of frames ahead of their time, in this process or in one beside it.

Must not know displays or when a frame is due.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import Final, TypeAlias

from voxdisplay.frame import Frame
from voxdisplay.shows.frame_schedule import Slot
from voxdisplay.shows.show import EncodedFrame, EncodedShow, Show
from voxdisplay.shows.worker_process import Encoding, WorkerProcess

Picture: TypeAlias = Frame | EncodedFrame

# A frame that takes a larger share of its period is prepared in another process: its preparation
# would delay the frames before it.
_WORKER_SHARE: Final = 0.25
_MEASURED: Final = 5  # frames
PREFETCH: Final = 3


class FrameSource:
    """Prepared frames of some shows.

    Parameters
    ----------
    shows : sequence of Show
        By the segments of a schedule.
    check : callable
        Returns a frame for how the display stands; raises if it is not of the display's kind.
    clock : callable
        Returns seconds.
    note : callable
        Called with what a current limit has done to a frame of another process.

    """

    def __init__(
        self,
        shows: Sequence[Show],
        *,
        check: Callable[[Frame], Frame] = lambda frame: frame,
        clock: Callable[[], float] = time.perf_counter,
        note: Callable[[str], None] = lambda _text: None,
    ) -> None:
        self._check, self._clock, self._note = check, clock, note
        self._shows = tuple(shows)
        self._may_use_worker = True
        self._worker: WorkerProcess | None = None
        self._ready: dict[int, tuple[Slot, Picture]] = {}
        self._requested: dict[int, Slot] = {}  # of the other process
        # What it has not answered yet, unwanted frames included: more of them would
        # fill the pipe to it, and the player would wait for it.
        self._unanswered: set[int] = set()
        self._seconds: deque[float] = deque(maxlen=_MEASURED)
        # Of the processor: on a busy machine another process would only have to wait, too.
        self._work_s: deque[float] = deque(maxlen=_MEASURED)

    @property
    def uses_worker(self) -> bool:
        """True if another process prepares frames."""
        return self._worker is not None and self._worker.ready

    @property
    def prefetch(self) -> int:
        """Number of frames to request ahead."""
        return PREFETCH if self.uses_worker else 1

    @property
    def busy(self) -> bool:
        """True if another process is preparing frames."""
        return bool(self._requested)

    @property
    def estimate_s(self) -> float:
        """Seconds that a frame takes."""
        return sorted(self._seconds)[len(self._seconds) // 2] if self._seconds else 0.0

    def note_encoding(self, work_s: float) -> None:
        """Add the processor time of encoding the last frame to that of its preparation."""
        if self._work_s:
            self._work_s[-1] += work_s

    def request(self, slot: Slot, encoding: Encoding, period_s: float) -> None:
        """Have a frame prepared, unless that has been requested.

        Parameters
        ----------
        slot : Slot
        encoding : tuple
            For the device and its line: longest payload, features, bytes per second.
        period_s : float
            How long it is on display.

        """
        if slot.ordinal in self._unanswered:
            self._requested[slot.ordinal] = slot  # it may have been forgotten meanwhile
        self._collect()
        if slot.ordinal in self._ready or slot.ordinal in self._requested:
            return
        if self._worker is None and self._is_slow(period_s):
            self._may_use_worker = False  # once: a process that has ended is not started again
            self._worker = WorkerProcess.start(self._shows)
        if self._worker is not None and self._worker.ready:
            if len(self._unanswered) < PREFETCH:
                self._unanswered.add(slot.ordinal)
                self._requested[slot.ordinal] = slot
                self._worker.request(slot.ordinal, slot.segment, slot.number, encoding)
            return
        began_s, work_s = self._clock(), time.thread_time()
        self._ready[slot.ordinal] = slot, self._prepare(slot, encoding)
        self._seconds.append(self._clock() - began_s)
        self._work_s.append(time.thread_time() - work_s)

    def _is_slow(self, period_s: float) -> bool:
        measured = len(self._work_s) == _MEASURED
        middle_s = sorted(self._work_s)[_MEASURED // 2] if measured else 0.0
        return self._may_use_worker and middle_s > _WORKER_SHARE * period_s

    def _prepare(self, slot: Slot, encoding: Encoding) -> Picture:
        show = self._shows[slot.segment]
        if isinstance(show, EncodedShow):
            encoded = show.encoded_frame(slot.number, encoding[0], encoding[1])
            if encoded is not None:
                # Another object for each time: which one is displayed is told by identity.
                return EncodedFrame(encoded.payloads, encoded.digest)
        frame = show.frame(slot.number)
        return self._check(frame).copy()

    def _collect(self) -> None:
        """Take what the other process has prepared, or failed to."""
        worker = self._worker
        if worker is None:
            return
        for ordinal, encoded, seconds in worker.results():
            self._unanswered.discard(ordinal)
            if encoded.note:
                self._note(encoded.note)
            if slot := self._requested.pop(ordinal, None):
                self._ready[ordinal] = slot, encoded
                self._seconds.append(seconds)
        if worker.ended:
            self.close()
            self._requested.clear()
            self._unanswered.clear()

    def pending(self, after: int) -> list[int]:
        """Return the ordinals of frames behind one that are prepared or requested."""
        self._collect()
        return [each for each in (*self._ready, *self._requested) if each > after]

    def newest(self, after: int, until: int) -> tuple[Slot, Picture] | None:
        """Take the newest prepared frame of a range; older ones are forgotten.

        Parameters
        ----------
        after, until : int
            Ordinals: the first is excluded, the second included.

        Raises
        ------
        Exception
            That which a show has raised in the other process.

        """
        self._collect()
        for ordinal in [each for each in self._ready if each <= after]:
            del self._ready[ordinal]
        found = max((each for each in self._ready if each <= until), default=None)
        if found is None:
            return None
        taken = self._ready[found]
        for ordinal in [each for each in self._ready if each <= found]:
            del self._ready[ordinal]
        return taken

    def clear(self) -> None:
        """Forget all frames, because others are wanted next."""
        self._ready.clear()
        self._requested.clear()

    def close(self) -> None:
        """End the other process. Twice is fine."""
        if self._worker is not None:
            self._worker.close()
            self._worker = None

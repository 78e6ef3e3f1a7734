"""Queue of frames that several displays show together: the newest pending one, and those begun.

Stands in for `FrameQueue` where a display is made of parts: a frame counts as shown when all parts
that are present show it. Must not know how a part sends.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from voxdisplay.display.decoded_picture import decoded_picture
from voxdisplay.display.playback_counts import Playback, PlaybackMeter
from voxdisplay.display.swap_barrier import SwapBarrier
from voxdisplay.frame import Frame

if TYPE_CHECKING:
    from voxdisplay.display.device_info import DeviceInfo
    from voxdisplay.display.frame_queue import Picture
    from voxdisplay.display.part_worker import PartWorker

# One at the next tick, one on the lines, and one that its part begins by itself behind it.
_MAX_UNSHOWN = 3


class TiledMeter(PlaybackMeter):
    """Counter of frames, which asks the parts how many of theirs were wrong.

    Parameters
    ----------
    workers : sequence of PartWorker
    presented : int
        As of `PlaybackMeter`.

    """

    def __init__(self, workers: Sequence[PartWorker], presented: int = 0) -> None:
        super().__init__(presented)
        self._workers = workers
        self._before = self._wrong_and_repaired()

    def _wrong_and_repaired(self) -> tuple[int, int]:
        readings = [worker.playback for worker in self._workers]
        return sum(each.wrong for each in readings), sum(each.repaired for each in readings)

    def reading(self) -> Playback:
        """Return the counts so far."""
        wrong, repaired = self._wrong_and_repaired()
        before = self._before
        return replace(super().reading(), wrong=wrong - before[0], repaired=repaired - before[1])


class TiledQueue:
    """Frames that the parts are to show.

    Parameters
    ----------
    workers : sequence of PartWorker
        All open.
    info : DeviceInfo
        Of the whole display.

    Attributes
    ----------
    frames : int
        Frames displayed.
    playback : TiledMeter
    on_shown : callable
        Called with ticket and time when a frame is displayed that nobody waits for.
    displayed : Frame or None
        The frame that all parts have proved last.
    latest : Frame or None
        That which was displayed last, proved or not.

    """

    # To a player, a display without refresh ticks: those of several devices do not agree.
    backlog = 0
    line_is_free = True

    def __init__(self, workers: Sequence[PartWorker], info: DeviceInfo) -> None:
        self.frames = 0
        self.playback: PlaybackMeter = TiledMeter(workers)
        self.on_shown: Callable[[int, float], None] = lambda _ticket, _now: None
        self.displayed: Frame | None = None
        self.latest: Frame | None = None
        self._workers = workers
        self._info = info
        self._pending: Frame | None = None
        self._unshown: dict[int, Frame] = {}  # by ticket
        self._ticket = 0

    @property
    def has_unwaited(self) -> bool:
        """True if a frame is neither displayed nor left out."""
        return self._pending is not None or bool(self._unshown)

    busy = has_unwaited

    @property
    def may_start(self) -> bool:
        """True if the lines would run idle without another frame."""
        return len(self._unshown) < _MAX_UNSHOWN and all(
            worker.is_hungry for worker in self._workers if worker.is_present
        )

    @property
    def encoding_for(self) -> tuple[int, tuple[str, ...], float]:
        """How another process is to encode frames, which are cut here: in the plainest ops."""
        return self._info.max_payload_bytes, (), 0.0

    def replace_pending(self, frame: Frame) -> None:
        """Have a copy of a frame started when its turn comes, unless a newer one follows."""
        copy = frame.copy()
        if self._pending is not None:
            self.playback.note_dropped()
        self._pending = copy
        self.playback.note_presented()

    def start_unwaited(self, picture: Picture, hold_ticks: int = 0) -> int:
        """Start a frame that nobody waits for at once, and return its ticket."""
        del hold_ticks  # there are no ticks: always 0
        self.playback.note_presented()
        return self._start(decoded_picture(picture, self._info))

    def repeat(self, ticket: int, picture: Picture, hold_ticks: int = 0) -> int:
        """Return the ticket of what is shown: no tick wants a frame."""
        del picture, hold_ticks
        return ticket

    def start_pending(self) -> None:
        """Start the frame that waits, if the lines need one."""
        if self._pending is not None and self.may_start:
            frame, self._pending = self._pending, None
            self._start(frame)

    def _start(self, frame: Frame) -> int:
        self._ticket += 1
        self._unshown[self._ticket] = frame
        barrier = SwapBarrier([worker for worker in self._workers if worker.is_present])
        for worker in self._workers:
            worker.stream(worker.cut(frame), self._ticket, barrier)
        return self._ticket

    def collect_shown(self) -> None:
        """Take note of frames that all parts show by now."""
        present = [worker for worker in self._workers if worker.is_present]
        if not present:
            return
        shown = min(worker.shown_number for worker in present)
        done = [ticket for ticket in self._unshown if ticket <= shown]
        if not done:
            return
        last = done[-1]
        now = max(worker.shown_s for worker in present)
        frame = self._unshown[last]
        for ticket in done:
            del self._unshown[ticket]
        self.frames += len(done)
        self.playback.note_shown(len(done), now)
        self.latest = frame
        self.displayed = frame if len(present) == len(self._workers) else None
        self.on_shown(last, now)

    def note_waited(self, frame: Frame, now: float, *, proved: bool) -> None:
        """Record that a frame that was waited for is displayed."""
        self.frames += 1
        self.playback.note_presented()
        self.playback.note_shown(1, now)
        self.latest = frame
        self.displayed = frame if proved else None

    def drop_all(self) -> None:
        """Forget frames that are not displayed yet."""
        self._pending = None
        self._unshown.clear()

    def restart_playback(self) -> None:
        """Count anew, from the frames that are still on their way."""
        waiting = len(self._unshown) + (self._pending is not None)
        self.playback = TiledMeter(self._workers, waiting)

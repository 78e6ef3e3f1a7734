"""Operations and queue of a sink: the newest frame is sent when its rate allows.

Stand in for `DisplayOperations` and `FrameQueue` where nothing answers: a frame that was sent
counts as shown, and nothing is proved. Must not know how a sink sends.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from voxdisplay.display.connection import MAX_WAIT_S, Clock
from voxdisplay.display.decoded_picture import decoded_picture
from voxdisplay.display.flushing import Flushing
from voxdisplay.display.playback_counts import PlaybackMeter
from voxdisplay.display.receipt import Receipt
from voxdisplay.errors import IncompatibleDevice
from voxdisplay.frame import Frame

if TYPE_CHECKING:
    from voxdisplay.display.display_operations import Hold, Progress, Work
    from voxdisplay.display.frame_queue import Payloads, Picture
    from voxdisplay.display.sink_connection import SinkConnection

_EARLY_S: Final = 1e-3  # by which clocks and sleeps may be inexact


class SinkQueue:
    """Frame that is to be sent next, and the one that was sent last.

    Parameters
    ----------
    connection : SinkConnection
    clock : callable
        Returns seconds.

    Attributes
    ----------
    frames : int
        Frames sent.
    playback : PlaybackMeter
    on_shown : callable
        Called with ticket and time when a frame was sent that nobody waits for.
    shown_s : float
        When a frame was sent last.
    displayed : Frame or None
        That which was sent last.

    """

    # To a player, a sink is a display without refresh ticks whose line is free.
    backlog = 0
    line_is_free = True

    def __init__(self, connection: SinkConnection, clock: Clock) -> None:
        self.frames = 0
        self.playback = PlaybackMeter()
        self.on_shown: Callable[[int, float], None] = lambda _ticket, _now: None
        self.shown_s = -math.inf
        self.displayed: Frame | None = None
        self.info = connection.info
        self._clock = clock
        self._period_s = 1 / connection.sink.max_fps
        self._due_s = -math.inf
        self._pending: Frame | None = None
        self._ticket = 0

    @property
    def latest(self) -> Frame | None:
        """Frame that was sent last."""
        return self.displayed

    @property
    def has_unwaited(self) -> bool:
        """True if a frame waits to be sent."""
        return self._pending is not None

    busy = has_unwaited

    @property
    def may_start(self) -> bool:
        """True if a frame would be sent at once."""
        return self._pending is None and self.left_s <= 0

    @property
    def left_s(self) -> float:
        """Seconds until the sink's rate allows another frame; 0 or less: now."""
        left_s = self._due_s - self._clock()
        return left_s if left_s > _EARLY_S else min(left_s, 0.0)

    @property
    def next_ticket(self) -> int:
        """Ticket of the frame that is handed over next."""
        return self._ticket + 1

    @property
    def encoding_for(self) -> tuple[int, tuple[str, ...], float]:
        """How another process is to encode frames: in the plainest ops."""
        return self.info.max_payload_bytes, self.info.features, 0.0

    def replace_pending(self, frame: Frame) -> None:
        """Have a copy of a frame sent when its turn comes, unless a newer one follows."""
        self._replace(frame.copy())

    def start_unwaited(self, picture: Picture, hold_ticks: int = 0) -> int:
        """Have a frame sent when its turn comes, and return its ticket."""
        del hold_ticks  # there are no ticks: always 0
        self._replace(decoded_picture(picture, self.info))
        return self._ticket

    def repeat(self, ticket: int, picture: Picture, hold_ticks: int = 0) -> int:
        """Return the ticket of what is shown: there is no tick that would want a frame."""
        del picture, hold_ticks
        return ticket

    def _replace(self, frame: Frame) -> None:
        if self._pending is not None:
            self.playback.note_dropped()
        self._pending = frame
        self._ticket += 1
        self.playback.note_presented()

    def restart_playback(self) -> None:
        """Count anew."""
        self.playback = PlaybackMeter(int(self.has_unwaited))

    def take_pending(self) -> Frame | None:
        """Return the frame that waits, which then waits no longer."""
        frame, self._pending = self._pending, None
        return frame

    def drop_pending(self) -> None:
        """Drop the frame that waits."""
        if self.take_pending() is not None:
            self.playback.note_dropped()

    def note_sent(self, frame: Frame, began_s: float, *, waited: bool) -> None:
        """Record that a frame was sent, from a time on."""
        # From when it was due, if that was just now: late wake-ups do not add up.
        is_late = began_s - self._due_s > self._period_s / 2
        self._due_s = (began_s if is_late else self._due_s) + self._period_s
        self.shown_s = now = self._clock()
        self.displayed = frame
        self.frames += 1
        self.playback.note_shown(1, now)
        if not waited:
            self.on_shown(self._ticket, now)


class SinkOperations(Flushing):
    """Operations on one sink.

    Parameters
    ----------
    connection : SinkConnection
    clock, sleep : callable
        Return seconds, and wait for some.

    Attributes
    ----------
    queue : SinkQueue

    """

    refresh_hz = 0.0
    reconnects = 0
    max_hold_ticks = 0

    queue: SinkQueue

    def __init__(
        self, connection: SinkConnection, clock: Clock, sleep: Callable[[float], None]
    ) -> None:
        self.queue = SinkQueue(connection, clock)
        self._sink = connection.sink
        self._counters = connection.counters
        self._clock, self._sleep = clock, sleep
        self._held: Frame | None = None

    @property
    def wire_bytes(self) -> int:
        """Bytes sent so far."""
        return self._counters.wire_bytes

    def pump(self, *, wait: bool = True, within_s: float = MAX_WAIT_S) -> None:
        """Send the frame that waits, if it is due; else wait until one would be."""
        if wait:
            left_s = self.queue.left_s
            if left_s > 0 or not self.queue.has_unwaited:
                self._sleep(min(left_s, within_s) if left_s > 0 else within_s)
        if self.queue.left_s <= 0 and (frame := self.queue.take_pending()) is not None:
            self._send(frame, waited=False)

    def send_encoded(self) -> None:
        """Send the frame that waits, if it is due."""
        self.pump(wait=False)

    def show(self, frame: Frame, progress: Progress | None, hold: Hold | None = None) -> Receipt:
        """Send a frame as soon as the sink's rate allows. See `DisplayOperations.show`."""
        began_s = self._clock()
        while (left_s := self.queue.left_s) > 0:
            self._sleep(left_s)
        if hold is not None:
            hold(_nothing)
        frame = frame.copy()
        self.queue.playback.note_presented()
        packets, wire_bytes = self._send(frame, waited=True)
        if progress:
            progress(packets, packets)
        return Receipt(
            frame=self.queue.frames,
            voxels=len(frame.lit()[0]),
            packets=packets,
            wire_bytes=wire_bytes,
            retransmitted=0,
            elapsed_s=self._clock() - began_s,
            digest=None,
        )

    def start_held(
        self, frame: Frame, payloads: Payloads | None = None, work: Work | None = None
    ) -> int:
        """Keep a frame until `release`, and return its ticket."""
        del payloads, work
        self._held = frame
        return self.queue.next_ticket

    def encode(self, frame: Frame) -> Payloads:
        """Return an empty iterator: there are no packets of protocol.md."""
        del frame
        return iter(())

    def release(self, ticket: int, hold: Hold) -> None:
        """Send the frame that was kept when `hold` returns and the sink's rate allows."""
        hold(_nothing)  # it may take long to send: that is not for the threads of others
        frame, self._held = self._held, None
        if frame is not None and ticket == self.queue.next_ticket:
            self.queue.start_unwaited(frame)
            self.pump(wait=False)

    def _send(self, frame: Frame, *, waited: bool) -> tuple[int, int]:
        began_s = self._clock()
        packets, wire_bytes = self._sink.send(frame.memory.rgb())
        self._counters.packets += packets
        self._counters.wire_bytes += wire_bytes
        self.queue.note_sent(frame, began_s, waited=waited)
        return packets, wire_bytes

    def displayed_frame(self, blank: Frame) -> Frame:
        """Return the frame that was sent last.

        Raises
        ------
        IncompatibleDevice
            If there was none.

        """
        del blank
        if self.queue.displayed is None:
            raise IncompatibleDevice(
                "it is not known what is on display, and nothing answers on this port",
                hint="present a whole frame first: display.frame() without keep",
            )
        return self.queue.displayed

    def request_digest(self) -> None:
        """Return None: nothing answers."""

    def can(self, feature: str) -> bool:
        """Return False: nothing has announced anything."""
        del feature
        return False

    def blank(self, timeout_s: float) -> None:
        """Send a dark frame at once; the one that waits is dropped."""
        del timeout_s
        self.queue.drop_pending()
        info = self.queue.info
        self._send(Frame(info.grid, info.format), waited=True)


def _nothing() -> None:
    pass

"""Queue of frames of one display: displayed, in transmission, pending.

A frame is encoded in portions while it is sent, in full or as its difference from what is proved to
be displayed. Of frames that nobody waits for, the newest is started when the line needs one. Must
not wait, read back, or know bytes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from typing import TypeAlias

from voxdisplay.display.connection import Connection
from voxdisplay.display.playback_counts import PlaybackMeter
from voxdisplay.display.receipt import WRONG_TWICE_HINT, describe_wrong_digest
from voxdisplay.errors import DesyncError
from voxdisplay.frame import Frame
from voxdisplay.link import PictureId
from voxdisplay.shows.show import EncodedFrame
from voxdisplay.wire.features import UNKNOWN_BYTES_PER_S, select_features

# With so many lit voxels for each byte of the difference, the full frame surely takes more bytes.
_LIT_PER_DIFFERENCE_BYTE = 64
# One frame that the device shows at its next refresh tick, and one behind it.
_MAX_UNSHOWN = 2
_NO_PICTURE: PictureId = (0, 0)  # is never displayed

Picture: TypeAlias = Frame | EncodedFrame
Payloads: TypeAlias = Iterator[list[bytes]]


class FrameQueue:
    """Frames that a display is to show.

    Parameters
    ----------
    connection : Connection
        The device. Its link is given payloads; whoever pumps it reports its events here.

    Attributes
    ----------
    frames : int
        Number of frames that have been displayed.
    playback : PlaybackMeter
        Counts what is presented, shown and dropped.
    on_shown : callable
        Called with ticket and time when a frame is displayed that nobody waits for.
    shown_s : float
        When the device reported last that it displays a frame.

    """

    def __init__(self, connection: Connection) -> None:
        self.frames = 0
        self.shown_s = -math.inf
        self.playback = PlaybackMeter()
        self.on_shown: Callable[[int, float], None] = _ignore_shown
        self._connection = connection
        self._link = connection.link
        self._last: Picture | None = None  # that was displayed
        self._shown: dict[int, int | None] = {}  # ticket -> digest
        self._unwaited: dict[int, Picture] = {}  # ticket -> a copy of the frame
        self._repeats: set[int] = set()  # tickets of frames that show what the one before shows
        self._displayed: tuple[Frame, PictureId] | None = None
        self._pending: Picture | None = None  # handed over, and not started
        self._encoder: _Encoder | None = None
        self._held: int | None = None  # ticket of the frame whose COMMIT waits for `release`
        self._wrong_in_a_row = 0  # of unwaited frames

    # -- in

    def enqueue(
        self, frame: Picture, *, held: bool = False, payloads: Payloads | None = None
    ) -> int:
        """Start a frame and return its ticket.

        It is sent in full, or as its difference from what is displayed, whichever is shorter. It
        must not change until it is displayed.

        Parameters
        ----------
        frame : Picture
        held : bool
            Whether the device gets all of it but the COMMIT, in an empty packet, which waits for
            `release`. No other frame may be started before.
        payloads : iterator of list of bytes, optional
            From `iter_payloads`, of a held frame.

        """
        if held:
            return self._enqueue_held(frame, payloads)
        if isinstance(frame, EncodedFrame):
            return self._link.present(list(frame.payloads))
        link, displayed = self._link, self.displayed
        if displayed and not link.backlog:
            full_payloads = cache(partial(self.payloads, frame))
            lit = len(frame.lit()[0])
            if 2 * len(frame.changed_indices(displayed)) < lit:
                changes = frame.difference(displayed, link.payload_bytes, self._features)
                size = sum(map(len, changes))
                if size * _LIT_PER_DIFFERENCE_BYTE < lit or size < sum(map(len, full_payloads())):
                    return link.present_difference(link.displayed, changes, full_payloads)
                return link.present(full_payloads())
        ticket = link.open_frame()
        self._encoder = _Encoder(ticket, self.iter_payloads(frame))
        return ticket

    def _enqueue_held(self, frame: Picture, payloads: Payloads | None) -> int:
        link, displayed = self._link, self.displayed
        if payloads is None and isinstance(frame, Frame) and displayed and not link.backlog:
            changed, lit = len(frame.changed_indices(displayed)), len(frame.lit()[0])
            if 2 * changed < lit:
                changes = frame.difference(displayed, link.payload_bytes, self._features)
                self._held = link.present_difference(
                    link.displayed,
                    [*changes, b""],
                    lambda: [*self.payloads(frame), b""],
                    held=True,
                )
                return self._held
        self._held = link.open_frame()
        self._encoder = _Encoder(self._held, payloads or self.iter_payloads(frame))
        return self._held

    def iter_payloads(self, frame: Picture) -> Payloads:
        """Return an iterator that encodes a frame for this device and its line, in portions."""
        if isinstance(frame, EncodedFrame):
            return iter([list(frame.payloads)])
        return frame.iter_payloads(*self.encoding_for)

    def is_held(self, ticket: int) -> bool:
        """Return whether the device has all of a held frame, and would show it on COMMIT."""
        return self._encoder is None and self._link.is_held(ticket)

    def release(self, ticket: int) -> None:
        """Have the COMMIT of a held frame sent; do nothing if it is not held."""
        if self._held == ticket:
            self._held = None
            self._link.append_payloads(ticket, [], last=True)

    def replace_pending(self, frame: Frame) -> None:
        """Have a copy of a frame started when the line needs one, unless a newer one follows."""
        copy = frame.copy()  # before anything changes: it may be interrupted
        if self._pending is not None and self._pending is not self._last:
            self.playback.note_dropped()
        self._pending = copy
        self.playback.note_presented()

    def start_unwaited(
        self,
        picture: Picture,
        hold_ticks: int = 0,
        *,
        held: bool = False,
        payloads: Payloads | None = None,
    ) -> int:
        """Start a frame that nobody waits for at once, and return its ticket.

        Parameters
        ----------
        picture : Picture
        hold_ticks : int
            For how many refresh ticks the frame before it stays on display, if the device has the
            feature HOLD.
        held, payloads
            As of `enqueue`.

        """
        ticket = self.enqueue(picture, held=held, payloads=payloads)
        self._link.hold(hold_ticks)
        self._unwaited[ticket] = picture
        self.playback.note_presented()
        return ticket

    def repeat(self, ticket: int, picture: Picture, hold_ticks: int = 0) -> int:
        """Start a frame that shows what the one started last shows; return its ticket.

        Parameters
        ----------
        ticket : int
            Of the frame started last.
        picture : Picture
            What it shows.
        hold_ticks : int
            As of `start_unwaited`.

        """
        base = self._link.counters.sessions, ticket
        again = self._link.present_difference(base, [], partial(self.payloads, picture))
        self._link.hold(hold_ticks)
        self._unwaited[again] = picture
        self._repeats.add(again)
        return again

    def restart_playback(self) -> None:
        """Count anew, from the frames that are still on their way."""
        handed_over = [self._pending, *self._unwaited.values()]
        waiting = sum(frame is not None and frame is not self._last for frame in handed_over)
        self.playback = PlaybackMeter(waiting)

    def payloads(self, frame: Picture) -> list[bytes]:
        """Return a frame encoded for this device and its line."""
        if isinstance(frame, EncodedFrame):
            return list(frame.payloads)
        return frame.payloads(self._link.payload_bytes, self._features)

    @property
    def _bytes_per_s(self) -> float:
        return self._connection.bytes_per_s or UNKNOWN_BYTES_PER_S

    @property
    def encoding_for(self) -> tuple[int, tuple[str, ...], float]:
        """Arguments of `Frame.iter_payloads` for this device and its line."""
        return self._link.payload_bytes, self._features, self._bytes_per_s

    @property
    def _features(self) -> tuple[str, ...]:
        return select_features(self._connection.info.features, self._bytes_per_s)

    # -- on the way

    @property
    def busy(self) -> bool:
        """True if a frame is neither displayed nor skipped."""
        return bool(self._link.backlog or self._pending)

    @property
    def has_unwaited(self) -> bool:
        """True if that holds of a frame that nobody waits for."""
        return bool(self._pending or (self._unwaited and self._link.backlog))

    @property
    def encoding(self) -> bool:
        """True if a frame is being encoded."""
        return self._encoder is not None

    @property
    def has_work(self) -> bool:
        """True if `encode` would encode something."""
        return self.encoding or (self._pending is not None and self.may_start)

    def encode(self) -> None:
        """Encode a portion of a frame; start the pending one if the line needs it."""
        if (
            not self._encoder and self._held is None
        ):  # after an interrupt, nobody supplies the rest of an open frame
            self._link.abandon_open_frame()
        if self._pending and not self._encoder and self.may_start:
            frame, self._pending = self._pending, None
            self._unwaited[self.enqueue(frame)] = frame
        if encoder := self._encoder:
            try:
                payloads, held = next(encoder.payloads, None), encoder.ticket == self._held
                if payloads is None and held:
                    self._link.append_payloads(encoder.ticket, [b""], last=False)
                else:
                    ends = payloads is None
                    self._link.append_payloads(encoder.ticket, payloads or [], last=ends)
            except BaseException:
                self._encoder = self._held = None
                raise
            if payloads is None:
                self._encoder = None

    @property
    def may_start(self) -> bool:
        """True if another frame keeps the line busy, and the display does not lag behind by it."""
        return self.backlog < _MAX_UNSHOWN and self.line_is_free

    @property
    def line_is_free(self) -> bool:
        """True if the line will run idle unless another frame is started now."""
        return self._link.ready and not self._encoder and self._link.needs_frame

    @property
    def backlog(self) -> int:
        """Number of frames that were started and are not displayed yet."""
        return self._link.backlog

    # -- displayed

    @property
    def latest(self) -> Picture | None:
        """Picture that was displayed last, proved or not; must not be changed."""
        return self._last

    @property
    def displayed(self) -> Frame | None:
        """Frame that is displayed, if that is proved; must not be changed."""
        if self._displayed and self._displayed[1] == self._link.displayed:
            return self._displayed[0]
        return None

    def set_displayed(self, frame: Frame, picture: PictureId) -> None:
        """Record that a frame is what the link calls ``picture``."""
        self._displayed = frame, picture

    def forget_displayed(self) -> None:
        """Record that it is unknown what is displayed."""
        self._displayed = None

    def confirm(self, frame: Frame, ticket: int, digest: int | None, now: float) -> None:
        """Record that a frame that was waited for is displayed; without digest, unproved."""
        self._last = frame
        self.frames += 1
        self.playback.note_shown(1, now)
        self._set_shown(frame, ticket, digest)

    def _set_shown(self, frame: Picture, ticket: int, digest: int | None) -> None:
        self._displayed = None
        if digest is not None and isinstance(frame, Frame):
            self._displayed = frame, (self._link.counters.sessions, ticket)

    # -- events

    def is_shown(self, ticket: int) -> bool:
        """Return whether a frame is or was displayed; `take_digest` then returns its digest."""
        return ticket in self._shown

    def take_digest(self, ticket: int) -> int | None:
        """Return the digest that the device reported for a frame, once."""
        return self._shown.pop(ticket)

    def note_shown(self, ticket: int, digest: int | None, now: float) -> None:
        """Record that the device displays a frame.

        Raises
        ------
        DesyncError
            If nobody waited for it, and the digest differs for the second time in a row.

        """
        self.shown_s = now
        if ticket in self._unwaited:
            self._note_unwaited_shown(ticket, digest, now)
        else:
            self._shown[ticket] = digest

    def _note_unwaited_shown(self, ticket: int, digest: int | None, now: float) -> None:
        """Record that an unwaited frame is displayed, and all before it are finished."""
        frame = self._unwaited[ticket]
        # After a reconnect, because it was displayed wrongly, or to fill a tick.
        again = frame is self._last
        # A device begins no frame before it displays the one before: their ACKs were lost.
        before = [each for earlier, each in self._unwaited.items() if earlier < ticket]
        overtaken = len({id(each) for each in before} - {id(self._last), id(frame)})
        is_repeat = ticket in self._repeats
        self._repeats = {later for later in self._repeats if later > ticket}
        self._last, self._displayed = frame, None
        self._unwaited = {later: f for later, f in self._unwaited.items() if later > ticket}
        self.frames += not again
        self.playback.note_shown(overtaken + (not again), now)
        self.on_shown(ticket, now)
        expected = frame.digest if isinstance(frame, EncodedFrame) else frame.digest()
        if digest is None or digest == expected:
            self.playback.note_right()
            self._wrong_in_a_row = 0
            self._set_shown(frame, ticket, digest)
            return
        if is_repeat and self._wrong_in_a_row:  # it copies a page that is known to be wrong
            return
        self._wrong_in_a_row += 1
        self.playback.note_wrong()
        if self._wrong_in_a_row > 1:
            raise DesyncError(describe_wrong_digest(digest, expected), hint=WRONG_TWICE_HINT)
        if not self.busy:  # otherwise the next frame repairs it
            self._pending = frame

    def note_reconnect(self) -> None:
        """Have the last displayed frame sent again, unless another is queued."""
        if self._last and not self._link.backlog:
            # Encoded when its turn comes: then the device is there, and its line known.
            full_payloads = partial(self.payloads, self._last)
            ticket = self._link.present_difference(_NO_PICTURE, [], full_payloads)
            self._unwaited[ticket] = self._last

    def note_refusal(self) -> None:
        """Record that the device refused a packet, and that the link has dropped all frames."""
        self._encoder = self._held = None
        self.playback.note_dropped(
            sum(frame is not self._last for frame in self._unwaited.values())
        )
        self._unwaited.clear()
        self._repeats.clear()


def _ignore_shown(ticket: int, now: float) -> None:
    del ticket, now


@dataclass(frozen=True, slots=True)
class _Encoder:
    """Frame that is being encoded: the link's ticket, and the payloads as they get ready."""

    ticket: int
    payloads: Payloads

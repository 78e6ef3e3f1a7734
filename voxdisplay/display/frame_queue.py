"""The frames of one display: which is on display, which are on their way, which comes next.

A frame is coded in portions while it is sent, whole or as its difference from what is known to be
on display; of frames that nobody waits for, the newest is begun when the line needs one. Knows what
is proved, and what must be shown again. It never waits, never reads back, and knows no bytes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, partial

from voxdisplay.display.connection import Connection
from voxdisplay.display.receipt import WRONG_TWICE_HINT, describe_wrong_digest
from voxdisplay.errors import DesyncError
from voxdisplay.frame import Frame
from voxdisplay.link import PictureId
from voxdisplay.wire.features import UNKNOWN_BYTES_PER_S, select_features

# So many lit voxels for a byte of difference, and the whole frame surely takes more bytes.
_LIT_PER_DIFFERENCE_BYTE = 64
# One that the device shows at its next tick, and one behind it.
_MAX_UNSHOWN = 2
_NO_PICTURE: PictureId = (0, 0)  # is never on display


class FrameQueue:
    """What a display is to show.

    Parameters
    ----------
    connection : Connection
        The display. Its link is given payloads; who turns it tells what comes back.

    Attributes
    ----------
    frames : int
        How many frames have been shown.

    """

    def __init__(self, connection: Connection) -> None:
        self.frames = 0
        self._connection = connection
        self._link = connection.link
        self._last: Frame | None = None  # that was shown
        self._shown: dict[int, int | None] = {}  # ticket -> digest
        self._unwaited: dict[int, Frame] = {}  # ticket -> the frame, as it was
        self._displayed: tuple[Frame, PictureId] | None = None
        self._pending: Frame | None = None  # handed over, and not begun
        self._encoder: _Encoder | None = None
        self._wrong_in_a_row = 0  # frames that nobody waited for, in a row

    # -- in

    def enqueue(self, frame: Frame) -> int:
        """Give a frame to the link: whole, or as its difference from what is on display.

        It must stay as it is until it is shown. Gives its ticket.
        """
        link, known = self._link, self.displayed
        if known and not link.backlog:
            whole = cache(partial(self.payloads, frame))
            lit = len(frame.lit()[0])
            if 2 * len(frame.changed_indices(known)) < lit:
                payloads = frame.difference(known, link.payload_bytes, self._features)
                size = sum(map(len, payloads))
                # Where there is next to nothing to be sent, the whole frame need not be coded.
                if size * _LIT_PER_DIFFERENCE_BYTE < lit or size < sum(map(len, whole())):
                    return link.present_difference(link.displayed, payloads, whole)
                return link.present(whole())
        ticket = link.open_frame()
        coded = frame.iter_payloads(link.payload_bytes, self._features, self._bytes_per_s)
        self._encoder = _Encoder(ticket, coded)
        return ticket

    def replace_pending(self, frame: Frame) -> None:
        """Show a frame when the line needs one, if no newer one comes first."""
        self._pending = frame.copy()

    def payloads(self, frame: Frame) -> list[bytes]:
        """Code a frame for this device and its line."""
        return frame.payloads(self._link.payload_bytes, self._features)

    @property
    def _bytes_per_s(self) -> float:
        return self._connection.bytes_per_s or UNKNOWN_BYTES_PER_S

    @property
    def _features(self) -> tuple[str, ...]:
        return select_features(self._connection.info.features, self._bytes_per_s)

    # -- on the way

    @property
    def busy(self) -> bool:
        """Whether a frame that was handed over is neither on display nor skipped."""
        return bool(self._link.backlog or self._pending)

    @property
    def encoding(self) -> bool:
        """Whether a frame is being coded."""
        return self._encoder is not None

    def encode(self) -> None:
        """Code a part of a frame; begin the newest if there is none and the line needs it."""
        if not self._encoder:  # an interrupt: what was lost by it nobody gives again
            self._link.abandon_open_frame()
        if self._pending and not self._encoder and self._may_start:
            frame, self._pending = self._pending, None
            self._unwaited[self.enqueue(frame)] = frame
        if coder := self._encoder:
            try:
                payloads = next(coder.payloads, None)
                self._link.append_payloads(coder.ticket, payloads or [], last=payloads is None)
            except BaseException:
                self._encoder = None
                raise
            if payloads is None:
                self._encoder = None

    @property
    def _may_start(self) -> bool:
        """Whether another frame keeps the line busy; more would make the display lag behind."""
        return self._link.ready and self._link.backlog < _MAX_UNSHOWN and self._link.needs_frame

    # -- on display

    @property
    def displayed(self) -> Frame | None:
        """What is on display, as far as it is proved; not to be changed."""
        if self._displayed and self._displayed[1] == self._link.displayed:
            return self._displayed[0]
        return None

    def set_displayed(self, frame: Frame, place: PictureId) -> None:
        """Note that a frame is what the link calls so."""
        self._displayed = frame, place

    def forget_displayed(self) -> None:
        """Note that nobody knows what is on display."""
        self._displayed = None

    def confirm(self, frame: Frame, ticket: int, digest: int | None) -> None:
        """Note that a frame which was waited for is on display; no digest proves nothing."""
        self._last = frame
        self.frames += 1
        self._set_shown(frame, ticket, digest)

    def _set_shown(self, frame: Frame, ticket: int, digest: int | None) -> None:
        place = self._link.counters.sessions, ticket
        self._displayed = None if digest is None else (frame, place)

    # -- what has happened

    def is_shown(self, ticket: int) -> bool:
        """Tell whether a frame is on display, or has been; `digest_of` then gives its digest."""
        return ticket in self._shown

    def take_digest(self, ticket: int) -> int | None:
        """Give the digest that the device gave for a frame, once."""
        return self._shown.pop(ticket)

    def note_shown(self, ticket: int, digest: int | None) -> None:
        """Note that the device shows a frame.

        Raises
        ------
        DesyncError
            If nobody waited for it, and for the second time in a row it is not what was meant.

        """
        if ticket in self._unwaited:
            self._note_unwaited_shown(ticket, digest)
        else:
            self._shown[ticket] = digest

    def _note_unwaited_shown(self, ticket: int, digest: int | None) -> None:
        """Note that a frame which nobody waited for is on display, and all before it are over."""
        frame = self._unwaited[ticket]
        again = frame is self._last  # after a renewal, or as it was shown wrongly
        self._last, self._displayed = frame, None
        self._unwaited = {later: f for later, f in self._unwaited.items() if later > ticket}
        self.frames += not again
        if digest is None or digest == (meant := frame.digest()):
            self._wrong_in_a_row = 0
            self._set_shown(frame, ticket, digest)
            return
        self._wrong_in_a_row += 1
        if self._wrong_in_a_row > 1:
            raise DesyncError(describe_wrong_digest(digest, meant), hint=WRONG_TWICE_HINT)
        if not self.busy:  # else the next one mends it
            self._pending = frame

    def note_reconnect(self) -> None:
        """Note that the device is back: it gets its last picture, if nothing else is to come."""
        if self._last and not self._link.backlog:
            # Coded when the device is there, and its line known.
            whole = partial(self.payloads, self._last)
            self._unwaited[self._link.present_difference(_NO_PICTURE, [], whole)] = self._last

    def note_refusal(self) -> None:
        """Note that the device has refused a packet: the link has dropped all frames."""
        self._encoder = None


@dataclass(frozen=True, slots=True)
class _Encoder:
    """A frame that is being coded: its payloads as they are ready, and the link's ticket."""

    ticket: int
    payloads: Iterator[list[bytes]]

"""Receive state machine for DATA packets: sequence numbers, window and frame states (6, 9.1).

One object per session. Decides and keeps the state; knows nothing of bytes, pages or responses.
"""

from enum import Enum, auto

from firmware_sim import spec
from firmware_sim.packet_error import PacketError

_NO_FRAME = 255  # section 6, point 6: f before the first frame
_SEQ, _FRAME, _CLEAR = 1, 2, 0  # offsets in the header, for errors


class BackPage(Enum):
    """States of the back page, section 13."""

    EMPTY = auto()
    FILLING = auto()
    PENDING = auto()


class DataAction(Enum):
    """Treatment of a DATA packet."""

    APPLY = auto()  # draw it
    BEGIN = auto()  # begin its frame, then draw it
    DUPLICATE = auto()  # acknowledge it
    DROP = auto()  # acknowledge it, but do not mark it as received


class Session:
    """State of a session, between one HELLO and the next.

    Parameters
    ----------
    number
        Session number chosen by the host, not 0.

    Attributes
    ----------
    next : int
        Lowest sequence number that has not been received.
    received : int
        Bitmap: bit i is set if the packet `next` + 1 + i has been received.
    last : int
        Sequence number of the last DATA packet taken, 255 before the first.
    shown : int or None
        Id of the frame on display, if it is one of this session.
    state : BackPage
        State of the back page.
    """

    def __init__(self, number: int) -> None:
        self.number = number
        self.next = 0
        self.received = 0
        self.last = 255
        self.shown: int | None = None
        self.state = BackPage.EMPTY
        self._newest = _NO_FRAME  # f of section 6
        self._clear = False  # the CLEAR flag with which f began
        self._commit: int | None = None  # lowest sequence number of a COMMIT of f
        self._hold = 0  # of f
        self._since = spec.LIMIT_MAX_HOLD  # ticks since the last exchange

    def _ahead(self, seq: int) -> int:
        return (seq - self.next) % 256

    def _is_duplicate(self, seq: int) -> bool:
        ahead = self._ahead(seq)
        if ahead >= spec.LIMIT_WINDOW:
            return ahead >= 256 - spec.LIMIT_WINDOW
        return bool(self.received << 1 >> ahead & 1)  # the bit of `next` itself is never set

    def must_wait(self, seq: int, frame: int) -> bool:
        """Return whether a DATA packet must not be taken before the tick (6, points 6 and 7).

        Parameters
        ----------
        seq, frame
            Bytes 1 and 2 of its header.
        """
        return (
            self.state is BackPage.PENDING and frame != self._newest and not self._is_duplicate(seq)
        )

    def classify(self, seq: int, frame: int, flags: int) -> DataAction:
        """Return the treatment of a DATA packet that need not wait.

        Parameters
        ----------
        seq, frame
            Bytes 1 and 2 of its header.
        flags
            ``spec.DATA_FLAG_*``.

        Returns
        -------
        Verdict
            If it is not refused.

        Raises
        ------
        PacketError
            SEQUENCE or FRAME.
        """
        ahead = self._ahead(seq)
        if self._is_duplicate(seq):
            return DataAction.DUPLICATE
        if ahead >= spec.LIMIT_WINDOW:
            raise PacketError(spec.CODE_SEQUENCE, _SEQ, f"{seq} is not within 32 of {self.next}")
        if frame == self._newest:
            self._check_same_frame(seq, flags)
            return DataAction.APPLY
        # Missing packets can only belong to a frame that is not whole.
        if frame == (self._newest + 1) % 256 and (self.state is BackPage.EMPTY or not ahead):
            return DataAction.BEGIN
        if ahead:
            return DataAction.DROP
        raise PacketError(spec.CODE_FRAME, _FRAME, f"frame {frame} does not follow {self._newest}")

    def _check_same_frame(self, seq: int, flags: int) -> None:
        """Check a packet of the newest frame f (6, points 8 and 1)."""
        if self.state is not BackPage.FILLING:
            raise PacketError(spec.CODE_FRAME, _FRAME, "the frame is not open")
        if self._commit is not None and self._ahead(self._commit) < self._ahead(seq):
            raise PacketError(spec.CODE_FRAME, _FRAME, "the frame has ended before this packet")
        if bool(flags & spec.DATA_FLAG_CLEAR) != self._clear:
            raise PacketError(spec.CODE_FRAME, _CLEAR, "the frame began with another CLEAR flag")

    def begin_frame(self, frame: int, flags: int) -> None:
        """Begin a frame; the one before is dropped if it is not on display."""
        self.state = BackPage.FILLING
        self._newest = frame
        self._clear = bool(flags & spec.DATA_FLAG_CLEAR)
        self._commit = None
        self._hold = 0

    def mark_received(self, seq: int, flags: int) -> None:
        """Mark a packet of f as received, and update the state if f is whole now."""
        if flags & spec.DATA_FLAG_COMMIT and (
            self._commit is None or self._ahead(seq) < self._ahead(self._commit)
        ):
            self._commit = seq
        self.received |= 1 << self._ahead(seq) >> 1
        if seq == self.next:
            self._advance()
        if self._commit is not None and self._ahead(self._commit) >= spec.LIMIT_WINDOW:
            self.state = BackPage.PENDING

    def _advance(self) -> None:
        while True:
            self.next = (self.next + 1) % 256
            present = self.received & 1
            self.received >>= 1
            if not present:
                return

    def hold(self, ticks: int) -> None:
        """Record a hold that a packet of f names (7.12)."""
        self._hold = max(self._hold, ticks)

    @property
    def ticks_left(self) -> int:
        """Number of ticks, from the last one that was counted, to the exchange of f."""
        return max(self._hold - self._since, 1)

    def tick(self, count: int) -> bool:
        """Count refresh ticks; return whether f is to be exchanged at the last of them (7.12)."""
        self._since = min(self._since + count, spec.LIMIT_MAX_HOLD)
        return self.state is BackPage.PENDING and self._since >= self._hold

    def swap(self) -> None:
        """Record that f is on display."""
        self._since = 0
        self.shown = self._newest
        self.state = BackPage.EMPTY

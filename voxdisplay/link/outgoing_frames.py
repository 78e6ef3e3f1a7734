"""Queue of outgoing frames: their payloads, their order, and their frame ids.

Must not know window, credit or clock: when a packet is sent, and whether it has arrived, is decided
elsewhere.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec

_MODULUS = 256
_HOLD_BYTES = 2
_LEAST_HOLD = 2  # ticks: below, a frame is exchanged at the next tick anyway

PictureId: TypeAlias = tuple[int, int]
"""Identifies the displayed picture: the number of sessions so far, and its frame's ticket or 0."""


@dataclass(slots=True)
class OutgoingFrame:
    """Frame that is not displayed yet.

    Attributes
    ----------
    ticket : int
    payloads : list of bytes
        Ops, one packet each.
    clear : bool
        Whether it starts dark; otherwise as a copy of the displayed picture.
    base : PictureId or None
        The picture from which the payloads are a difference.
    full_payloads : callable
        Returns payloads that draw the frame from the dark, for a difference without its base.
    open : bool
        Whether it is still being encoded, or is held, so that more payloads may follow.
    frame_id : int
        On the wire; -1 before its first packet.
    packetized : int
        How many of the payloads have been put into packets.
    unsent_bytes : int
        Bytes of the other payloads.
    hold : int
        Refresh ticks for which the frame before it stays on display; at most 1 is none.

    """

    ticket: int
    payloads: list[bytes]
    clear: bool
    base: PictureId | None = None
    full_payloads: Callable[[], list[bytes]] = list
    open: bool = False
    frame_id: int = -1
    packetized: int = 0
    unsent_bytes: int = field(init=False)
    hold: int = 0
    _has_hold_op: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Return to the state before its first packet."""
        self._remove_hold_op()
        self.frame_id, self.packetized = -1, 0
        self.unsent_bytes = sum(map(len, self.payloads))

    def append(self, payloads: list[bytes]) -> None:
        """Append payloads."""
        self.payloads += payloads
        self.unsent_bytes += sum(map(len, payloads))

    def add_hold_op(self, max_payload: int) -> None:
        """Put HOLD, once, in front of the last payload, or behind it if that is too long.

        In front, because range-coded ops end a payload.
        """
        if self.hold < _LEAST_HOLD or self._has_hold_op or self.open:
            return
        op = bytes((spec.OP_HOLD, self.hold))
        if len(self.payloads[-1]) + _HOLD_BYTES <= max_payload:
            self.payloads[-1] = op + self.payloads[-1]
        else:
            self.payloads.append(op)
        self.unsent_bytes += _HOLD_BYTES
        self._has_hold_op = True

    def _remove_hold_op(self) -> None:
        if self._has_hold_op:
            rest = self.payloads.pop()[_HOLD_BYTES:]
            self.payloads += [rest] if rest or not self.payloads else []
            self._has_hold_op = False

    @property
    def started(self) -> bool:
        """True if it has a frame id, and packets."""
        return self.frame_id >= 0

    @property
    def complete(self) -> bool:
        """True if all of it is in packets, so that the device will display it."""
        return self.started and not self.open and self.packetized == len(self.payloads)

    @property
    def sendable(self) -> int:
        """Number of payloads that may be put into packets now.

        The last payload of an open frame may turn out to be the one with COMMIT, so it waits.
        """
        return max(0, len(self.payloads) - self.open - self.packetized)

    @property
    def next_payload(self) -> bytes:
        """Payload of the next packet."""
        return self.payloads[self.packetized]


class OutgoingFrames:
    """Frames of one link that are not displayed yet, the oldest first."""

    def __init__(self) -> None:
        self._queue: deque[OutgoingFrame] = deque()
        self._tickets = 0
        self._next_id = 0

    def __len__(self) -> int:
        return len(self._queue)

    def __iter__(self) -> Iterator[OutgoingFrame]:
        return iter(self._queue)

    # -- in

    def present(self, payloads: list[bytes], *, clear: bool = True) -> int:
        """Queue a frame and return its ticket.

        Parameters
        ----------
        payloads : list of bytes
            Ops, each at most INFO's ``max_payload`` long. An empty list is a frame without ops.
        clear : bool
            Whether the frame starts dark; otherwise as a copy of the displayed picture.

        """
        return self._add(OutgoingFrame(self._new_ticket(), payloads or [b""], clear))

    def open_frame(self) -> int:
        """Queue a frame that starts dark and is still being encoded, and return its ticket."""
        return self._add(OutgoingFrame(self._new_ticket(), [], clear=True, open=True))

    def append_payloads(self, ticket: int, payloads: list[bytes], *, last: bool) -> None:
        """Append payloads to an open frame; do nothing if it is not queued any more.

        Parameters
        ----------
        ticket : int
            From `open_frame`.
        payloads : list of bytes
            As of `present`. All but the last of them may be sent at once.
        last : bool
            Whether no more follow.

        """
        for frame in self._queue:
            if frame.ticket == ticket:
                frame.append(payloads if payloads or frame.payloads or not last else [b""])
                frame.open = not last

    def hold(self, ticks: int) -> None:
        """Have the frame queued last held: see `OutgoingFrame.hold`."""
        self._queue[-1].hold = ticks

    def abandon_open_frame(self) -> None:
        """Remove the open frame, if there is one.

        The device drops what was sent of it when the next frame follows (section 6, point 6).
        """
        self._queue = deque(frame for frame in self._queue if not frame.open)

    def present_difference(
        self,
        base: PictureId,
        payloads: list[bytes],
        full_payloads: Callable[[], list[bytes]],
        *,
        held: bool = False,
    ) -> int:
        """Queue a frame as its difference from a displayed picture, and return its ticket.

        Parameters
        ----------
        base : PictureId
            The picture, which is on display, or is the frame queued last.
        payloads : list of bytes
            Ops that turn the picture into the frame.
        full_payloads : callable
            Returns the payloads that draw the frame from the dark. They are sent instead if, when
            the frame's turn comes, the frame right before it is not the picture, nor is that what
            is displayed while no packet is outstanding; and so if the session ended meanwhile.
        held : bool
            Whether the last payload waits until `append_payloads` ends the frame.

        """
        return self._add(
            OutgoingFrame(
                self._new_ticket(),
                payloads or [b""],
                clear=False,
                base=base,
                full_payloads=full_payloads,
                open=held,
            )
        )

    def _new_ticket(self) -> int:
        self._tickets += 1
        return self._tickets

    def _add(self, frame: OutgoingFrame) -> int:
        self._queue.append(frame)
        return frame.ticket

    # -- how much there is

    @property
    def unsent_bytes(self) -> int:
        """Bytes of the payloads that are in no packet yet, as far as they are encoded."""
        return sum(frame.unsent_bytes for frame in self._queue)

    @property
    def payload_count(self) -> int:
        """Number of payloads of all frames, as far as they are encoded."""
        return sum(len(frame.payloads) for frame in self._queue)

    def is_held(self, ticket: int) -> bool:
        """Return whether an open frame is in packets but for its last payload."""
        return any(
            frame.ticket == ticket and frame.open and frame.packetized == len(frame.payloads) - 1
            for frame in self._queue
        )

    @property
    def unsent_payloads(self) -> int:
        """Number of payloads that are in no packet yet."""
        return sum(len(frame.payloads) - frame.packetized for frame in self._queue)

    @property
    def held_ticks(self) -> int:
        """Sum of the holds of the frames that were started and are not displayed."""
        return sum(frame.hold for frame in self._queue if frame.started)

    @property
    def awaiting_swap(self) -> bool:
        """True if a frame is complete in packets and not displayed yet."""
        return any(frame.complete for frame in self._queue)

    # -- out

    def resolve_difference(self, frame: OutgoingFrame, displayed: PictureId | None) -> None:
        """Replace a difference by the full frame if its base is not what the device displays.

        Parameters
        ----------
        frame : OutgoingFrame
            One whose turn has come.
        displayed : PictureId or None
            The displayed picture; None while packets are outstanding that may change it.

        """
        if frame.base is None:
            return
        if frame is self._queue[0]:
            applies = frame.base == displayed
        else:  # the device begins it when it displays the one before
            applies = self._queue[self._queue.index(frame) - 1].ticket == frame.base[1]
        if not applies:
            frame.payloads, frame.clear, frame.base = frame.full_payloads() or [b""], True, None
            frame.reset()

    def next_packet(self, frame: OutgoingFrame, seq: int) -> packets.Data:
        """Return a frame's next packet. Call `mark_packetized` when it is in the window."""
        if not frame.started:
            frame.frame_id = self._next_id
            self._next_id = (frame.frame_id + 1) % _MODULUS
        last = not frame.open and frame.packetized + 1 == len(frame.payloads)
        flags = spec.DATA_FLAG_CLEAR * frame.clear | spec.DATA_FLAG_COMMIT * last
        return packets.Data(seq=seq, frame=frame.frame_id, flags=flags, ops=frame.next_payload)

    def mark_packetized(self, frame: OutgoingFrame) -> None:
        """Record that a frame's next packet is in the window, which will deliver it."""
        frame.unsent_bytes -= len(frame.next_payload)
        frame.packetized += 1

    def take_shown(self, frame_id: int | None) -> int | None:
        """Remove the frame of a displayed frame id and all before it, and return its ticket.

        Returns
        -------
        int or None
            None if there is no such complete frame: then the id is that of an older one.

        """
        if not any(frame.complete and frame.frame_id == frame_id for frame in self._queue):
            return None
        while (frame := self._queue.popleft()).frame_id != frame_id:
            pass
        return frame.ticket

    def reset(self) -> None:
        """Have all frames sent again from their beginnings, in a new session."""
        self._next_id = 0
        for frame in self._queue:
            frame.reset()

    def clear(self) -> None:
        """Drop all frames."""
        self._queue.clear()

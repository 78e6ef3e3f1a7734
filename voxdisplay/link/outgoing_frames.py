"""The frames that wait to be shown: their payloads, their order, their numbers.

A frame is what it is made of, and how much of that has been put into packets. Knows no window, no
credit and no clock: when a packet may go out, and whether it has come, is the business of others.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec

_MODULUS = 256

PictureId: TypeAlias = tuple[int, int]
"""Which picture is on display: how many sessions there were, and the ticket of its frame or 0."""


@dataclass(slots=True)
class OutgoingFrame:
    """A frame that is to be shown: its payloads, and how many are in packets already.

    With a ``base`` they are but the difference from what that stands for, and ``whole`` gives all.
    An ``open`` one is still being coded: more payloads follow.
    """

    ticket: int
    payloads: list[bytes]
    clear: bool
    base: PictureId | None = None
    full_payloads: Callable[[], list[bytes]] = list
    open: bool = False
    frame_id: int = -1
    packetized: int = 0
    unsent_bytes: int = field(init=False)  # of payloads that are in no packet yet

    def __post_init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Begin again: nothing of it is in a packet."""
        self.frame_id, self.packetized = -1, 0
        self.unsent_bytes = sum(map(len, self.payloads))

    def append(self, payloads: list[bytes]) -> None:
        """Add payloads."""
        self.payloads += payloads
        self.unsent_bytes += sum(map(len, payloads))

    @property
    def started(self) -> bool:
        """Whether it has a number, and packets."""
        return self.frame_id >= 0

    @property
    def complete(self) -> bool:
        """Whether all of it is in packets: then the device will show it."""
        return self.started and not self.open and self.packetized == len(self.payloads)

    @property
    def sendable(self) -> int:
        """Payloads that may enter now: of an open one the last may be that with COMMIT."""
        return max(0, len(self.payloads) - self.open - self.packetized)

    @property
    def next_payload(self) -> bytes:
        """What the next packet brings, if any is left."""
        return self.payloads[self.packetized]


class OutgoingFrames:
    """The frames of one link, the oldest first."""

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
        """Queue a frame; give its ticket.

        Parameters
        ----------
        payloads : list of bytes
            Ops, each at most INFO's ``max_payload`` long. None at all is a frame without ops.
        clear : bool
            Whether the frame starts dark; otherwise as a copy of what is shown.

        """
        return self._add(OutgoingFrame(self._new_ticket(), payloads or [b""], clear))

    def open_frame(self) -> int:
        """Queue a frame that starts dark and is still being coded; give its ticket."""
        return self._add(OutgoingFrame(self._new_ticket(), [], clear=True, open=True))

    def append_payloads(self, ticket: int, payloads: list[bytes], *, last: bool) -> None:
        """Add payloads to a frame that was begun; what is not queued any more takes none.

        Parameters
        ----------
        ticket : int
            Of a frame from `begin`, whose last payloads have not been supplied.
        payloads : list of bytes
            As of `present`. All but the last of them may be sent at once.
        last : bool
            Whether there are no more.

        """
        for frame in self._queue:
            if frame.ticket == ticket:
                frame.append(payloads if payloads or frame.payloads or not last else [b""])
                frame.open = not last

    def abandon_open_frame(self) -> None:
        """Give up what came from `begin`, if its last payloads are still to come.

        What has been sent of it is followed by the next frame, and dropped (section 6, point 6).
        """
        self._queue = deque(frame for frame in self._queue if not frame.open)

    def present_difference(
        self, base: PictureId, payloads: list[bytes], whole: Callable[[], list[bytes]]
    ) -> int:
        """Queue a frame as its difference from a picture on display; give its ticket.

        Parameters
        ----------
        base : OnDisplay
            The picture.
        payloads : list of bytes
            Ops that make the frame of it.
        whole : callable
            Gives the payloads that draw the frame from the dark. They are sent if the picture is
            not on display any more when the frame's turn comes, or something is on its way, or the
            session ends before the frame is shown.

        """
        ticket = self._new_ticket()
        return self._add(
            OutgoingFrame(ticket, payloads or [b""], clear=False, base=base, full_payloads=whole)
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
        """Bytes of payloads that are in no packet yet, as far as they are coded."""
        return sum(frame.unsent_bytes for frame in self._queue)

    @property
    def payload_count(self) -> int:
        """Payloads of all frames, as far as they are coded."""
        return sum(len(frame.payloads) for frame in self._queue)

    @property
    def unsent_payloads(self) -> int:
        """Payloads that are in no packet yet."""
        return sum(len(frame.payloads) - frame.packetized for frame in self._queue)

    @property
    def awaiting_swap(self) -> bool:
        """Whether the device has, or will have, all of a frame that it has not shown yet."""
        return any(frame.complete for frame in self._queue)

    # -- out

    def resolve_difference(self, frame: OutgoingFrame, on_display: PictureId | None) -> None:
        """Make a difference the whole frame if it cannot be sent as such.

        Parameters
        ----------
        frame : QueuedFrame
            One whose turn has come.
        on_display : OnDisplay or None
            The picture on display; None while something is on its way that may change it.

        """
        fits = frame.base == on_display and frame is self._queue[0]
        if frame.base is not None and not fits:
            frame.payloads, frame.clear, frame.base = frame.full_payloads() or [b""], True, None
            frame.reset()

    def next_packet(self, frame: OutgoingFrame, seq: int) -> packets.Data:
        """Give a frame's next packet; once that is in the window, `entered` is to be told."""
        if not frame.started:
            frame.frame_id = self._next_id
            self._next_id = (frame.frame_id + 1) % _MODULUS
        last = not frame.open and frame.packetized + 1 == len(frame.payloads)
        flags = spec.DATA_FLAG_CLEAR * frame.clear | spec.DATA_FLAG_COMMIT * last
        return packets.Data(seq=seq, frame=frame.frame_id, flags=flags, ops=frame.next_payload)

    def mark_packetized(self, frame: OutgoingFrame) -> None:
        """Note that a frame's next packet is in the window: it will arrive."""
        frame.unsent_bytes -= len(frame.next_payload)
        frame.packetized += 1

    def take_shown(self, frame_id: int | None) -> int | None:
        """Take out the frame of a number that is shown, and all before it; give its ticket.

        None if there is no such frame, or it is not complete: then the number is an older frame's.
        """
        if not any(frame.complete and frame.frame_id == frame_id for frame in self._queue):
            return None
        while (frame := self._queue.popleft()).frame_id != frame_id:
            pass
        return frame.ticket

    def reset(self) -> None:
        """Begin a session: all frames are to be sent again, from their beginnings."""
        self._next_id = 0
        for frame in self._queue:
            frame.reset()

    def clear(self) -> None:
        """Drop all frames."""
        self._queue.clear()

"""What goes out next, and when no more may: window, credit and pace of one session together.

Knows packets only as bytes with a number or a tag, and a clock only as the ``now`` it is told.
What the device has said of itself, and how long it has said nothing, is the business of others.
"""

from __future__ import annotations

from collections.abc import Iterator

from voxdisplay.errors import TransportTimeout
from voxdisplay.link.counters import LinkCounters
from voxdisplay.link.delivery_rate import LEAST_PACKETS, Pace
from voxdisplay.link.outgoing_frames import Frames, OnDisplay
from voxdisplay.link.payload_size import Loss
from voxdisplay.link.readback import Reads
from voxdisplay.link.send_window import Window
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec

MOST_TRANSMISSIONS = 30
PORTION_BYTES = 1 << 14
_MODULUS = 256


class Sender:
    """The packets of one link.

    Parameters
    ----------
    frames : Frames
    reads : Reads
        What there is to be sent.
    counters : LinkCounters
        Where it is counted.

    """

    def __init__(self, frames: Frames, reads: Reads, counters: LinkCounters) -> None:
        self._frames = frames
        self._reads = reads
        self._counters = counters
        self._window = Window(0)
        self.loss = Loss()
        self.pace = Pace()
        self.goes_on = False  # there may be more to be sent at once
        self.starved = False  # something is to be sent, and there is no credit for it
        self.all_damaged = False  # all that was on its way at the last ACK: no answer comes of it
        self._tag = 0
        self._hits = 0  # damaged since the device has last taken anything

    # -- the session

    def begin(self, credit: int) -> None:
        """Begin a session with a device that has room for so many bytes."""
        self._window = Window(credit)

    def end(self) -> None:
        """End the session: all that is not over is to be sent again in the next."""
        self._window = Window(0)
        self.loss.forget_count()
        self.starved = False
        self._hits = 0
        self._frames.rewind()
        self._reads.rewind()

    def change_line(self) -> None:
        """Forget how fast the line was: it may be another."""
        self.pace = Pace()

    # -- out

    def outgoing(self, now: float, on_display: OnDisplay) -> Iterator[bytes]:
        """Give what window and credit allow: what is lost comes first, as all waits for it.

        Of much it gives a portion, so that the device is at work while the next one is made.

        Raises
        ------
        TransportTimeout
            If a packet was lost too often.

        """
        self.starved = self.goes_on = False
        size = 0
        for part in (self._lost(now), self._new(now, on_display), self._asked()):
            for wire in part:
                yield wire
                size += len(wire)
                if size >= PORTION_BYTES:
                    self.goes_on = True
                    return
            if self.starved:
                return

    def status(self) -> tuple[int, bytes]:
        """Give a STATUS, which always fits the reserve, and its tag."""
        self._tag = (self._tag + 1) % _MODULUS
        wire = packets.encode(packets.Status(seq=self._tag))
        self._window.send_tagged(self._tag, len(wire))
        return self._tag, wire

    def _lost(self, now: float) -> Iterator[bytes]:
        while (seq := self._window.lost()) is not None:
            flight = self._window.flights[seq]
            if flight.transmissions >= MOST_TRANSMISSIONS:
                raise TransportTimeout(
                    f"packet {seq} did not arrive in {flight.transmissions} tries; the device "
                    f"counts {self._counters.device_damaged} damaged packets",
                    hint="the line is too noisy: lower the baud rate, or look at cable and ground",
                )
            if self._too_much(len(flight.wire)) or self._starves(len(flight.wire)):
                return
            self._counters.retransmitted += 1
            yield self._send(seq, now)

    def _new(self, now: float, on_display: OnDisplay) -> Iterator[bytes]:
        for frame in self._frames:
            if not frame.begun:
                self._frames.check_base(frame, None if self.unanswered else on_display)
            while frame.left:
                size = packets.wire_size(len(frame.next_payload) + spec.LIMIT_OVERHEAD)
                if not self._window.has_room or self._too_much(size) or self._starves(size):
                    return
                self._counters.packets += 1
                # In this order: an interrupt leaves no payload out.
                data = self._frames.next_packet(frame, self._window.next_seq)
                seq = self._window.add(packets.encode(data))
                self._frames.entered(frame)
                yield self._send(seq, now)
            if frame.open:  # those behind it wait for its last
                return

    def _asked(self) -> Iterator[bytes]:
        for request in self._reads.to_send:
            tag = (self._tag + 1) % _MODULUS
            wire = packets.encode(request.packet(tag))
            if self._starves(len(wire)):
                return
            self._tag = tag
            request.ordinal = self._window.send_tagged(tag, len(wire))
            yield wire

    def _send(self, seq: int, now: float) -> bytes:
        wire = self._window.send(seq, now, self.pace.delivered)
        self.loss.sent(len(wire))
        return wire

    def _too_much(self, size: int) -> bool:
        """Tell whether enough is on its way: its answers come by themselves."""
        count, bytes_ = self._window.on_the_way
        return count > 0 and not self.pace.allows(count + 1, bytes_ + size)

    def _starves(self, size: int) -> bool:
        self.starved = not self._window.fits(size)
        return self.starved

    # -- back

    @property
    def unanswered(self) -> int:
        """How many packets of frames are not received yet, as far as is known."""
        return len(self._window.flights)

    @property
    def on_the_way(self) -> int:
        """How many packets are neither received nor lost: their answers are to come."""
        count, _ = self._window.on_the_way
        return count + self._reads.on_the_way

    @property
    def hangs(self) -> bool:
        """Whether all waits for one or two packets, so that without their answer no other came."""
        count, _ = self._window.on_the_way
        return 0 < count <= LEAST_PACKETS and not (self.goes_on or self._window.has_room)

    def acknowledge(self, ack: packets.Ack, now: float) -> float | None:
        """Take an ACK; give how long ago the newest that it reports as received was sent.

        None if it reports nothing new.

        Raises
        ------
        RemoteProtocolError
            If it reports as received what was never sent.

        """
        taken = self._window.taken
        done = self._window.acknowledge(ack)
        for flight in done:
            self.pace.deliver(len(flight.wire), flight.delivered, now - flight.sent_s)
        self._reads.send_again(self._window.taken)
        self._note_damage(ack.damaged, moved=self._window.taken > taken)
        return now - done[-1].sent_s if done else None

    def _note_damage(self, count: int, *, moved: bool) -> None:
        damaged = self.loss.note_damage(count)
        self._counters.device_damaged += damaged
        self._hits = 0 if moved else self._hits + damaged  # before what was taken: explained
        self.all_damaged = damaged > 0 and self._hits >= self.on_the_way

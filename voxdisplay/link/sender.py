"""What goes out next, and when no more may: window, credit and pace of one session together.

Knows packets only as bytes with a number or a tag, and a clock only as the ``now`` it is told.
What the device has said of itself, and how long it has said nothing, is the business of others.
"""

from __future__ import annotations

from collections.abc import Iterator

from voxdisplay.errors import TransportTimeout
from voxdisplay.link.counters import LinkCounters
from voxdisplay.link.delivery_rate import MIN_PACKETS, DeliveryRate
from voxdisplay.link.outgoing_frames import OutgoingFrames, PictureId
from voxdisplay.link.payload_size import LossRate
from voxdisplay.link.readback import ReadRequests
from voxdisplay.link.send_window import SendWindow
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec

MAX_TRANSMISSIONS = 30
BURST_BYTES = 1 << 14
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

    def __init__(self, frames: OutgoingFrames, reads: ReadRequests, counters: LinkCounters) -> None:
        self._frames = frames
        self._reads = reads
        self._counters = counters
        self._window = SendWindow(0)
        self.loss_rate = LossRate()
        self.delivery_rate = DeliveryRate()
        self.has_more = False  # there may be more to be sent at once
        self.out_of_credit = False  # something is to be sent, and there is no credit for it
        self.all_in_flight_damaged = (
            False  # all that was on its way at the last ACK: no answer comes of it
        )
        self._tag = 0
        self._damaged_since_taken = 0  # damaged since the device has last taken anything

    # -- the session

    def open_session(self, credit: int) -> None:
        """Begin a session with a device that has room for so many bytes."""
        self._window = SendWindow(credit)

    def close_session(self) -> None:
        """End the session: all that is not over is to be sent again in the next."""
        self._window = SendWindow(0)
        self.loss_rate.reset_damage_count()
        self.out_of_credit = False
        self._damaged_since_taken = 0
        self._frames.reset()
        self._reads.reset()

    def reset_delivery_rate(self) -> None:
        """Forget how fast the line was: it may be another."""
        self.delivery_rate = DeliveryRate()

    # -- out

    def outgoing(self, now: float, on_display: PictureId) -> Iterator[bytes]:
        """Give what window and credit allow: what is lost comes first, as all waits for it.

        Of much it gives a portion, so that the device is at work while the next one is made.

        Raises
        ------
        TransportTimeout
            If a packet was lost too often.

        """
        self.out_of_credit = self.has_more = False
        size = 0
        for part in (
            self._retransmissions(now),
            self._new_packets(now, on_display),
            self._read_packets(),
        ):
            for wire in part:
                yield wire
                size += len(wire)
                if size >= BURST_BYTES:
                    self.has_more = True
                    return
            if self.out_of_credit:
                return

    def status(self) -> tuple[int, bytes]:
        """Give a STATUS, which always fits the reserve, and its tag."""
        self._tag = (self._tag + 1) % _MODULUS
        wire = packets.encode(packets.Status(seq=self._tag))
        self._window.send_tagged(self._tag, len(wire))
        return self._tag, wire

    def _retransmissions(self, now: float) -> Iterator[bytes]:
        while (seq := self._window.first_lost()) is not None:
            flight = self._window.outstanding[seq]
            if flight.transmission_count >= MAX_TRANSMISSIONS:
                raise TransportTimeout(
                    f"packet {seq} did not arrive in {flight.transmission_count} tries; the device "
                    f"counts {self._counters.device_damaged} damaged packets",
                    hint="the line is too noisy: lower the baud rate, or look at cable and ground",
                )
            if self._exceeds_flight_limit(len(flight.wire)) or self._lacks_credit(len(flight.wire)):
                return
            self._counters.retransmitted += 1
            yield self._send(seq, now)

    def _new_packets(self, now: float, on_display: PictureId) -> Iterator[bytes]:
        for frame in self._frames:
            if not frame.started:
                self._frames.resolve_difference(frame, None if self.outstanding else on_display)
            while frame.sendable:
                size = packets.max_wire_bytes(len(frame.next_payload) + spec.LIMIT_OVERHEAD)
                if (
                    not self._window.has_room
                    or self._exceeds_flight_limit(size)
                    or self._lacks_credit(size)
                ):
                    return
                self._counters.packets += 1
                # In this order: an interrupt leaves no payload out.
                data = self._frames.next_packet(frame, self._window.next_seq)
                seq = self._window.add(packets.encode(data))
                self._frames.mark_packetized(frame)
                yield self._send(seq, now)
            if frame.open:  # those behind it wait for its last
                return

    def _read_packets(self) -> Iterator[bytes]:
        for request in self._reads.sendable:
            tag = (self._tag + 1) % _MODULUS
            wire = packets.encode(request.packet(tag))
            if self._lacks_credit(len(wire)):
                return
            self._tag = tag
            request.ordinal = self._window.send_tagged(tag, len(wire))
            yield wire

    def _send(self, seq: int, now: float) -> bytes:
        wire = self._window.send(seq, now, self.delivery_rate.delivered)
        self.loss_rate.count_sent(len(wire))
        return wire

    def _exceeds_flight_limit(self, size: int) -> bool:
        """Tell whether enough is on its way: its answers come by themselves."""
        count, bytes_ = self._window.in_flight
        return count > 0 and not self.delivery_rate.allows(count + 1, bytes_ + size)

    def _lacks_credit(self, size: int) -> bool:
        self.out_of_credit = not self._window.has_credit(size)
        return self.out_of_credit

    # -- back

    @property
    def outstanding(self) -> int:
        """How many packets of frames are not received yet, as far as is known."""
        return len(self._window.outstanding)

    @property
    def in_flight(self) -> int:
        """How many packets are neither received nor lost: their answers are to come."""
        count, _ = self._window.in_flight
        return count + self._reads.in_flight

    @property
    def window_stalled(self) -> bool:
        """Whether all waits for one or two packets, so that without their answer no other came."""
        count, _ = self._window.in_flight
        return 0 < count <= MIN_PACKETS and not (self.has_more or self._window.has_room)

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
            self.delivery_rate.sample(
                len(flight.wire), flight.delivered_before, now - flight.sent_s
            )
        self._reads.mark_lost(self._window.taken)
        self._note_damage(ack.damaged, moved=self._window.taken > taken)
        return now - done[-1].sent_s if done else None

    def _note_damage(self, count: int, *, moved: bool) -> None:
        damaged = self.loss_rate.count_damage(count)
        self._counters.device_damaged += damaged
        self._damaged_since_taken = (
            0 if moved else self._damaged_since_taken + damaged
        )  # before what was taken: explained
        self.all_in_flight_damaged = damaged > 0 and self._damaged_since_taken >= self.in_flight

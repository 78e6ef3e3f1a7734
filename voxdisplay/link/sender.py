"""Packet scheduler of one link: retransmissions, new DATA, READ, within window, credit and rate.

Must not know INFO, sessions' numbers or silence: packets are bytes with a sequence number or a tag
here, and the time is an argument.
"""

from __future__ import annotations

from collections.abc import Iterator

from voxdisplay.errors import TransportTimeout
from voxdisplay.link.bandwidth_delay import MIN_PACKETS, DeliveryRate
from voxdisplay.link.counters import LinkCounters
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
    """Scheduler of the packets of one link.

    Parameters
    ----------
    frames : OutgoingFrames
    reads : ReadRequests
        What is to be sent.
    counters : LinkCounters
        Updated with each packet.

    Attributes
    ----------
    loss_rate : LossRate
    delivery_rate : DeliveryRate
    has_more : bool
        Whether the last burst ended at its size, so that another may follow at once.
    out_of_credit : bool
        Whether something is to be sent that credit does not allow.
    all_in_flight_damaged : bool
        Whether the last ACK reported damage of all that was in flight, so that no other will come.

    """

    def __init__(self, frames: OutgoingFrames, reads: ReadRequests, counters: LinkCounters) -> None:
        self._frames = frames
        self._reads = reads
        self._counters = counters
        self._window = SendWindow(0)
        self.loss_rate = LossRate()
        self.delivery_rate = DeliveryRate()
        self.has_more = False
        self.out_of_credit = False
        self.all_in_flight_damaged = False
        self._tag = 0
        self._damaged_since_taken = 0  # reported since the device last took anything
        self._max_payload = self._max_held_ticks = 0

    # -- the session

    def open_session(self, credit: int, max_payload: int, max_held_ticks: int) -> None:
        """Start a session.

        Parameters
        ----------
        credit : int
            Bytes that the device has room for.
        max_payload : int
            Bytes of the longest payload that it takes.
        max_held_ticks : int
            For how many refresh ticks all frames on their way may be held; 0 without HOLD.

        """
        self._window = SendWindow(credit)
        self._max_payload = max_payload
        self._max_held_ticks = max_held_ticks

    def close_session(self) -> None:
        """End the session: what is not finished is sent again in the next."""
        self._window = SendWindow(0)
        self.loss_rate.reset_damage_count()
        self.out_of_credit = False
        self._damaged_since_taken = 0
        self._frames.reset()
        self._reads.reset()

    def reset_delivery_rate(self) -> None:
        """Discard the measured delivery rate: the line may be another."""
        self.delivery_rate = DeliveryRate()

    # -- out

    def outgoing(self, now: float, displayed: PictureId) -> Iterator[bytes]:
        """Yield the packets that may be sent now, lost ones first because the window needs them.

        It ends after `BURST_BYTES`, so that the device can work while the next burst is made.

        Raises
        ------
        TransportTimeout
            If a packet was lost too often.

        """
        self.out_of_credit = self.has_more = False
        size = 0
        for part in (
            self._retransmissions(now),
            self._new_packets(now, displayed),
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
        """Return a STATUS, which always fits the reserve of the credit: its tag and its bytes."""
        self._tag = (self._tag + 1) % _MODULUS
        wire = packets.encode(packets.Status(seq=self._tag))
        self._window.send_tagged(self._tag, len(wire))
        return self._tag, wire

    def _retransmissions(self, now: float) -> Iterator[bytes]:
        while (seq := self._window.first_lost()) is not None:
            packet = self._window.outstanding[seq]
            if packet.transmission_count >= MAX_TRANSMISSIONS:
                raise TransportTimeout(
                    f"packet {seq} did not arrive in {packet.transmission_count} tries; the device "
                    f"counts {self._counters.device_damaged} damaged packets",
                    hint="the line is too noisy: lower the baud rate, or check cable and ground",
                )
            size = len(packet.wire)
            if self._exceeds_flight_limit(size) or self._lacks_credit(size):
                return
            self._counters.retransmitted += 1
            yield self._send(seq, now)

    def _new_packets(self, now: float, displayed: PictureId) -> Iterator[bytes]:
        for frame in self._frames:
            if not frame.started:
                frame.hold = min(frame.hold, self._max_held_ticks)
                if self._frames.held_ticks + frame.hold > self._max_held_ticks:
                    return
                self._frames.resolve_difference(frame, None if self.outstanding else displayed)
            frame.add_hold_op(self._max_payload)
            while frame.sendable:
                size = packets.max_wire_bytes(len(frame.next_payload) + spec.LIMIT_OVERHEAD)
                if (
                    not self._window.has_room
                    or self._exceeds_flight_limit(size)
                    or self._lacks_credit(size)
                ):
                    return
                self._counters.packets += 1
                # In this order, an interrupt skips no payload.
                data = self._frames.next_packet(frame, self._window.next_seq)
                seq = self._window.add(packets.encode(data))
                self._frames.mark_packetized(frame)
                yield self._send(seq, now)
            if frame.open:  # later frames wait for its last payload
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
        """Return whether a packet must wait for the ACKs of those in flight."""
        count, in_flight_bytes = self._window.in_flight
        return count > 0 and not self.delivery_rate.allows(count + 1, in_flight_bytes + size)

    def _lacks_credit(self, size: int) -> bool:
        self.out_of_credit = not self._window.has_credit(size)
        return self.out_of_credit

    # -- back

    @property
    def outstanding(self) -> int:
        """Number of DATA packets sent and not acknowledged, lost ones included."""
        return len(self._window.outstanding)

    @property
    def in_flight(self) -> int:
        """Number of DATA and READ packets whose answers are still to come."""
        count, _ = self._window.in_flight
        return count + self._reads.in_flight

    @property
    def in_flight_bytes(self) -> int:
        """Bytes of the DATA packets in flight."""
        return self._window.in_flight[1]

    @property
    def window_stalled(self) -> bool:
        """True if the window is full and at most two packets are in flight.

        Should their answer be lost, no other would come.
        """
        count, _ = self._window.in_flight
        return 0 < count <= MIN_PACKETS and not (self.has_more or self._window.has_room)

    def acknowledge(self, ack: packets.Ack, now: float) -> float | None:
        """Apply an ACK and return the round-trip time of the newest packet that it acknowledges.

        Returns
        -------
        float or None
            Seconds; None if it acknowledges nothing new.

        Raises
        ------
        RemoteProtocolError
            If it reports a packet that was never sent.

        """
        taken = self._window.taken
        done = self._window.acknowledge(ack)
        for packet in done:
            self.delivery_rate.sample(
                len(packet.wire), packet.delivered_before, now - packet.sent_s
            )
        self._reads.mark_lost(self._window.taken)
        self._count_damage(ack.damaged, progress=self._window.taken > taken)
        return now - done[-1].sent_s if done else None

    def _count_damage(self, counter: int, *, progress: bool) -> None:
        damaged = self.loss_rate.count_damage(counter)
        self._counters.device_damaged += damaged
        # Damage before something that was taken is accounted for: those packets are lost.
        self._damaged_since_taken = 0 if progress else self._damaged_since_taken + damaged
        self.all_in_flight_damaged = damaged > 0 and self._damaged_since_taken >= self.in_flight

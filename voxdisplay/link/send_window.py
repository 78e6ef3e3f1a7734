"""Which packets are on their way, which are lost, and how many bytes may follow.

This is sections 9.1 to 9.3 of protocol.md.
Everything that is sent gets an *ordinal*. The pipe keeps order, so once the device has taken
something, all that was sent before and has not been received is lost: a fact, not a guess. Knows
packets only as sequence numbers and sizes; knows no frames and no clock.
"""

from __future__ import annotations

from dataclasses import dataclass

from voxdisplay.errors import RemoteProtocolError
from voxdisplay.wire import spec
from voxdisplay.wire.packet import Ack

_MODULUS = 256


@dataclass(slots=True)
class OutstandingPacket:
    """A DATA packet that the device has not received yet, as far as we know."""

    wire: bytes
    ordinal: int = 0
    sent_s: float = 0.0
    transmission_count: int = 0
    lost: bool = False
    delivered_before: int = 0  # bytes that had arrived when it was sent


@dataclass(frozen=True, slots=True)
class _Transmission:
    """When something was sent, and where in the stream of bytes it ended."""

    ordinal: int
    end: int


class SendWindow:
    """The sliding window over one session's DATA packets, and its credit."""

    def __init__(self, credit: int) -> None:
        self.next_seq = 0
        self.outstanding: dict[int, OutstandingPacket] = {}
        self._base = 0  # the lowest number not received
        self._ordinal = 0
        self._position = 0
        self._credit_end = credit  # absolute: bytes of the stream up to here fit
        self._lost_count = 0  # how many of the flights are
        # How many are not, and their bytes: asked for with each packet, so not counted anew.
        self.in_flight = (0, 0)
        self.taken = 0  # the newest ordinal that the device has taken
        self._data_taken = 0  # and of DATA
        self._data_transmissions: dict[int, list[_Transmission]] = {}  # of each transmission
        self._tagged_transmissions: dict[int, _Transmission] = {}

    @property
    def has_room(self) -> bool:
        """Whether another sequence number fits the window."""
        return (self.next_seq - self._base) % _MODULUS < spec.LIMIT_WINDOW

    def has_credit(self, size: int) -> bool:
        """Tell whether credit allows another ``size`` bytes of DATA or READ.

        Four STATUS packets, and there are never more without answer, always fit the reserve.
        """
        return self._position + size <= self._credit_end - spec.LIMIT_RESERVE

    def first_lost(self) -> int | None:
        """Give the oldest packet that is known to be lost, or None."""
        if not self._lost_count:
            return None
        order = sorted(self.outstanding, key=lambda seq: (seq - self._base) % _MODULUS)
        return next((seq for seq in order if self.outstanding[seq].lost), None)

    def add(self, wire: bytes) -> int:
        """Enter a new packet; give its sequence number's flight to `send` next."""
        seq = self.next_seq
        self.outstanding[seq] = OutstandingPacket(wire)
        self.next_seq = (seq + 1) % _MODULUS
        return seq

    def send(self, seq: int, now: float, delivered: int = 0) -> bytes:
        """Note that a packet goes out now, when so much had arrived; give its bytes."""
        flight = self.outstanding[seq]
        count, bytes_ = self.in_flight
        self.in_flight = count + 1, bytes_ + len(flight.wire)
        self._lost_count -= flight.lost
        flight.delivered_before = delivered
        mark = self._transmit(len(flight.wire))
        if not flight.transmission_count:
            self._data_transmissions[seq] = []  # the number has come round again
        self._data_transmissions[seq].append(mark)
        flight.ordinal, flight.sent_s, flight.lost = mark.ordinal, now, False
        flight.transmission_count += 1
        return flight.wire

    def send_tagged(self, tag: int, size: int) -> int:
        """Note that a STATUS or READ goes out now; give its ordinal."""
        self._tagged_transmissions[tag] = mark = self._transmit(size)
        return mark.ordinal

    def _transmit(self, size: int) -> _Transmission:
        self._ordinal += 1
        self._position += size
        return _Transmission(self._ordinal, self._position)

    def acknowledge(self, ack: Ack) -> list[OutstandingPacket]:
        """Take an ACK; give the packets that it reports as received.

        Raises
        ------
        RemoteProtocolError
            If it reports as received what was never sent.

        """
        if (ack.next - self._base) % _MODULUS > (self.next_seq - self._base) % _MODULUS:
            raise RemoteProtocolError(
                f"ACK: next is {ack.next}, which is not from {self._base} to {self.next_seq}",
                section="9",
                offset=1,
            )
        received = [seq for seq in self.outstanding if self._is_received(seq, ack)]
        done = [self.outstanding.pop(seq) for seq in received]
        self._base = ack.next
        if mark := self._transmission_of_last(ack):
            self._credit_end = max(self._credit_end, mark.end + ack.credit)
            self.taken = max(self.taken, mark.ordinal)
            for flight in self.outstanding.values():
                flight.lost = flight.lost or flight.ordinal <= self.taken
        sizes = [len(flight.wire) for flight in self.outstanding.values() if not flight.lost]
        self.in_flight = len(sizes), sum(sizes)
        self._lost_count = len(self.outstanding) - len(sizes)
        return done

    def _transmission_of_last(self, ack: Ack) -> _Transmission | None:
        """Give what ``last`` names, or what was sent before it at the latest.

        A packet that was taken but dropped (section 6, point 6) and has been sent again has more
        than one transmission, and an ACK for damage repeats the ``last`` before.
        """
        if ack.flags & spec.ACK_FLAG_ASKED:
            return self._tagged_transmissions.get(ack.last)
        marks = self._data_transmissions.get(ack.last, [])
        if ack.last in self.outstanding:
            named = next((mark for mark in marks if mark.ordinal >= self._data_taken), None)
        else:  # received: it is not sent again after that
            named = marks[-1] if marks else None
        if named:
            self._data_taken = max(self._data_taken, named.ordinal)
        return named

    def _is_received(self, seq: int, ack: Ack) -> bool:
        ahead = (seq - ack.next) % _MODULUS
        if ahead >= _MODULUS // 2:
            return True
        return ahead > 0 and bool(ack.received >> (ahead - 1) & 1)

"""Selective-repeat send window with credit (protocol.md, sections 9.1 to 9.3).

Every transmission gets an *ordinal*. The pipe keeps order, so once the device has taken one, all
earlier ones that it has not received are known to be lost; no timeout guesses it. Must not know
frames or a clock: packets are sequence numbers and sizes here.
"""

from __future__ import annotations

from dataclasses import dataclass

from voxdisplay.errors import RemoteProtocolError
from voxdisplay.wire import spec
from voxdisplay.wire.packet import Ack

_MODULUS = 256


@dataclass(slots=True)
class OutstandingPacket:
    """DATA packet that has been sent and not acknowledged: in flight, or lost.

    Attributes
    ----------
    wire : bytes
    ordinal : int
        Of its latest transmission.
    sent_s : float
        Time of its latest transmission.
    transmission_count : int
    lost : bool
    delivered_before : int
        Bytes that the line had delivered when it was sent last.

    """

    wire: bytes
    ordinal: int = 0
    sent_s: float = 0.0
    transmission_count: int = 0
    lost: bool = False
    delivered_before: int = 0


@dataclass(frozen=True, slots=True)
class _Transmission:
    """One transmission: its ordinal, and the offset of its end in the stream of bytes."""

    ordinal: int
    end: int


class SendWindow:
    """Sliding window over the DATA packets of one session, and the credit of that session.

    Parameters
    ----------
    credit : int
        Bytes that the device has room for at first.

    Attributes
    ----------
    next_seq : int
        Sequence number of the next new packet.
    outstanding : dict of int to OutstandingPacket
        By sequence number.
    in_flight : tuple of int
        Number and bytes of the packets that are outstanding and not lost. Kept up to date rather
        than counted, because it is read for each packet.
    taken : int
        Highest ordinal that the device is known to have taken.

    """

    def __init__(self, credit: int) -> None:
        self.next_seq = 0
        self.outstanding: dict[int, OutstandingPacket] = {}
        self.in_flight = (0, 0)
        self.taken = 0
        self._base = 0  # the lowest sequence number not received
        self._ordinal = 0
        self._stream_bytes = 0  # sent in this session
        self._credit_end = credit  # offset in that stream up to which the device has room
        self._lost_count = 0
        self._data_taken = 0  # the highest ordinal of a DATA that the device has taken
        self._data_transmissions: dict[int, list[_Transmission]] = {}  # by sequence number
        self._tagged_transmissions: dict[int, _Transmission] = {}

    @property
    def has_room(self) -> bool:
        """True if another sequence number fits the window."""
        return (self.next_seq - self._base) % _MODULUS < spec.LIMIT_WINDOW

    def has_credit(self, size: int) -> bool:
        """Return whether credit allows another ``size`` bytes of DATA or READ.

        STATUS needs no such question: the at most four outstanding ones fit the reserve.
        """
        return self._stream_bytes + size <= self._credit_end - spec.LIMIT_RESERVE

    def first_lost(self) -> int | None:
        """Return the sequence number of the oldest lost packet, or None."""
        if not self._lost_count:
            return None
        order = sorted(self.outstanding, key=lambda seq: (seq - self._base) % _MODULUS)
        return next((seq for seq in order if self.outstanding[seq].lost), None)

    def add(self, wire: bytes) -> int:
        """Add a new packet and return its sequence number, which is to be passed to `send`."""
        seq = self.next_seq
        self.outstanding[seq] = OutstandingPacket(wire)
        self.next_seq = (seq + 1) % _MODULUS
        return seq

    def send(self, seq: int, now: float, delivered: int = 0) -> bytes:
        """Record a transmission of an outstanding packet and return its bytes.

        Parameters
        ----------
        seq : int
        now : float
        delivered : int
            Bytes that the line has delivered so far.

        """
        packet = self.outstanding[seq]
        count, size = self.in_flight
        self.in_flight = count + 1, size + len(packet.wire)
        self._lost_count -= packet.lost
        packet.delivered_before = delivered
        transmission = self._transmit(len(packet.wire))
        if not packet.transmission_count:
            self._data_transmissions[seq] = []  # those of an earlier packet of this number
        self._data_transmissions[seq].append(transmission)
        packet.ordinal, packet.sent_s, packet.lost = transmission.ordinal, now, False
        packet.transmission_count += 1
        return packet.wire

    def send_tagged(self, tag: int, size: int) -> int:
        """Record a transmission of a STATUS or READ and return its ordinal."""
        self._tagged_transmissions[tag] = transmission = self._transmit(size)
        return transmission.ordinal

    def _transmit(self, size: int) -> _Transmission:
        self._ordinal += 1
        self._stream_bytes += size
        return _Transmission(self._ordinal, self._stream_bytes)

    def acknowledge(self, ack: Ack) -> list[OutstandingPacket]:
        """Apply an ACK and return the packets that it newly reports as received.

        Raises
        ------
        RemoteProtocolError
            If it reports a packet that was never sent.

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
        if last := self._transmission_of_last(ack):
            self._credit_end = max(self._credit_end, last.end + ack.credit)
            self.taken = max(self.taken, last.ordinal)
            for packet in self.outstanding.values():
                packet.lost = packet.lost or packet.ordinal <= self.taken
        sizes = [len(packet.wire) for packet in self.outstanding.values() if not packet.lost]
        self.in_flight = len(sizes), sum(sizes)
        self._lost_count = len(self.outstanding) - len(sizes)
        return done

    def _transmission_of_last(self, ack: Ack) -> _Transmission | None:
        """Return the transmission that ``last`` of an ACK refers to, or the earliest it may be.

        A packet that was taken but dropped (section 6, point 6) and has been sent again has several
        transmissions, and an ACK for damage repeats the ``last`` of the ACK before.
        """
        if ack.flags & spec.ACK_FLAG_ASKED:
            return self._tagged_transmissions.get(ack.last)
        sent = self._data_transmissions.get(ack.last, [])
        if ack.last in self.outstanding:
            found = next((each for each in sent if each.ordinal >= self._data_taken), None)
        else:  # received, and after that it is not sent again
            found = sent[-1] if sent else None
        if found:
            self._data_taken = max(self._data_taken, found.ordinal)
        return found

    def _is_received(self, seq: int, ack: Ack) -> bool:
        ahead = (seq - ack.next) % _MODULUS
        if ahead >= _MODULUS // 2:
            return True
        return ahead > 0 and bool(ack.received >> (ahead - 1) & 1)

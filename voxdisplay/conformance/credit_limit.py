"""Limit in the byte stream up to which a device has granted credit (section 9.2 of protocol.md).

Reads what is sent and what is answered, in whatever check, and reports an ACK whose grant ends
before that of an earlier one. A packet that was sent more than once has several ends; the limit is
then taken as low, and the grant as high, as they may be: a device is never blamed for a doubt.
Judges nothing else, and sends nothing.
"""

from __future__ import annotations

from collections import defaultdict, deque

from voxdisplay.conformance import packets
from voxdisplay.conformance.packets import Response
from voxdisplay.wire import spec

_LAST_OF_HELLO = spec.LAYOUT_HELLO[-1][1]  # offset of its last field
_NO_DATA = 255  # `last` before a session's first DATA


class CreditLimit:
    """Farthest limit that a device has granted in the open session.

    Positions are counts of bytes sent, without the 00 of empty segments: they need no credit.
    """

    def __init__(self) -> None:
        self._sent = 0
        self._segment = bytearray()
        self._hellos: deque[tuple[int, int]] = deque()  # session, and end
        self._ends: dict[tuple[int, int], list[int]] = defaultdict(list)  # by type and number
        self._session = 0
        self._limit = 0
        self._earliest = 0  # the packet named by the latest ACK ends here or later
        self._named_data = False

    def note_sent(self, stream: bytes) -> None:
        """Record bytes that are sent."""
        *ended, rest = (bytes(self._segment) + stream).split(b"\0")
        self._segment[:] = rest
        for segment in ended:
            if segment:
                self._sent += len(segment) + 1
                packet = packets.decode_segment(segment)
                if packet is not None and len(segment) >= spec.LIMIT_MIN_SEGMENT:
                    self._note_packet(packet)

    def _note_packet(self, packet: bytes) -> None:
        kind = packet[0] >> 4
        if kind in {spec.TYPE_DATA, spec.TYPE_STATUS}:
            self._ends[kind, packet[1]].append(self._sent)
        elif kind == spec.TYPE_HELLO and len(packet) > _LAST_OF_HELLO:
            is_own = packet[3] == spec.VERSION_MAJOR
            session = int.from_bytes(packet[4:6], "little")
            if is_own and session:
                self._hellos.append((session, self._sent))

    def check(self, answer: Response) -> str:
        """Return what is wrong with the credit of a response; an empty text if nothing is."""
        if answer.kind == spec.TYPE_INFO:
            self._open_session(answer)
        elif answer.kind == spec.TYPE_ACK and answer.session == self._session:
            return self._check_ack(answer)
        return ""

    def _open_session(self, info: Response) -> None:
        if all(session != info.session for session, _ in self._hellos):
            return
        while self._hellos:
            session, end = self._hellos.popleft()
            if session == info.session:
                break
        self._session = session
        self._earliest, self._limit = end, end + info.rx_buffer
        self._named_data = False
        for ends in self._ends.values():
            ends[:] = [position for position in ends if position > end]

    def _check_ack(self, ack: Response) -> str:
        is_asked = bool(ack.flags & packets.ASKED)
        if not is_asked and ack.last == _NO_DATA and not self._named_data:
            return ""  # it names no packet, or perhaps number 255
        kind = spec.TYPE_STATUS if is_asked else spec.TYPE_DATA
        ends = [end for end in self._ends[kind, ack.last] if end >= self._earliest]
        if not ends:
            return ""
        self._named_data = self._named_data or not is_asked
        granted, limit = ends[-1] + ack.credit, self._limit
        self._earliest = ends[0]
        self._limit = max(limit, ends[0] + ack.credit)
        if granted >= limit:
            return ""
        return f"credit {ack.credit}, {limit - granted} bytes less than granted before, in {ack}"

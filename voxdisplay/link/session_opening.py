"""Opening of a session: HELLO until INFO comes (protocol.md, section 5).

Also the diagnosis of what came instead. Must not know a clock: the time is an argument.
"""

from __future__ import annotations

from voxdisplay.errors import TransportTimeout
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec
from voxdisplay.wire.packet_stream import PacketStream

HELLO_INTERVAL_S = 0.25
PARTIAL_INFO_HINT = (
    "the device stopped in the middle of its answer: has it lost its power, or does it send only a "
    "part of INFO? A line that loses or changes bytes looks the same: check baud rate and ground"
)
_KEPT_BYTES = 2048  # longer than any INFO
_SESSION_END = 6  # INFO: type, sequence number, frame, major, and two bytes of the session
_MIN_RECOGNIZED = 3  # bytes by which an INFO that has just begun is told from noise


class SessionOpening:
    """Opening of one session.

    Parameters
    ----------
    session : int
        Its number, 1..65535.
    now : float
    interval_s : float
        Time between two HELLOs.

    Attributes
    ----------
    session : int
    due_s : float
        Time of the next HELLO.

    """

    def __init__(self, session: int, now: float, interval_s: float = HELLO_INTERVAL_S) -> None:
        self.session = session
        self.due_s = now
        self._interval_s = interval_s
        self._count = 0
        self._wire = packets.encode(packets.Hello(session=session))
        self._zeros = 0
        self._received = b""  # the last bytes that came

    def successor(self, now: float) -> SessionOpening:
        """Return the opening of the session after this one."""
        return SessionOpening(self.session % 0xFFFF + 1, now)

    def hello(self, now: float) -> bytes:
        """Return a HELLO if one is due, else nothing."""
        if now < self.due_s:
            return b""
        self.due_s = now + self._interval_s
        self._count += 1
        return b"\0" + self._wire

    @property
    def unread_bytes(self) -> int:
        """Most bytes of HELLOs that may still be in the device's buffer when INFO has come.

        Which of them it answers is unknown: all after the first may still be there.
        """
        return (self._count - 1) * len(self._wire)

    # -- diagnosis

    def note_received(self, data: bytes) -> None:
        """Remember bytes that came before INFO."""
        self._zeros += data.count(0)
        self._received = (self._received + data)[-_KEPT_BYTES:]

    @property
    def partial_info(self) -> str | None:
        """Description of an INFO for this session that did not come whole; None if none began."""
        *ended, rest = self._received.split(b"\0")
        for segment, is_ended in ((rest, False), *((each, True) for each in reversed(ended))):
            # A device may begin anew with each HELLO, and never send a 00.
            for beginning in (segment[segment.rfind(segment[:_MIN_RECOGNIZED]) :], segment):
                if self._begins_info(beginning):
                    what = "INFO that is incomplete or damaged" if is_ended else "incomplete INFO"
                    return f"an {what}, of which {len(beginning)} bytes came"
        return None

    def _begins_info(self, segment: bytes) -> bool:
        raw = _decode_beginning(segment, _SESSION_END)
        if len(raw) < _MIN_RECOGNIZED or raw[0] >> 4 != spec.TYPE_INFO or raw[1] or raw[2]:
            return False
        session = self.session.to_bytes(2, "little")
        return session.startswith(raw[_SESSION_END - 2 :])

    def timeout_error(self, timeout_s: float, stream: PacketStream) -> TransportTimeout:
        """Return the error for a HELLO without INFO, which describes what came instead.

        Parameters
        ----------
        timeout_s : float
            How long HELLO was sent.
        stream : PacketStream
            That which was fed with all received bytes.

        """
        if partial := self.partial_info:
            return TransportTimeout(
                f"HELLO was answered by {partial} within {timeout_s:g} s", hint=PARTIAL_INFO_HINT
            )
        if self._wire in self._received:
            received = "what came is the HELLO itself: the line echoes what is sent"
            hint = "are RX and TX of the adapter connected to each other? Does a terminal echo?"
        elif noise := stream.noise:
            received = f"what came was no packet: {noise[:24]!r}"
            hint = "is this the display's port, and its baud rate right?"
        elif count := stream.counters.packets + stream.counters.unknown:
            received = f"{count} valid packet{'s' if count > 1 else ''} came, but no INFO"
            hint = "another program may be using this display at the same time"
        elif self._zeros:
            received = f"only zeros came, {self._zeros} of them"
            hint = (
                "is the line held low, by a wire to ground, wrong levels or a display that is off? "
                "Or is its rate far below ours?"
            )
        else:
            received = "nothing came at all"
            hint = "is the display switched on, and is this its port?"
        return TransportTimeout(
            f"nothing answered HELLO within {timeout_s:g} s; {received}", hint=hint
        )


def too_many_restarts(count: int) -> TransportTimeout:
    """Return the error for a device that has lost its session ``count`` times in a row."""
    return TransportTimeout(
        f"the device has lost the session {count} times without showing a frame",
        hint="does it restart by itself? Check its power supply",
    )


def _decode_beginning(segment: bytes, size: int) -> bytes:
    """Return the first ``size`` bytes of a packet of which only the beginning may have come.

    The COBS decoder of complete packets takes no such beginning.
    """
    raw = bytearray()
    at = 0
    while at < len(segment) and len(raw) < size:
        code = segment[at]
        raw += segment[at + 1 : at + code]
        at += code
        if at <= len(segment) and code < 0xFF:
            raw.append(0)
    return bytes(raw[:size])

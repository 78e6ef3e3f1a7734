"""HELLO, until it is answered (section 5). Knows a clock only as the ``now`` it is told."""

from __future__ import annotations

from voxdisplay.errors import TransportTimeout
from voxdisplay.wire import packet as packets
from voxdisplay.wire.packet_stream import PacketStream

HELLO_INTERVAL_S = 0.25


class SessionOpening:
    """The opening of one session.

    Parameters
    ----------
    session : int
        Its number, 1..65535.
    now : float

    """

    def __init__(self, session: int, now: float) -> None:
        self.session = session
        self.due_s = now
        self._count = 0
        self._wire = packets.encode(packets.Hello(session=session))

    def successor(self, now: float) -> SessionOpening:
        """Give the opening of the session after this one."""
        return SessionOpening(self.session % 0xFFFF + 1, now)

    def hello(self, now: float) -> bytes:
        """Give a HELLO if it is time for one."""
        if now < self.due_s:
            return b""
        self.due_s = now + HELLO_INTERVAL_S
        self._count += 1
        return b"\0" + self._wire

    @property
    def unread_bytes(self) -> int:
        """Bytes that may still be in the device's buffer when INFO has come.

        Which HELLO it answers cannot be known: all behind the first may still be there.
        """
        return (self._count - 1) * len(self._wire)


def no_info_error(timeout_s: float, stream: PacketStream, zeros: int) -> TransportTimeout:
    """Give what is raised if nothing has answered for so long: with what came instead.

    Parameters
    ----------
    timeout_s : float
    stream : PacketStream
        Where all went that came.
    zeros : int
        How many 00 were in it: by themselves they are no packet, and no noise.

    """
    if noise := stream.noise:
        heard = f"what came was no packet: {noise[:24]!r}"
        hint = "is this the display's port, and its baud rate right?"
    elif stream.counters.packets or stream.counters.unknown:
        heard = "packets came, but none that answers it"
        hint = "does another program talk to this display at the same time?"
    elif zeros:
        heard = f"only zeros came, {zeros} of them"
        hint = (
            "is the line held low, by a wire to ground, wrong levels or a display that is off? "
            "Or its rate far below ours?"
        )
    else:
        heard = "nothing came at all"
        hint = "is the display switched on, and this its port?"
    return TransportTimeout(f"nothing answered HELLO within {timeout_s:g} s; {heard}", hint=hint)

"""HELLO, until it is answered (section 5). Knows a clock only as the ``now`` it is told."""

from __future__ import annotations

from voxdisplay.errors import TransportTimeout
from voxdisplay.wire import packet as packets

HELLO_INTERVAL_S = 0.25


class Greeting:
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

    def next(self, now: float) -> Greeting:
        """Give the opening of the session after this one."""
        return Greeting(self.session % 0xFFFF + 1, now)

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


def no_answer(patience_s: float, noise: bytes) -> TransportTimeout:
    """Give what is raised if nothing has answered for so long, but what came instead."""
    heard = f"what came was no packet: {noise[:24]!r}" if noise else "nothing came at all"
    return TransportTimeout(
        f"nothing answered HELLO within {patience_s:g} s; {heard}",
        hint="is this the display's port, and its baud rate right?"
        if noise
        else "is the display switched on, and this its port?",
    )

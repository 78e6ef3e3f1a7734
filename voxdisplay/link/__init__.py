"""Sans-I/O host endpoint of protocol.md: bytes in, events out, time is an argument.

Must not know any pipe, thread or clock.
"""

from voxdisplay.link.counters import LinkCounters
from voxdisplay.link.events import (
    Event,
    FrameShown,
    PacketRefused,
    PageReceived,
    SessionLost,
    SessionOpened,
    StatusReceived,
)
from voxdisplay.link.link import Link
from voxdisplay.link.outgoing_frames import PictureId

__all__ = [
    "Event",
    "FrameShown",
    "Link",
    "LinkCounters",
    "PacketRefused",
    "PageReceived",
    "PictureId",
    "SessionLost",
    "SessionOpened",
    "StatusReceived",
]

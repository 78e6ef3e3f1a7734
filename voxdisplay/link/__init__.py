"""The host's end of protocol.md, without any I/O: bytes in, events out, time is an argument."""

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

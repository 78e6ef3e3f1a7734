"""The host's end of protocol.md, without any I/O: bytes in, events out, time is an argument."""

from voxdisplay.link.counters import LinkCounters
from voxdisplay.link.events import Event, PageRead, Ready, Refused, Restarted, Shown, Told
from voxdisplay.link.link import Link
from voxdisplay.link.outgoing_frames import OnDisplay

__all__ = [
    "Event",
    "Link",
    "LinkCounters",
    "OnDisplay",
    "PageRead",
    "Ready",
    "Refused",
    "Restarted",
    "Shown",
    "Told",
]

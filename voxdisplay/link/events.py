"""What a `Link` has to tell: plain values, no behaviour."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from voxdisplay.wire.packet import Error, Info, Page


@dataclass(frozen=True, slots=True)
class SessionOpened:
    """A session is open."""

    info: Info


@dataclass(frozen=True, slots=True)
class FrameShown:
    """A frame is on display. ``digest`` is the device's, or None if it gives none."""

    ticket: int
    digest: int | None


@dataclass(frozen=True, slots=True)
class StatusReceived:
    """The device was asked what is on display; ``digest`` is None if it gives none."""

    digest: int | None


@dataclass(frozen=True, slots=True)
class PageReceived:
    """Pixels came back."""

    page: Page


@dataclass(frozen=True, slots=True)
class PacketRefused:
    """The device refused a packet; if it was a DATA, the session is over."""

    error: Error


@dataclass(frozen=True, slots=True)
class SessionLost:
    """The device has lost the session; a new one is being opened, and frames are sent again."""


Event: TypeAlias = (
    SessionOpened | FrameShown | StatusReceived | PageReceived | PacketRefused | SessionLost
)

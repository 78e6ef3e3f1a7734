"""Events that a `Link` returns from received bytes: plain values, no behaviour."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from voxdisplay.wire.packet import Error, Info, Page


@dataclass(frozen=True, slots=True)
class SessionOpened:
    """The device has answered HELLO."""

    info: Info


@dataclass(frozen=True, slots=True)
class FrameShown:
    """A frame is on display. ``digest`` is the device's, None without that feature."""

    ticket: int
    digest: int | None


@dataclass(frozen=True, slots=True)
class StatusReceived:
    """Answer to `Link.request_status`. ``digest`` is the front page's, None without the feature."""

    digest: int | None


@dataclass(frozen=True, slots=True)
class PageReceived:
    """Answer to `Link.read`: pixels of the requested range, or the first of them."""

    page: Page


@dataclass(frozen=True, slots=True)
class PacketRefused:
    """The device sent ERROR: the session is over, and all queued frames and reads are dropped."""

    error: Error


@dataclass(frozen=True, slots=True)
class SessionLost:
    """The device no longer has the session. A new one is being opened; frames are sent again."""


Event: TypeAlias = (
    SessionOpened | FrameShown | StatusReceived | PageReceived | PacketRefused | SessionLost
)

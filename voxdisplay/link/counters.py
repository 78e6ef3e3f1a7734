"""What a link has done: plain numbers, no behaviour."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class LinkCounters:
    """What a link has done since it was made."""

    packets: int = 0
    wire_bytes: int = 0
    retransmitted: int = 0
    statuses: int = 0
    sessions: int = 0
    device_damaged: int = 0

"""Counters of one link: plain numbers, no behaviour."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class LinkCounters:
    """Totals since the link was made, over all its sessions.

    Attributes
    ----------
    packets : int
        DATA packets, each counted once however often it was sent.
    wire_bytes : int
        Bytes sent, of all packets.
    received_bytes : int
        Bytes received, whatever they meant.
    retransmitted : int
        Retransmissions of DATA packets.
    statuses : int
        STATUS packets sent.
    sessions : int
        Sessions opened.
    device_damaged : int
        Damaged segments that the device has reported.

    """

    packets: int = 0
    wire_bytes: int = 0
    received_bytes: int = 0
    retransmitted: int = 0
    statuses: int = 0
    sessions: int = 0
    device_damaged: int = 0

"""How lossy the line has been, and how long packets should be on it.

A packet costs `OVERHEAD_BYTES` besides its payload, and is sent again if any of its bytes is hit:
with a chance e of each, payloads of sqrt(overhead / e) waste least. Knows packets only as sizes;
knows no window and no clock.
"""

from __future__ import annotations

import math

from voxdisplay.wire import spec
from voxdisplay.wire.packet import max_wire_bytes

# Header and check value, one code byte of COBS and the 00 (protocol.md, sections 3 and 4).
OVERHEAD_BYTES = spec.LIMIT_OVERHEAD + 2
# What is believed before anything was sent: payloads of 1 KiB are within 1 % of the best for bit
# error rates from 1e-9 to 1e-6. It weighs as much as so many bytes that were really sent.
INITIAL_PAYLOAD = 1024
_WEIGHT_BYTES = 1 << 16
# Shorter ones would save bytes, but 32 of them do not keep a fast line busy.
MIN_PAYLOAD = 128
# What is older than this counts half: lines get better and worse.
_MEMORY_BYTES = 1 << 20
_PACKETS_IN_BUFFER = 4  # so many must fit the device's buffer for the pipe to stay full
_MODULUS = 1 << 16


def clamp_payload(payload_bytes: int, max_payload: int, rx_buffer: int) -> int:
    """Give what comes closest to a length of payloads and suits a device with such an INFO."""
    room = (rx_buffer - spec.LIMIT_RESERVE) // _PACKETS_IN_BUFFER - max_wire_bytes(
        spec.LIMIT_OVERHEAD
    )
    return min(max(min(payload_bytes, room), spec.LIMIT_MIN_PAYLOAD), max_payload)


class LossRate:
    """The losses of one line."""

    def __init__(self) -> None:
        self._bytes = float(_WEIGHT_BYTES)
        self._lost = _WEIGHT_BYTES * OVERHEAD_BYTES / INITIAL_PAYLOAD**2
        self._damaged: int | None = None

    def count_sent(self, size: int) -> None:
        """Count bytes that went out in packets."""
        self._bytes += size
        if self._bytes > _MEMORY_BYTES:
            self._bytes /= 2
            self._lost /= 2

    def count_damage(self, count: int) -> int:
        """Take the device's count of damaged segments (section 9.4); give how many are new.

        When it is told for the first time, all but one are of others who have used the line.
        """
        before = max(count - 1, 0) if self._damaged is None else self._damaged
        self._damaged = count
        fresh = (count - before) % _MODULUS
        self._lost += fresh
        return fresh

    def reset_damage_count(self) -> None:
        """Note that the device may count from 0 again: it may have started anew."""
        self._damaged = None

    @property
    def best_payload(self) -> int:
        """Bytes of payload that waste least, for all that is known."""
        return max(MIN_PAYLOAD, int(math.sqrt(OVERHEAD_BYTES * self._bytes / self._lost)))

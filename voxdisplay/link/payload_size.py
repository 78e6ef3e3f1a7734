"""Payload length that wastes least on a lossy line.

A packet costs `OVERHEAD_BYTES` besides its payload, and is sent again if any of its bytes is hit:
with a byte error rate e, payloads of sqrt(overhead / e) waste least. Must not know the window or a
clock: packets are sizes here.
"""

from __future__ import annotations

import math

from voxdisplay.wire import spec
from voxdisplay.wire.packet import max_wire_bytes

# Header and check value, one code byte of COBS and the 00 (protocol.md, sections 3 and 4).
OVERHEAD_BYTES = spec.LIMIT_OVERHEAD + 2
# Prior, before anything was sent: payloads of 1 KiB are within 1 % of the best for bit error rates
# from 1e-9 to 1e-6. It weighs as much as so many bytes that were really sent.
INITIAL_PAYLOAD = 1024
_PRIOR_BYTES = 1 << 16
# Shorter ones would save bytes, but 32 of them do not keep a fast line busy.
MIN_PAYLOAD = 128
_HALVING_BYTES = 1 << 20  # older losses count half, because lines get better and worse
_PACKETS_IN_BUFFER = 4  # so many must fit the device's buffer for the pipe to stay full
_MODULUS = 1 << 16


def clamp_payload(payload_bytes: int, max_payload: int, rx_buffer: int) -> int:
    """Return the payload length nearest to ``payload_bytes`` that suits a device.

    Parameters
    ----------
    payload_bytes : int
    max_payload, rx_buffer : int
        Bytes, from the device's INFO.

    """
    share_bytes = (rx_buffer - spec.LIMIT_RESERVE) // _PACKETS_IN_BUFFER
    room = share_bytes - max_wire_bytes(spec.LIMIT_OVERHEAD)
    return min(max(min(payload_bytes, room), spec.LIMIT_MIN_PAYLOAD), max_payload)


class LossRate:
    """Estimator of the damage per byte sent on one line."""

    def __init__(self) -> None:
        self._sent_bytes = float(_PRIOR_BYTES)
        self._hits = _PRIOR_BYTES * OVERHEAD_BYTES / INITIAL_PAYLOAD**2
        self._damaged: int | None = None  # the device's counter

    def count_sent(self, size: int) -> None:
        """Count ``size`` bytes of packets as sent."""
        self._sent_bytes += size
        if self._sent_bytes > _HALVING_BYTES:
            self._sent_bytes /= 2
            self._hits /= 2

    def count_damage(self, counter: int) -> int:
        """Take the device's counter of damaged segments (section 9.4); return how many are new.

        At most one of the first value is: the others may be from earlier users of the line.
        """
        before = max(counter - 1, 0) if self._damaged is None else self._damaged
        self._damaged = counter
        new = (counter - before) % _MODULUS
        self._hits += new
        return new

    def reset_damage_count(self) -> None:
        """Expect another counter, as after a restart of the device."""
        self._damaged = None

    @property
    def best_payload(self) -> int:
        """Payload bytes that waste least at the estimated rate."""
        return max(MIN_PAYLOAD, int(math.sqrt(OVERHEAD_BYTES * self._sent_bytes / self._hits)))

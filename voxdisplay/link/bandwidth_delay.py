"""Delivery rate of a line, and the limit on bytes in flight (bandwidth-delay product).

Buffers between host and device may hold more than a slow line carries in minutes, and a
retransmission would queue behind all of it. So no more is in flight than keeps the line busy at its
measured rate. Must not know packets but by size and time; credit and sequence numbers are those of
`send_window`.
"""

from __future__ import annotations

import math

MIN_BYTES = 4096  # always allowed in flight
MIN_PACKETS = 2  # likewise: one that is being sent, and one behind it
# The rest of the window is room for new packets while a retransmission is in flight. Of 10, 13, 16
# and 20 this has the highest goodput at a bit error rate of 1e-4 (tools/bench.py goodput).
MAX_PACKETS = 13
SCHEDULING_DELAY_S = 0.02  # the caller may be late by so much: processes wait for their turn
ENCODING_DELAY_S = 0.06  # until the encoder yields the first bytes of a frame
_DECAY = 1 / 64  # of a rate that is not reached any more, with each packet delivered


class DeliveryRate:
    """Estimator of the delivery rate and round-trip time of one line.

    Attributes
    ----------
    delivered : int
        Bytes that the device has acknowledged so far.

    """

    def __init__(self) -> None:
        self.delivered = 0
        self._bytes_per_s = 0.0
        self._round_trip_s = math.inf  # the shortest: longer ones include time in a queue
        self._was_busy = False

    def sample(self, size: int, delivered_before: int, seconds: float) -> None:
        """Take a sample from an acknowledged packet.

        Parameters
        ----------
        size : int
            Its bytes.
        delivered_before : int
            `delivered` when it was sent.
        seconds : float
            Time since it was sent, in which the line has delivered all bytes in between.

        """
        self.delivered += size
        seconds = max(seconds, 1e-6)
        meanwhile = self.delivered - delivered_before
        self._was_busy |= meanwhile >= MIN_BYTES
        self._bytes_per_s = max(meanwhile / seconds, self._bytes_per_s * (1 - _DECAY))
        self._round_trip_s = min(seconds, self._round_trip_s)

    @property
    def bytes_per_s(self) -> float | None:
        """Delivery rate of the busy line; None as long as it had too little to carry."""
        return self._bytes_per_s if self._was_busy else None

    @property
    def min_bytes_per_s(self) -> float | None:
        """Lower bound of the rate, from packets that need not have kept the line busy."""
        return self._bytes_per_s or None

    def allows(self, packets: int, size: int) -> bool:
        """Return whether ``packets`` packets of ``size`` bytes in all may be in flight."""
        if packets <= MIN_PACKETS:
            return True
        rate = self._bytes_per_s
        busy_bytes = 1.25 * rate * self._round_trip_s if rate else 0.0
        in_time = size <= max(MIN_BYTES, busy_bytes + rate * SCHEDULING_DELAY_S)
        return in_time and (packets <= MAX_PACKETS or size <= busy_bytes)

    def drains_early(self, size: int) -> bool:
        """Return whether ``size`` bytes are sent before another frame begins to be encoded."""
        return size <= max(MIN_BYTES, self._bytes_per_s * ENCODING_DELAY_S)

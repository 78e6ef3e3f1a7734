"""How much may be on its way, so that what is lost does not wait behind it longer than it must.

Buffers between host and device may hold more than a slow line carries in minutes; what is lost is
then sent again behind all of it, and the window stands still meanwhile. So no more is sent than
keeps the line busy, going by what it has been seen to deliver. Knows packets only as sizes and
times; credit and sequence numbers are the business of ``window.py``.
"""

from __future__ import annotations

import math

# On its way at any rate.
MIN_BYTES = 4096
# One that is being sent, and one behind it.
MIN_PACKETS = 2
# The rest of the window can be sent while a lost packet is on its way again. Of 10, 13, 16 and 20
# the one that leaves most of a line with a bit error rate of 1e-4 (tools/bench_goodput.py).
MAX_PACKETS = 13
# How late the caller may be: processes wait for their turn.
SCHEDULING_DELAY_S = 0.02
# How long coding may take before it gives the first bytes of a frame.
ENCODING_DELAY_S = 0.06
# How fast a rate that is not reached any more is forgotten, with each packet delivered.
_DECAY = 1 / 64


class DeliveryRate:
    """The rate of delivery of one line and its round trip, and what follows from them."""

    def __init__(self) -> None:
        self.delivered = 0
        self._rate = 0.0  # bytes per second
        # The shortest: what waited in a queue says nothing of the line.
        self._round_trip_s = math.inf
        self._was_busy = False

    def sample(self, size: int, before: int, seconds: float) -> None:
        """Count a packet that has arrived.

        Parameters
        ----------
        size : int
            Its bytes.
        before : int
            `delivered` when it was sent.
        seconds : float
            How long ago that was: meanwhile the line has delivered all that came in between.

        """
        self.delivered += size
        seconds = max(seconds, 1e-6)
        meanwhile = self.delivered - before
        self._was_busy |= meanwhile >= MIN_BYTES
        self._rate = max(meanwhile / seconds, self._rate * (1 - _DECAY))
        self._round_trip_s = min(seconds, self._round_trip_s)

    @property
    def bytes_per_s(self) -> float | None:
        """What the line carries; None if it has not had enough to do yet to tell."""
        return self._rate if self._was_busy else None

    def allows(self, packets: int, size: int) -> bool:
        """Tell whether so many packets of so many bytes in all may be on their way."""
        if packets <= MIN_PACKETS:
            return True
        busy = 1.25 * self._rate * self._round_trip_s if self._rate else 0.0
        in_time = size <= max(MIN_BYTES, busy + self._rate * SCHEDULING_DELAY_S)
        return in_time and (packets <= MAX_PACKETS or size <= busy)

    def drains_early(self, size: int) -> bool:
        """Tell whether so many bytes last no longer than what follows them takes to be coded."""
        return size <= max(MIN_BYTES, self._rate * ENCODING_DELAY_S)

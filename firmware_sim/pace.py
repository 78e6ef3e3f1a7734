"""The pace of a line: bytes handed over at once arrive one by one, ten bits each (16).

One direction of a line. It knows nothing of packets, and nothing of what the line is made of.
"""

from collections.abc import Callable
from typing import Final

_BITS: Final = 10  # of a byte: a start bit, eight, a stop bit
_LOOK_S: Final = 0.001  # who waits for bytes looks this often, or when the last one has arrived
_LEAST: Final = 4096  # bytes that wait before the line, as before a real one,
_WAIT_S: Final = 0.05  # or what it carries in this time, if that is more


class Pace:
    """Bytes on their way along one direction of a line.

    Parameters
    ----------
    baud
        Bits per second; 0: no time passes on the line.
    clock
        Seconds, never going back.
    """

    def __init__(self, baud: int, clock: Callable[[], float]) -> None:
        self._byte_s = _BITS / baud if baud else 0.0
        self._room = max(_LEAST, int(baud / _BITS * _WAIT_S))
        self._clock = clock
        self._queue = bytearray()
        self._began = 0.0  # when the first byte of the queue began to be sent

    @property
    def full(self) -> bool:
        """Whether so many bytes wait that no more should be handed over."""
        return bool(self._byte_s) and len(self._queue) >= self._room

    def put(self, data: bytes) -> None:
        """Hand bytes over; the line begins with them when it is free."""
        if not self._queue:
            self._began = self._clock()
        self._queue += data

    def get(self) -> bytes:
        """Return the bytes that have arrived by now."""
        count = len(self._queue)
        if self._byte_s:
            # A hair more, so that who wakes up just when a byte is due does find it.
            passed = (self._clock() - self._began) / self._byte_s + 1e-6
            count = min(count, int(passed))
        data = bytes(self._queue[:count])
        del self._queue[:count]
        self._began += count * self._byte_s  # and not now: what is late is made up for
        return data

    def until_due(self) -> float | None:
        """Return the seconds until it is worth looking again; None if nothing is on its way."""
        if not self._queue:
            return None
        count = min(len(self._queue), max(1, int(_LOOK_S / self._byte_s))) if self._byte_s else 0
        return max(0.0, self._began + count * self._byte_s - self._clock())

    def clear(self) -> None:
        """Lose what is on its way: the line was cut."""
        self._queue.clear()

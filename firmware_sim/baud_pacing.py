"""Baud-rate pacing of a line: bytes arrive one by one, ten bits each (16).

Knows nothing of packets, nor of the carrier.
"""

import time
from collections.abc import Callable
from typing import Final

from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine

_BITS_PER_BYTE: Final = 10  # start bit, eight data bits, stop bit
_POLL_S: Final = 0.001  # interval at which arriving bytes are handed over
_MIN_QUEUE_BYTES: Final = 4096  # size of the queue before the line, like that of a real driver,
_QUEUE_S: Final = 0.05  # or what the line carries in this time, if that is more


class PacedDirection:
    """Queue of bytes on one direction of a line.

    Parameters
    ----------
    baud
        Bits per second.
    clock
        Monotonic seconds.
    """

    def __init__(self, baud: int, clock: Callable[[], float]) -> None:
        self._byte_s = _BITS_PER_BYTE / baud
        self._room = max(_MIN_QUEUE_BYTES, int(baud / _BITS_PER_BYTE * _QUEUE_S))
        self._clock = clock
        self._queue = bytearray()
        self._began = 0.0  # time at which the first byte of the queue began to be sent

    @property
    def is_full(self) -> bool:
        """True if no more bytes should be queued."""
        return len(self._queue) >= self._room

    def put(self, data: bytes) -> None:
        """Queue bytes; the line sends them when it is free."""
        if not self._queue:
            self._began = self._clock()
        self._queue += data

    def get(self) -> bytes:
        """Return the bytes that have arrived by now."""
        # A little more, so that a caller that wakes up exactly when a byte is due finds it.
        passed = (self._clock() - self._began) / self._byte_s + 1e-6
        count = min(len(self._queue), int(passed))
        data = bytes(self._queue[:count])
        del self._queue[:count]
        self._began += count * self._byte_s  # not the current time: the rate holds on average
        return data

    def next_event_s(self) -> float | None:
        """Return the seconds until the next bytes are handed over; None if the queue is empty."""
        if not self._queue:
            return None
        count = min(len(self._queue), max(1, int(_POLL_S / self._byte_s)))
        return max(0.0, self._began + count * self._byte_s - self._clock())

    def clear(self) -> None:
        """Discard all bytes: the connection is gone."""
        self._queue.clear()


class PacedDevice:
    """A device on a line of limited rate, with the interface of `DeviceOnLine`.

    Parameters
    ----------
    wire
        The device on its line.
    baud
        Bits per second each way, ten to a byte.
    clock
        Monotonic seconds, the same as of ``wire``.

    Attributes
    ----------
    device : Device
        The device.
    """

    def __init__(
        self, wire: DeviceOnLine, baud: int, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._wire = wire
        self._down = PacedDirection(baud, clock)
        self._up = PacedDirection(baud, clock)

    @property
    def device(self) -> Device:
        """The device."""
        return self._wire.device

    def accepts_data(self) -> bool:
        """Return whether the line takes bytes from the host: not while its queue is full."""
        self.advance()
        return not self._down.is_full and self._wire.accepts_data()

    def receive(self, data: bytes) -> None:
        """Queue bytes from the host; the device gets them when the line has carried them."""
        self._down.put(data)
        self.advance()

    def transmit(self) -> bytes:
        """Return the bytes from the device that the line has carried to the host."""
        self.advance()
        self._load()
        return self._up.get()

    def advance(self) -> None:
        """Process the bytes and ticks that are due."""
        if data := self._down.get():
            self._wire.receive(data)
        else:
            self._wire.advance()

    def _load(self) -> None:
        if not self._up.is_full:
            self._up.put(self._wire.transmit())

    def next_event_s(self) -> float | None:
        """Return the seconds until the next event; None if none is scheduled."""
        self.advance()
        tick = self._wire.next_event_s()
        self._load()  # what the device has sent meanwhile is on the line, too
        times = (tick, self._down.next_event_s(), self._up.next_event_s())
        return min((seconds for seconds in times if seconds is not None), default=None)

    def disconnect(self) -> None:
        """End the connection: the session ends, and bytes on the line are lost."""
        self._down.clear()
        self._up.clear()
        self._wire.disconnect()


def with_baud(wire: DeviceOnLine, baud: int) -> DeviceOnLine | PacedDevice:
    """Return the device paced at a rate, or unchanged if the rate is 0: bytes take no time."""
    return PacedDevice(wire, baud) if baud else wire

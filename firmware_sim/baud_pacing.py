"""The pace of a line: bytes handed over at once arrive one by one, ten bits each (16).

It knows nothing of packets, and nothing of what the line is made of.
"""

import time
from collections.abc import Callable
from typing import Final

from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine

_BITS_PER_BYTE: Final = 10  # of a byte: a start bit, eight, a stop bit
_POLL_S: Final = 0.001  # who waits for bytes looks this often, or when the last one has arrived
_MIN_QUEUE_BYTES: Final = 4096  # bytes that wait before the line, as before a real one,
_QUEUE_S: Final = 0.05  # or what it carries in this time, if that is more


class PacedDirection:
    """Bytes on their way along one direction of a line.

    Parameters
    ----------
    baud
        Bits per second.
    clock
        Seconds, never going back.
    """

    def __init__(self, baud: int, clock: Callable[[], float]) -> None:
        self._byte_s = _BITS_PER_BYTE / baud
        self._room = max(_MIN_QUEUE_BYTES, int(baud / _BITS_PER_BYTE * _QUEUE_S))
        self._clock = clock
        self._queue = bytearray()
        self._began = 0.0  # when the first byte of the queue began to be sent

    @property
    def is_full(self) -> bool:
        """Whether so many bytes wait that no more should be handed over."""
        return len(self._queue) >= self._room

    def put(self, data: bytes) -> None:
        """Hand bytes over; the line begins with them when it is free."""
        if not self._queue:
            self._began = self._clock()
        self._queue += data

    def get(self) -> bytes:
        """Return the bytes that have arrived by now."""
        # A hair more, so that who wakes up just when a byte is due does find it.
        passed = (self._clock() - self._began) / self._byte_s + 1e-6
        count = min(len(self._queue), int(passed))
        data = bytes(self._queue[:count])
        del self._queue[:count]
        self._began += count * self._byte_s  # and not now: what is late is made up for
        return data

    def next_event_s(self) -> float | None:
        """Return the seconds until it is worth looking again; None if nothing is on its way."""
        if not self._queue:
            return None
        count = min(len(self._queue), max(1, int(_POLL_S / self._byte_s)))
        return max(0.0, self._began + count * self._byte_s - self._clock())

    def clear(self) -> None:
        """Lose what is on its way: the line was cut."""
        self._queue.clear()


class PacedDevice:
    """A wire whose bytes take their time, each way; it has the face of a `DeviceOnLine`.

    Parameters
    ----------
    wire
        The device on its line.
    baud
        Bits per second, ten to a byte.
    clock
        That of the wire.

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
        """Tell whether the line takes bytes from the host: not if too many wait before it."""
        self.advance()
        return not self._down.is_full and self._wire.accepts_data()

    def receive(self, data: bytes) -> None:
        """Take bytes from the host; the device has them when the line has carried them."""
        self._down.put(data)
        self.advance()

    def transmit(self) -> bytes:
        """Return what the line has carried to the host of what the device has sent."""
        self.advance()
        self._load()
        return self._up.get()

    def advance(self) -> None:
        """Let the bytes arrive and the ticks pass that have come due."""
        if data := self._down.get():
            self._wire.receive(data)
        else:
            self._wire.advance()

    def _load(self) -> None:
        if not self._up.is_full:
            self._up.put(self._wire.transmit())

    def next_event_s(self) -> float | None:
        """Return the seconds until anything happens by itself; None if nothing is in sight."""
        self.advance()
        tick = self._wire.next_event_s()
        self._load()  # what the device has said since it was asked last is on its way, too
        times = (tick, self._down.next_event_s(), self._up.next_event_s())
        return min((seconds for seconds in times if seconds is not None), default=None)

    def disconnect(self) -> None:
        """Break the connection: the session ends, and what was on its way is lost."""
        self._down.clear()
        self._up.clear()
        self._wire.disconnect()


def with_baud(wire: DeviceOnLine, baud: int) -> DeviceOnLine | PacedDevice:
    """Give a wire its pace; with a rate of 0 it stays as it is, and its bytes take no time."""
    return PacedDevice(wire, baud) if baud else wire

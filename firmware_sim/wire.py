"""A device on a line: its refresh ticks by a real clock, the pace of the line, and its faults.

It knows nothing of what the line is made of.
"""

import time
from collections.abc import Callable

from firmware_sim.device import Device
from firmware_sim.faults import Line
from firmware_sim.pace import Pace


class Wire:
    """A device that runs.

    Parameters
    ----------
    device
        The device.
    faults
        Faults of the line, both ways, as from `parse_faults`.
    seed
        Where their chance begins.
    clock
        Seconds, never going back.
    baud
        Bits per second of the line, ten to a byte, each way; 0: bytes take no time.

    Attributes
    ----------
    device : Device
        The device.
    """

    def __init__(
        self,
        device: Device,
        faults: tuple[tuple[str, float], ...] = (),
        seed: int = 0,
        clock: Callable[[], float] = time.monotonic,
        *,
        baud: int = 0,
    ) -> None:
        self.device = device
        self._in = Line(faults, seed, "in")
        self._out = Line(faults, seed, "out")
        self._down = Pace(baud, clock)
        self._up = Pace(baud, clock)
        self._clock = clock
        self._epoch = clock()
        self._due: int | None = None  # number of the tick that a swap waits for

    @property
    def full(self) -> bool:
        """Whether so much is on its way to the device that the line takes no more for now."""
        return self._down.full

    def receive(self, data: bytes) -> None:
        """Take bytes from the host; the device has them when the line has carried them."""
        self._down.put(data)
        self.advance()

    def transmit(self) -> bytes:
        """Return what the line has carried to the host of what the device has to send."""
        self.advance()
        self._load()
        return self._out.carry(self._up.get())

    def _load(self) -> None:
        if not self._up.full:
            self._up.put(self.device.transmit())

    def advance(self) -> None:
        """Let the bytes arrive and the refresh ticks pass that have come due.

        Of the ticks only those that swap matter. They are counted from the start, so that none
        drifts.
        """
        self._tick()
        if data := self._down.get():
            self.device.receive(self._in.carry(data))
            self._tick()

    def _tick(self) -> None:
        device = self.device
        tick = int((self._clock() - self._epoch) * device.config.refresh / 1000)
        if self._due is None:
            self._due = tick + 1  # at first, or when the frame has just become whole
        while device.pending and self._due <= tick:
            device.tick()
            self._due += 1
        if not device.pending:
            self._due = None

    def until_tick(self) -> float | None:
        """Return the seconds until the next tick that swaps; None if none is in sight."""
        self.advance()
        if self._due is None:
            return None
        due = self._epoch + self._due * 1000 / self.device.config.refresh
        return max(0.0, due - self._clock())

    def until_next(self) -> float | None:
        """Return the seconds until anything happens by itself; None if nothing is in sight."""
        tick = self.until_tick()
        self._load()  # what the device has said since it was asked last is on its way, too
        times = (tick, self._down.until_due(), self._up.until_due())
        return min((seconds for seconds in times if seconds is not None), default=None)

    def disconnect(self) -> None:
        """Break the connection: the session ends."""
        self._down.clear()
        self._up.clear()
        self.device.disconnect()

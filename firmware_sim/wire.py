"""A device on a line: its refresh ticks by a real clock, and the faults of the line.

It knows nothing of what the line is made of.
"""

import time
from collections.abc import Callable

from firmware_sim.device import Device
from firmware_sim.faults import Line


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
    ) -> None:
        self.device = device
        self._in = Line(faults, seed, "in")
        self._out = Line(faults, seed, "out")
        self._clock = clock
        self._epoch = clock()
        self._due: int | None = None  # number of the tick that a swap waits for

    def receive(self, data: bytes) -> None:
        """Carry bytes from the host to the device."""
        self.advance()
        self.device.receive(self._in.carry(data))
        self.advance()

    def transmit(self) -> bytes:
        """Carry all that the device has to send to the host."""
        self.advance()
        return self._out.carry(self.device.transmit())

    def takes(self) -> bool:
        """Tell whether the line takes bytes from the host: this one always does."""
        return True

    def advance(self) -> None:
        """Let the refresh ticks pass that have come due.

        Only those that swap matter. They are counted from the start, so that none drifts.
        """
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

    def disconnect(self) -> None:
        """Break the connection: the session ends."""
        self.device.disconnect()

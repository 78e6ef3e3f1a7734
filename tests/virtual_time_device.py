"""Emulated device and line in virtual time.

Waiting takes no real time, work takes no virtual time, and the machine's load does not matter.
"""

from firmware_sim.baud_pacing import PacedDevice
from firmware_sim.bench import Bench
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.faults import parse_faults

_INSTANT_S = 1e-6  # a look at something that happens now


class VirtualTimeDevice:
    """A device at the other end of a pipe: a `Transport`, with the clock that it goes by.

    ``late_s`` is how long every packet is on its way, each way; ``baud`` what the line carries.
    """

    port = "a device on the bench"

    def __init__(self, *, late_s=0.0, baud=0, **config):
        self._now = 0.0
        faults = parse_faults(f"delay={late_s}@1") if late_s else ()
        wire = DeviceOnLine(Device(Config(**config)), faults, clock=self.clock)
        self._wire = PacedDevice(wire, baud, self.clock) if baud else wire
        self.bench = Bench(wire.device)

    def clock(self):
        return self._now

    def read(self, timeout_s):
        until_s = self._now + timeout_s
        while not (come := self._wire.transmit()) and self._now < until_s:
            self._pass(until_s - self._now)
        return come

    def write(self, data, timeout_s):
        until_s = self._now + timeout_s
        while not self._wire.accepts_data():
            if self._now >= until_s:
                raise TimeoutError("the line is full")
            self._pass(until_s - self._now)
        self._wire.receive(data)

    def close(self):
        pass

    def _pass(self, most_s):
        happens_s = self._wire.next_event_s()
        self._now += most_s if happens_s is None else min(most_s, max(happens_s, _INSTANT_S))

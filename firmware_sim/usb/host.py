"""A host's side of the bus: what is plugged in, and transfers that end in time.

`Bus` is a host in the same process as the device; the other one is in `usbip_host`. Neither knows
what is transferred.
"""

import errno
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Protocol

from firmware_sim.usb.device import Urb, UsbDevice

HIGH_SPEED: Final = 3
SET_CONFIGURATION: Final = bytes((0x00, 9, 1, 0, 0, 0, 0, 0))


class Connection(Protocol):
    """The way to a device that has been opened."""

    def transfer(self, urb: Urb, timeout_s: float | None) -> None:
        """Do a transfer; give it up when the time is over. None waits as long as it takes.

        Raises
        ------
        ConnectionError
            If the device is gone already.
        """

    def close(self) -> None:
        """End it."""


@dataclass(frozen=True)
class PluggedDevice:
    """A device that is plugged in.

    Parameters
    ----------
    bus, number
        Its place; the number is another one each time it is plugged in.
    connect
        Opens the way to it, or raises OSError.
    drivers
        Interfaces that a driver of the host's system holds.
    """

    bus: int
    number: int
    connect: Callable[[], Connection] = field(compare=False)
    drivers: set[int] = field(default_factory=set, compare=False)


class Host(Protocol):
    """What devices are plugged into."""

    def plugged(self) -> list[PluggedDevice]:
        """List what is plugged in now."""


class Bus:
    """A host with one device on it, both in this process.

    Parameters
    ----------
    device
        The device. It is plugged in, and given its configuration, as systems do.

    Attributes
    ----------
    device : UsbDevice
        The device. Threads that transfer move it.
    drivers : set of int
        Interfaces that a driver of the system holds.
    forbidden : bool
        Whether the device may not be opened.
    """

    def __init__(self, device: UsbDevice) -> None:
        self.device = device
        self.drivers: set[int] = set()
        self.forbidden = False
        self._changed = threading.Condition()
        self._configure()

    def plugged(self) -> list[PluggedDevice]:
        """See `Host.plugged`."""
        if not self.device.plugged:
            return []
        number = self.device.number
        return [PluggedDevice(1, number, lambda: self._connect(number), self.drivers)]

    def unplug(self) -> None:
        """Pull the device out; transfers under way fail."""
        with self._changed:
            self.device.unplug()
            self._changed.notify_all()

    def plug(self) -> None:
        """Plug the device in, as after power on."""
        with self._changed:
            self.device.plug()
            self._configure()

    def _configure(self) -> None:
        self.device.submit(Urb(0, setup=SET_CONFIGURATION))

    def _connect(self, number: int) -> "_OnBus":
        if self.forbidden:
            raise PermissionError(errno.EACCES, "it may not be opened")
        return _OnBus(self, number)

    def transfer(self, number: int, urb: Urb, timeout_s: float | None) -> None:
        """Do a transfer with the device that had a number; see `Connection.transfer`."""
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        device = self.device
        with self._changed:
            if number != device.number or not device.plugged:
                raise ConnectionError("it is not plugged in")
            device.submit(urb)
            self._changed.notify_all()  # it may have finished what another thread waits for
            while urb.status is None:
                left = None if deadline is None else deadline - time.monotonic()
                if left is not None and left <= 0:
                    device.unlink(urb)
                    return
                waits = [wait for wait in (left, device.next_event_s()) if wait is not None]
                self._changed.wait(min(waits, default=None))
                device.advance()


class _OnBus:
    """The way to a device on a `Bus`."""

    def __init__(self, bus: Bus, number: int) -> None:
        self._bus = bus
        self._number = number

    def transfer(self, urb: Urb, timeout_s: float | None) -> None:
        self._bus.transfer(self._number, urb, timeout_s)

    def close(self) -> None:
        """See `Connection.close`: nothing is held."""

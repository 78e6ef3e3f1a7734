"""Host side of the bus: devices that are plugged in, and transfers with a timeout.

`Bus` is a host in the same process as the device; the other one is in `usbip_host`. Neither knows
anything of the data.
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
    """Connection to an open device."""

    def transfer(self, urb: Urb, timeout_s: float | None) -> None:
        """Make a transfer; cancel it after the timeout. None waits without a limit.

        Raises
        ------
        ConnectionError
            If the device is gone already.
        """

    def close(self) -> None:
        """Close it."""


@dataclass(frozen=True)
class PluggedDevice:
    """A device that is plugged in.

    Parameters
    ----------
    bus, number
        Bus and device number; the latter is another one each time it is plugged in.
    connect
        Opens a connection, or raises OSError.
    drivers
        Interfaces that a driver of the host's system holds.
    """

    bus: int
    number: int
    connect: Callable[[], Connection] = field(compare=False)
    drivers: set[int] = field(default_factory=set, compare=False)


class Host(Protocol):
    """A host into which devices are plugged."""

    def plugged(self) -> list[PluggedDevice]:
        """Return the devices that are plugged in."""


class Bus:
    """A host with one device on it, both in this process.

    Parameters
    ----------
    device
        The device. It is plugged in and given its configuration, as systems do.

    Attributes
    ----------
    device : UsbDevice
        The device. It advances in the threads that transfer.
    drivers : set of int
        Interfaces that a driver of the system holds.
    forbidden : bool
        True if the device may not be opened.
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
        """Unplug the device; pending transfers fail."""
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
        """Make a transfer with the device of a number; see `Connection.transfer`."""
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        device = self.device
        with self._changed:
            if number != device.number or not device.plugged:
                raise ConnectionError("it is not plugged in")
            device.submit(urb)
            self._changed.notify_all()  # it may have completed a transfer of another thread
            while urb.status is None:
                left = None if deadline is None else deadline - time.monotonic()
                if left is not None and left <= 0:
                    device.unlink(urb)
                    return
                waits = [wait for wait in (left, device.next_event_s()) if wait is not None]
                self._changed.wait(min(waits, default=None))
                device.advance()


class _OnBus:
    """Connection to a device on a `Bus`."""

    def __init__(self, bus: Bus, number: int) -> None:
        self._bus = bus
        self._number = number

    def transfer(self, urb: Urb, timeout_s: float | None) -> None:
        self._bus.transfer(self._number, urb, timeout_s)

    def close(self) -> None:
        """See `Connection.close`: nothing is held."""

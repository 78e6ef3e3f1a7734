"""Backend of pyusb, through which programs written for it use an emulated device unchanged.

It takes the place of the kernel and libusb: descriptors, claims, timeouts, and the errors of both
as on Linux. pyusb is imported for its exceptions alone.
"""

import errno
import os
import struct
from typing import Any, Final

from firmware_sim.usb import descriptors, device
from firmware_sim.usb.device import Request, Urb
from firmware_sim.usb.host import HIGH_SPEED, Connection, Host, PluggedDevice

# libusb's error codes.
_LIBUSB: Final = {
    errno.EIO: -1,
    errno.EACCES: -3,
    errno.ENODEV: -4,
    errno.ENOENT: -5,
    errno.EBUSY: -6,
    errno.ETIMEDOUT: -7,
    errno.EOVERFLOW: -8,
    errno.EPIPE: -9,
}
_FAILED: Final = {
    device.EPIPE: errno.EPIPE,
    device.EOVERFLOW: errno.EOVERFLOW,
    device.ESHUTDOWN: errno.EIO,
}
_CONTROL_S: Final = 1.0


class _SharedDevice:
    """A device that is plugged in, shared by all handles to it."""

    def __init__(self, plugged: PluggedDevice) -> None:
        self.plugged = plugged
        self.claims: dict[int, _Handle] = {}
        self._connection: Connection | None = None
        self._opened = 0
        self._descriptors: tuple[Any, Any] | None = None

    def open(self) -> None:
        if not self._opened:
            try:
                self._connection = self.plugged.connect()
            except OSError as error:
                raise _error(error.errno or errno.ENODEV) from error
        self._opened += 1

    def close(self) -> None:
        self._opened -= 1
        if not self._opened and self._connection:
            self._connection.close()
            self._connection = None

    def transfer(self, urb: Urb, timeout_s: float | None) -> int:
        assert self._connection is not None  # noqa: S101 - it is open
        try:
            self._connection.transfer(urb, timeout_s)
        except ConnectionError as error:
            raise _error(errno.ENODEV) from error
        if urb.status == device.ECONNRESET and not urb.actual:
            raise _error(errno.ETIMEDOUT)
        if urb.status in _FAILED:
            raise _error(_FAILED[urb.status])
        return urb.actual

    def control(
        self, kind: int, request: int, value: int = 0, index: int = 0, length: int = 0
    ) -> bytes:
        """Make a control transfer without data to the device; return the data from it."""
        setup = struct.pack("<BBHHH", kind, request, value, index, length)
        urb = Urb(0, length=length, setup=setup)
        self.transfer(urb, _CONTROL_S)
        return bytes(urb.received)

    @property
    def descriptors(self) -> tuple[Any, Any]:
        """Descriptors of the device and of its configuration, read once."""
        if self._descriptors is None:
            self.open()
            try:
                get = Request.GET_DESCRIPTOR
                raw = self.control(0x80, get, descriptors.DEVICE << 8, length=18)
                head = self.control(0x80, get, descriptors.CONFIGURATION << 8, length=9)
                total = int.from_bytes(head[2:4], "little")
                rest = self.control(0x80, get, descriptors.CONFIGURATION << 8, length=total)
                about = descriptors.read_device(raw)
                self._descriptors = about, descriptors.read_configuration(rest)
            except ValueError as error:
                raise _error(errno.EIO) from error
            finally:
                self.close()
            place = {"bus": self.plugged.bus, "address": self.plugged.number}
            ports = {"port_number": 1, "port_numbers": (1,), "speed": HIGH_SPEED}
            about.__dict__.update(place | ports)
        return self._descriptors


class _Handle:
    """An open device."""

    def __init__(self, node: _SharedDevice) -> None:
        self.node = node


class Backend:
    """Backend of pyusb: see ``usb.backend.IBackend`` for each method.

    Parameters
    ----------
    host
        The host whose devices are used.

    Attributes
    ----------
    host : Host
        The host.
    """

    def __init__(self, host: Host) -> None:
        self.host = host
        self._nodes: dict[PluggedDevice, _SharedDevice] = {}

    # Devices

    def enumerate_devices(self) -> list[_SharedDevice]:
        """Return the devices that are plugged in."""
        try:
            plugged = self.host.plugged()
        except OSError as error:
            raise _error(error.errno or errno.ENODEV) from error
        self._nodes = {each: self._nodes.get(each) or _SharedDevice(each) for each in plugged}
        return list(self._nodes.values())

    def get_parent(self, dev: _SharedDevice) -> None:
        """Return the hub of a device: there is none."""

    def get_device_descriptor(self, dev: _SharedDevice) -> Any:
        """Return the device descriptor."""
        return dev.descriptors[0]

    def get_configuration_descriptor(self, dev: _SharedDevice, config: int) -> Any:
        """Return a configuration; there is one."""
        return [dev.descriptors[1][0]][config]

    def get_interface_descriptor(self, dev: _SharedDevice, intf: int, alt: int, config: int) -> Any:
        """Return an interface; none has alternate settings."""
        self.get_configuration_descriptor(dev, config)
        return [dev.descriptors[1][1][intf][0]][alt]

    def get_endpoint_descriptor(
        self, dev: _SharedDevice, ep: int, intf: int, alt: int, config: int
    ) -> Any:
        """Return an endpoint of an interface."""
        self.get_interface_descriptor(dev, intf, alt, config)
        return dev.descriptors[1][1][intf][1][ep]

    # Handles

    def open_device(self, dev: _SharedDevice) -> _Handle:
        """Open a device; more than one may have it open."""
        dev.open()
        return _Handle(dev)

    def close_device(self, dev_handle: _Handle) -> None:
        """Close a device, and release its claims."""
        node = dev_handle.node
        node.claims = {n: owner for n, owner in node.claims.items() if owner is not dev_handle}
        node.close()

    def set_configuration(self, dev_handle: _Handle, config_value: int) -> None:
        """Set the configuration, which resets the endpoints; no interface may be claimed."""
        if dev_handle.node.claims or dev_handle.node.plugged.drivers:
            raise _error(errno.EBUSY)
        dev_handle.node.control(0x00, Request.SET_CONFIGURATION, config_value)

    def get_configuration(self, dev_handle: _Handle) -> int:
        """Return the value of the device's configuration."""
        return dev_handle.node.control(0x80, Request.GET_CONFIGURATION, length=1)[0]

    def set_interface_altsetting(self, dev_handle: _Handle, intf: int, altsetting: int) -> None:
        """Choose an alternate setting."""
        dev_handle.node.control(0x01, Request.SET_INTERFACE, altsetting, intf)

    def reset_device(self, dev_handle: _Handle) -> None:
        """Reset the device; it keeps its configuration."""
        self.set_configuration(dev_handle, 1)

    def claim_interface(self, dev_handle: _Handle, intf: int) -> None:
        """Claim an interface, unless another handle has claimed it."""
        node = dev_handle.node
        if intf not in {interface.bInterfaceNumber for interface, _ in node.descriptors[1][1]}:
            raise _error(errno.ENOENT)
        if intf in node.plugged.drivers or node.claims.get(intf, dev_handle) is not dev_handle:
            raise _error(errno.EBUSY)
        node.claims[intf] = dev_handle

    def release_interface(self, dev_handle: _Handle, intf: int) -> None:
        """Release an interface."""
        if dev_handle.node.claims.get(intf) is not dev_handle:
            raise _error(errno.ENOENT)
        del dev_handle.node.claims[intf]

    def is_kernel_driver_active(self, dev_handle: _Handle, intf: int) -> bool:
        """Return whether a driver of the system holds an interface."""
        return intf in dev_handle.node.plugged.drivers

    def detach_kernel_driver(self, dev_handle: _Handle, intf: int) -> None:
        """Detach the system's driver from an interface."""
        if intf not in dev_handle.node.plugged.drivers:
            raise _error(errno.ENOENT)
        dev_handle.node.plugged.drivers.remove(intf)

    def attach_kernel_driver(self, dev_handle: _Handle, intf: int) -> None:
        """Attach the system's driver to an interface, unless it is claimed."""
        if intf in dev_handle.node.claims:
            raise _error(errno.EBUSY)
        dev_handle.node.plugged.drivers.add(intf)

    def clear_halt(self, dev_handle: _Handle, ep: int) -> None:
        """End the stall of an endpoint."""
        dev_handle.node.control(0x02, Request.CLEAR_FEATURE, 0, ep)

    # Transfers: data and buffers are arrays of bytes; timeouts are in milliseconds, 0 means none

    def bulk_write(self, dev_handle: _Handle, ep: int, intf: int, data: Any, timeout: int) -> int:
        """Write to an endpoint; return the number of bytes that the device took."""
        del intf
        return dev_handle.node.transfer(Urb(ep, data.tobytes()), _seconds(timeout))

    def bulk_read(self, dev_handle: _Handle, ep: int, intf: int, buff: Any, timeout: int) -> int:
        """Read from an endpoint into a buffer; return the number of bytes."""
        del intf
        urb = Urb(ep, length=len(buff) * buff.itemsize)
        count = dev_handle.node.transfer(urb, _seconds(timeout))
        memoryview(buff).cast("B")[:count] = urb.received
        return count

    intr_write = iso_write = bulk_write  # the endpoint's descriptor decides
    intr_read = iso_read = bulk_read

    def ctrl_transfer(
        self,
        dev_handle: _Handle,
        bmRequestType: int,  # noqa: N803 - pyusb's names
        bRequest: int,  # noqa: N803
        wValue: int,  # noqa: N803
        wIndex: int,  # noqa: N803
        data: Any,
        timeout: int,
    ) -> int:
        """Make a control transfer; return the number of bytes that it moved."""
        size = len(data) * data.itemsize
        setup = struct.pack("<BBHHH", bmRequestType, bRequest, wValue, wIndex, size)
        if bmRequestType & descriptors.IN:
            urb = Urb(0, length=size, setup=setup)
        else:
            urb = Urb(0, data.tobytes(), setup=setup)
        count = dev_handle.node.transfer(urb, _seconds(timeout))
        memoryview(data).cast("B")[: len(urb.received)] = urb.received
        return count


def _seconds(timeout_ms: int) -> float | None:
    return timeout_ms / 1000 if timeout_ms else None


def _error(number: int) -> Exception:
    """Return pyusb's exception for an error number."""
    import usb.core  # noqa: PLC0415 - the caller has loaded it

    kind = usb.core.USBTimeoutError if number == errno.ETIMEDOUT else usb.core.USBError
    made: Exception = kind(os.strerror(number), _LIBUSB.get(number, -99), number)
    return made

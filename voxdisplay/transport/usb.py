"""``usb:``, ``usb:VID:PID``, ``usb:VID:PID:SERIAL``: byte pipe over USB bulk endpoints, by pyusb.

A display is recognised by the class of its interface (protocol.md, section 16.1), and its endpoints
by type and direction. Further kinds of port whose devices are on some USB come as entry points of
the group ``voxdisplay.usb``: callables that take the whole name and return a backend of pyusb.
Knows USB packets; knows no packet of the protocol.
"""

from __future__ import annotations

import contextlib
import errno
import os
import re
import time
from collections.abc import Iterator
from typing import Any

import usb.core
import usb.util

from voxdisplay.errors import OpenError, TransportClosed, TransportTimeout
from voxdisplay.printable_text import printable
from voxdisplay.transport.discovery import FoundPort
from voxdisplay.transport.library_errors import LIBRARY_ERRORS, message_of
from voxdisplay.transport.usb_access import busy_error, find_backend, permission_error
from voxdisplay.wire import spec

_READ_BYTES = 16384  # a multiple of every packet size there is, so that no packet is too long
_WRITE_BYTES = 65536
# Time for _READ_BYTES at full speed; the end of a transfer ends it sooner.
_CONTINUATION_TIMEOUT_S = 0.02
_MIN_TIMEOUT_S = 0.001  # libusb counts in milliseconds, and 0 means for ever
_MAX_CONSECUTIVE_ERRORS = 8  # stalls and packets that are too long
_MAX_LISTED = 10  # devices named in an error

_DISCONNECTED = (errno.EIO, errno.ENODEV, errno.ENOENT, errno.ESHUTDOWN)


class UsbTransport:
    """A pipe over the bulk endpoints of a display's interface.

    Parameters
    ----------
    port : str
        ``usb:``, ``usb:VID:PID`` or ``usb:VID:PID:SERIAL``, in hex; with a backend, any name.
    backend : object, optional
        A backend of pyusb; libusb if left out.

    Raises
    ------
    OpenError
        If there is no such device, or more than one, or it may not or cannot be used now.

    """

    def __init__(self, port: str, *, backend: Any = None) -> None:
        self.port = port
        wanted = _DeviceSelector("usb:" if backend is not None else port)
        self.backend = find_backend(port) if backend is None else backend
        self._closed = False
        self._owner_pid = os.getpid()
        self._consecutive_errors = 0
        self._claimed_interface: int | None = None
        self._detached_driver: int | None = None
        self._device = _select_device(port, wanted, self.backend)
        try:
            with _as_open_error(port, self._device):
                self._claim()
        except BaseException:
            self.close()
            raise

    def _claim(self) -> None:
        """Open the device and claim its interface, from a driver of the system if need be."""
        device = self._device
        configuration, interface = next(_display_interfaces(device))
        number = interface.bInterfaceNumber
        self._out, self._in = _endpoint(interface, "OUT"), _endpoint(interface, "IN")
        if _active_configuration(device) != configuration.bConfigurationValue:
            configuration.set()  # only then: it resets the device
        with contextlib.suppress(NotImplementedError):  # of systems without such drivers
            if device.is_kernel_driver_active(number):
                device.detach_kernel_driver(number)
                self._detached_driver = number
        usb.util.claim_interface(device, number)
        self._claimed_interface = number

    def read(self, timeout_s: float) -> bytes:
        """See `Transport.read`."""
        self._check_open()
        deadline_s = time.monotonic() + timeout_s
        packet_bytes = _packet_bytes(self._in)
        while True:
            # A transfer ends with a short packet, and a device need not send one. So the first
            # packet is waited for by itself, and the rest only as long as packets follow.
            data = self._transfer_in(packet_bytes, deadline_s - time.monotonic())
            if len(data) == packet_bytes:
                data += self._transfer_in(_READ_BYTES, _CONTINUATION_TIMEOUT_S)
            if data or time.monotonic() >= deadline_s:
                return data

    def _transfer_in(self, size: int, timeout_s: float) -> bytes:
        """Return the data of one transfer; none if none came, or an empty or a damaged packet."""
        try:
            data = bytes(self._in.read(size, _milliseconds(timeout_s)))
        except usb.core.USBTimeoutError:
            return b""
        except LIBRARY_ERRORS as error:
            self._recover(error, self._in)
            return b""
        self._consecutive_errors = 0
        return data

    def write(self, data: bytes, timeout_s: float) -> None:
        """See `Transport.write`."""
        self._check_open()
        deadline_s = time.monotonic() + timeout_s
        sent = 0
        while sent < len(data):
            piece = data[sent : sent + _WRITE_BYTES]
            sent += self._transfer_out(piece, deadline_s, f"only {sent} of {len(data)} bytes")
            if sent < len(data) and time.monotonic() > deadline_s:
                raise TransportTimeout(f"{self.port} took only {sent} of {len(data)} bytes in time")
        if data and len(data) % _packet_bytes(self._out) == 0:
            # The device may wait for the rest of a transfer: an empty packet ends it.
            self._transfer_out(b"", deadline_s, "no end of the transfer")

    def _transfer_out(self, data: bytes, deadline_s: float, so_far: str) -> int:
        """Do one transfer; return how many bytes the device took, which may be a part."""
        left_s = deadline_s - time.monotonic()
        try:
            sent = int(self._out.write(data, _milliseconds(left_s)))
        except usb.core.USBTimeoutError as error:
            raise TransportTimeout(
                f"{self.port} took {so_far}", hint="is its firmware still running?"
            ) from error
        except LIBRARY_ERRORS as error:
            self._recover(error, self._out)
            return 0
        self._consecutive_errors = 0
        return sent

    def _recover(self, error: Exception, endpoint: Any) -> None:
        """Clear a stalled endpoint, or drop a packet that was too long; raise on any other error.

        Data in transfer are lost or come twice: the protocol detects that, and retransmits.
        """
        self._consecutive_errors += 1
        number = _errno(error)
        if (
            number not in {errno.EPIPE, errno.EOVERFLOW}
            or self._consecutive_errors > _MAX_CONSECUTIVE_ERRORS
        ):
            raise self._closed_error(error) from error
        if number == errno.EPIPE:
            try:
                endpoint.clear_halt()
            except LIBRARY_ERRORS as worse:
                raise self._closed_error(worse) from worse

    def _closed_error(self, error: Exception) -> TransportClosed:
        if _errno(error) in _DISCONNECTED:
            return TransportClosed(f"{self.port} is gone: it was unplugged, or has restarted")
        return TransportClosed(f"{self.port} does not work any more: {message_of(error)}")

    def _check_open(self) -> None:
        """Raise if the port is closed: pyusb would open it again."""
        if self._closed:
            raise TransportClosed(f"{self.port} is closed")

    def close(self) -> None:
        """See `Transport.close`."""
        if self._closed:
            return
        self._closed = True
        if os.getpid() != self._owner_pid:  # the process that opened it may still use it
            return
        with contextlib.suppress(*LIBRARY_ERRORS):  # it may be gone
            if self._claimed_interface is not None:
                usb.util.release_interface(self._device, self._claimed_interface)
            if self._detached_driver is not None:
                self._device.attach_kernel_driver(self._detached_driver)
        _dispose(self._device)


def usb_ports() -> list[FoundPort]:
    """Return the displays on USB, sorted by name; none without libusb."""
    try:
        displays = _display_devices(find_backend("usb:"))
    except OpenError:
        return []
    except LIBRARY_ERRORS:
        return []
    ports = []
    for device in displays:
        product = _string_descriptor(device, "product")
        description = product or "a display"
        ports.append(FoundPort(_port_name(device), description, *_ids(device), product=product))
        _dispose(device)
    return sorted(ports, key=lambda port: port.port)


class _DeviceSelector:
    """Predicate on displays: vendor, product and serial number of a port's name."""

    def __init__(self, port: str) -> None:
        match = re.fullmatch(r"usb:(?:([0-9a-fA-F]{1,4}):([0-9a-fA-F]{1,4})(?::(.+))?)?", port)
        if not match:
            raise OpenError(
                f"{port} is not a USB port",
                port=port,
                hint="write usb:, usb:VID:PID or usb:VID:PID:SERIAL, like usb:1209:0001",
            )
        self._ids = (int(match[1], 16), int(match[2], 16)) if match[1] else None
        self._serial = match[3]

    def __call__(self, device: usb.core.Device) -> bool:
        """Return whether a display matches. It is opened if its serial number is asked for."""
        if self._ids and (device.idVendor, device.idProduct) != self._ids:
            return False
        if not self._serial:
            return True
        _active_configuration(device)  # opens it, or raises
        return _string_descriptor(device, "serial_number") == self._serial


def _select_device(port: str, wanted: _DeviceSelector, backend: Any) -> usb.core.Device:
    """Return the only display that matches; raise `OpenError` if there is none, or more."""
    with _as_open_error(port):
        displays = _display_devices(backend)
    chosen = []
    for device in displays:
        with _as_open_error(port, device):
            if wanted(device):
                chosen.append(device)
    named = ", ".join(_port_name(device) for device in (chosen or displays)[:_MAX_LISTED])
    for device in displays:
        if chosen != [device]:
            _dispose(device)
    if len(chosen) == 1:
        return chosen[0]
    if chosen:
        raise OpenError(
            f"{port}: there are {len(chosen)} displays", port=port, hint=f"choose one of {named}"
        )
    raise OpenError(
        f"{port}: there is no such display on USB",
        port=port,
        hint=f"there is {named}" if named else "is it plugged in, and switched on?",
    ) from FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT))  # it may be waited for


def _display_devices(backend: Any) -> list[usb.core.Device]:
    """Return the devices with an interface of the protocol's class."""
    displays = []
    for device in usb.core.find(find_all=True, backend=backend):
        # Some systems hide devices of their own; others are unplugged just now.
        with contextlib.suppress(*LIBRARY_ERRORS):
            if next(_display_interfaces(device), None):
                displays.append(device)
    return displays


def _display_interfaces(
    device: usb.core.Device,
) -> Iterator[tuple[usb.core.Configuration, usb.core.Interface]]:
    """Yield the interfaces of the protocol's class that have a bulk endpoint each way."""
    wanted = (spec.USB_CLASS, spec.USB_SUBCLASS, spec.USB_PROTOCOL, 0)
    for configuration in device:
        for interface in configuration:
            is_ours = wanted == (
                interface.bInterfaceClass,
                interface.bInterfaceSubClass,
                interface.bInterfaceProtocol,
                interface.bAlternateSetting,
            )
            if is_ours and _endpoint(interface, "OUT") and _endpoint(interface, "IN"):
                yield configuration, interface


def _endpoint(interface: usb.core.Interface, direction: str) -> Any:
    """Return the bulk endpoint of a direction; None if there is none."""
    bit = usb.util.ENDPOINT_IN if direction == "IN" else usb.util.ENDPOINT_OUT

    def matches(endpoint: usb.core.Endpoint) -> bool:
        kind = usb.util.endpoint_type(endpoint.bmAttributes)
        way = usb.util.endpoint_direction(endpoint.bEndpointAddress)
        is_bulk = (kind, way) == (usb.util.ENDPOINT_TYPE_BULK, bit)
        return is_bulk and _packet_bytes(endpoint) > 0

    return usb.util.find_descriptor(interface, custom_match=matches)


def _packet_bytes(endpoint: usb.core.Endpoint) -> int:
    return int(endpoint.wMaxPacketSize) & 0x7FF  # the bits above count packets, not bytes


def _active_configuration(device: usb.core.Device) -> int:
    """Return the value of the active configuration; 0 if there is none."""
    try:
        return int(device.get_active_configuration().bConfigurationValue)
    except usb.core.USBError as error:
        if error.errno is None:  # as pyusb reports it
            return 0
        raise


def _string_descriptor(device: usb.core.Device, name: str) -> str | None:
    """Return a text of the device, printable; None if it has none, or it cannot be read."""
    try:
        text = getattr(device, name)
        return text and printable(text)
    except LIBRARY_ERRORS:
        return None


def _ids(device: usb.core.Device) -> tuple[int, int, str | None]:
    return device.idVendor, device.idProduct, _string_descriptor(device, "serial_number")


def _port_name(device: usb.core.Device) -> str:
    vid, pid, serial = _ids(device)
    return f"usb:{vid:04x}:{pid:04x}" + (f":{serial}" if serial else "")


def _dispose(device: usb.core.Device) -> None:
    """Close a device."""
    with contextlib.suppress(*LIBRARY_ERRORS):  # it may be gone
        usb.util.dispose_resources(device)


def _errno(error: Exception) -> int | None:
    """Return the system's number of an error; None if it has none."""
    return error.errno if isinstance(error, OSError) else None


def _milliseconds(seconds: float) -> int:
    return max(1, round(max(seconds, _MIN_TIMEOUT_S) * 1000))


@contextlib.contextmanager
def _as_open_error(port: str, device: usb.core.Device | None = None) -> Iterator[None]:
    """Turn errors of USB on opening into an `OpenError` with the remedy."""
    try:
        yield
    except usb.core.USBError as error:
        if error.errno == errno.EACCES:
            raise permission_error(port) from error
        if error.errno == errno.EBUSY:
            raise busy_error(port, device) from error
        if error.errno in _DISCONNECTED:
            raise OpenError(
                f"{port} went away while it was opened", port=port, hint="is it plugged in well?"
            ) from error
        raise OpenError(f"{port} cannot be opened: {error}", port=port) from error
    except NotImplementedError as error:
        raise OpenError(
            f"{port} cannot be opened: {message_of(error)}",
            port=port,
            hint="on Windows, the display needs the driver WinUSB: https://zadig.akeo.ie has it",
        ) from error
    except LIBRARY_ERRORS as error:
        raise OpenError(f"{port} cannot be opened: {message_of(error)}", port=port) from error

"""USB carrier of the emulated device, packet by packet, in this process or behind USB/IP.

::

    function      the display as a USB function: endpoints, classes, packets
    descriptors   USB descriptors, and their parsing
    device        transfers, halts, control requests: USB 2.0
    host          a bus in this process             usbip         messages of USB/IP
    backend       pyusb backend for either host     usbip_server  the device for Linux kernels
                                                    usbip_host    a client, without a kernel

`open_in_process` and `open_usbip` open ports of the kinds ``sim-usb:`` and ``usbip:``: they return
backends of pyusb.
"""

import re
from typing import Any, Final

from firmware_sim.baud_pacing import with_baud
from firmware_sim.config import Config, parse_number
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.in_process import parse_url
from firmware_sim.usb.backend import Backend
from firmware_sim.usb.device import UsbDevice
from firmware_sim.usb.function import DisplayFunction
from firmware_sim.usb.host import Bus
from firmware_sim.usb.usbip_host import DEFAULT_PORT, UsbIpHost

_KEYS: Final[Any] = {"unplug": ("unplug_at", parse_number)}


def open_in_process(url: str) -> Backend:
    """Open a ``sim-usb:`` port: a new device on a bus of its own, in this process.

    Parameters
    ----------
    url
        ``sim-usb:``, or ``sim-usb:?KEY=VALUE&...`` with the keys of ``sim:`` and ``unplug``: the
        number of packets after which the device is unplugged.

    Returns
    -------
    Backend
        For pyusb. Its ``host`` is the `Bus`.

    Raises
    ------
    ValueError
        If a key is unknown or a value invalid; the message names it.
    """
    fields = parse_url(url, "sim-usb:", _KEYS)
    faults, seed = fields.pop("faults", ()), fields.pop("seed", 0)
    baud, unplug_at = fields.pop("baud", 0), fields.pop("unplug_at", None)
    wire = with_baud(DeviceOnLine(Device(Config(**fields)), faults, seed), baud)
    device = UsbDevice(DisplayFunction(wire))
    device.unplug_at = unplug_at
    return Backend(Bus(device))


def open_usbip(url: str) -> Backend:
    """Open a ``usbip:`` port: the device of a USB/IP server such as ``voxdisplay-sim --usbip``.

    Parameters
    ----------
    url
        ``usbip://HOST`` or ``usbip://HOST:PORT``; the port is 3240 if left out.

    Returns
    -------
    Backend
        For pyusb.

    Raises
    ------
    ValueError
        If the URL has another form.
    """
    match = re.fullmatch(
        r"usbip://(?:\[([0-9a-fA-F:]+)\]|([^\[\]:/?#@]+))(?::([0-9]{1,5}))?/?", url
    )
    if not match or not 0 < int(match[3] or DEFAULT_PORT) < 1 << 16:
        raise ValueError("write usbip://HOST:PORT like usbip://127.0.0.1:3240")
    return Backend(UsbIpHost(match[1] or match[2], int(match[3] or DEFAULT_PORT)))

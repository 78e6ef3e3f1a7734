"""Three hosts for a USB gadget: in this process, behind USB/IP, and in this machine's kernel.

Each has a backend of pyusb that sees it, and a control channel to it.
"""

import contextlib
import json
import os
import socket
import subprocess
import sys
import time
from pathlib import Path

import usb.core
import usb.util
from usb_gadget import GadgetDevice

from firmware_sim.usb import usbip
from firmware_sim.usb.backend import Backend
from firmware_sim.usb.host import Bus
from firmware_sim.usb.usbip_host import UsbIpHost

GADGET = Path(__file__).with_name("usb_gadget.py")
VHCI = Path("/sys/devices/platform/vhci_hcd.0")
# For what hangs; nothing is measured by it.
DEADLINE_S = 60 * int(os.environ.get("TEST_PATIENCE", "1"))


def until(condition, what):
    """Wait until a condition on another process or the kernel holds."""
    deadline_s = time.monotonic() + DEADLINE_S
    while not (got := condition()):
        assert time.monotonic() < deadline_s, f"waited for {what}"
        time.sleep(0.01)
    return got


class Lab:
    """A gadget, and a host that sees it."""

    backend = None

    def find(self):
        """Return a fresh handle of the gadget; None if it is not there."""
        return usb.core.find(idVendor=0x1209, idProduct=0x0001, backend=self.backend)

    def tell(self, command, *arguments):
        raise NotImplementedError

    def unplug(self):
        self.tell("unplug")
        until(lambda: self.find() is None, "the device to go")

    def plug(self):
        self.tell("plug")
        until(self.find, "the device to come")


class InProcess(Lab):
    def __init__(self):
        self.device = GadgetDevice()
        self.bus = Bus(self.device)
        self.backend = Backend(self.bus)

    def tell(self, command, *arguments):
        if command in {"plug", "unplug"}:
            return getattr(self.bus, command)()
        with self.bus._changed:
            self.bus._changed.notify_all()
            return self.device.do(command, *arguments)

    def close(self):
        pass


class OverUsbIp(Lab):
    def __init__(self):
        self.process = subprocess.Popen(
            [sys.executable, GADGET], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.address = tuple(json.loads(self.process.stdout.readline())["address"])
        self.backend = Backend(UsbIpHost(*self.address))

    def tell(self, command, *arguments):
        self.process.stdin.write(json.dumps([command, *arguments]) + "\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())

    def close(self):
        self.process.kill()
        self.process.communicate()


class InKernel(OverUsbIp):
    """The gadget behind USB/IP, attached by the kernel, and libusb on top."""

    def __init__(self):
        import libusb_package  # noqa: PLC0415 - Debian's own libusb sees nothing without udev

        super().__init__()
        self.backend = libusb_package.get_libusb1_backend()
        self.plug()

    def plug(self):
        self.tell("plug")
        self.port = attach(self.address)
        until(self.find, "the kernel to find the device")

    def unplug(self):
        self.tell("unplug")
        until(lambda: self.find() is None, "the kernel to let the device go")

    def close(self):
        super().close()
        until(lambda: self.find() is None, "the kernel to let the device go")


def in_kernel():
    """Return whether this machine's kernel can attach a device, and we may do it."""
    return (VHCI / "attach").exists()


def attach(address):
    """Attach a device to the kernel, which takes over the socket; return its port."""
    with socket.create_connection(address) as sock:
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        request = usbip.OPERATION.pack(usbip.VERSION, usbip.REQUEST_IMPORT, 0)
        sock.sendall(request + usbip.BUS_ID_FIELD.pack(usbip.BUS_ID.encode()))
        size = usbip.OPERATION.size + usbip.DEVICE.size
        reply = sock.recv(size, socket.MSG_WAITALL)
        assert usbip.OPERATION.unpack_from(reply)[2] == usbip.OK
        about = usbip.DEVICE.unpack_from(reply, usbip.OPERATION.size)
        bus, number, speed = about[2:5]
        port = free_port()
        (VHCI / "attach").write_text(f"{port} {sock.fileno()} {bus << 16 | number} {speed}")
    return port


def free_port():
    """Return a free high-speed port of the kernel's virtual hub."""
    for line in (VHCI / "status").read_text().splitlines():
        hub, port, state, *_ = line.split()
        if hub == "hs" and state == "004":
            return int(port)
    raise AssertionError("no free port on vhci_hcd")


@contextlib.contextmanager
def lab(depth):
    """Run a gadget at a depth."""
    made = {"in process": InProcess, "usbip": OverUsbIp, "kernel": InKernel}[depth]()
    try:
        yield made
    finally:
        made.close()

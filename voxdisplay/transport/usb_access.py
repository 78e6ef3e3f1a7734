"""Access to USB devices: libusb, permission, and other programs that hold a device."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path
from typing import Any

import usb.backend.libusb1
import usb.util

from voxdisplay.errors import OpenError
from voxdisplay.transport import diagnosis
from voxdisplay.transport.library_errors import LIBRARY_ERRORS
from voxdisplay.wire import spec

# Grants the user at the machine access to any device with an interface of the protocol's class.
UDEV_RULE = (
    'SUBSYSTEM=="usb", ENV{ID_USB_INTERFACES}=="*:'
    f'{spec.USB_CLASS:02x}{spec.USB_SUBCLASS:02x}{spec.USB_PROTOCOL:02x}:*", TAG+="uaccess"'
)
_UDEV_FILE = "/etc/udev/rules.d/70-voxdisplay.rules"
_NODES = Path("/dev/bus/usb")


def find_backend(port: str) -> Any:
    """Return libusb: the one that the package ``libusb-package`` brings, or else the system's.

    Parameters
    ----------
    port : str
        For the error.

    Returns
    -------
    object
        A backend of pyusb.

    Raises
    ------
    OpenError
        If there is none.

    """
    backend = None
    with contextlib.suppress(*LIBRARY_ERRORS):  # it need not be there, nor fit this machine
        import libusb_package  # noqa: PLC0415

        backend = libusb_package.get_libusb1_backend()
    if backend is None:
        with contextlib.suppress(*LIBRARY_ERRORS):
            backend = usb.backend.libusb1.get_backend()
    if backend is None:
        hint = "install it: pip install 'voxdisplay[usb]', or apt install libusb-1.0-0"
        if sys.platform.startswith("linux") and not _NODES.exists():  # some do not start then
            hint += f"\n  without {_NODES}, as in a container, only some versions start: pass it on"
        raise OpenError(f"{port}: there is no libusb that works here", port=port, hint=hint)
    return backend


def permission_error(port: str) -> OpenError:
    """Return the error for a device that may not be opened, with the remedy."""
    hint = (
        f"allow it, and plug the display in again:\n  echo '{UDEV_RULE}' | sudo tee {_UDEV_FILE}\n"
        "  sudo udevadm control --reload"
    )
    if not sys.platform.startswith("linux"):
        hint = "ask whoever runs this machine"
    return OpenError(f"{port} may not be opened", port=port, hint=hint)


def busy_error(port: str, device: Any) -> OpenError:
    """Return the error for a device that another program uses, with its name where it is known."""
    if device is not None:
        with contextlib.suppress(*LIBRARY_ERRORS):
            # Or else we would be one of those who have it open.
            usb.util.dispose_resources(device)
        node = _NODES / f"{device.bus or 0:03d}" / f"{device.address or 0:03d}"
        if node.exists():
            return diagnosis.busy_error(port, str(node))
    return OpenError(
        f"{port} is busy", port=port, hint="another program has it open: end it, or close it there"
    )

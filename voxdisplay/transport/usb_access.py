"""What stands between a program and a USB device: libusb, permission, and other programs."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import Any

from voxdisplay.errors import OpenError
from voxdisplay.wire import spec

# Lets who sits at the machine use any device with an interface of the protocol's class.
UDEV_RULE = (
    'SUBSYSTEM=="usb", ENV{ID_USB_INTERFACES}=="*:'
    f'{spec.USB_CLASS:02x}{spec.USB_SUBCLASS:02x}{spec.USB_PROTOCOL:02x}:*", TAG+="uaccess"'
)
_UDEV_FILE = "/etc/udev/rules.d/70-voxdisplay.rules"
_PROC = Path("/proc")
_MOST_HOLDERS = 5


def find_backend(port: str) -> Any:
    """Find libusb: the one that the package ``libusb-package`` brings, or else the system's.

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
    import usb.backend.libusb1  # noqa: PLC0415 - loads libusb

    try:
        import libusb_package  # noqa: PLC0415 - need not be there
    except ImportError:
        backend = usb.backend.libusb1.get_backend()
    else:
        backend = libusb_package.get_libusb1_backend() or usb.backend.libusb1.get_backend()
    if backend is None:
        raise OpenError(
            f"{port}: there is no libusb on this machine",
            port=port,
            hint="install it: pip install 'voxdisplay[usb]'",
        )
    return backend


def forbidden(port: str) -> OpenError:
    """Give the error for a device that may not be opened, with the way to be allowed."""
    hint = (
        f"allow it, and plug the display in again:\n  echo '{UDEV_RULE}' | sudo tee {_UDEV_FILE}\n"
        "  sudo udevadm control --reload"
    )
    if not sys.platform.startswith("linux"):
        hint = "ask whoever runs this machine"
    return OpenError(f"{port} may not be opened", port=port, hint=hint)


def busy(port: str, device: Any) -> OpenError:
    """Give the error for a device that another program uses, with its name if it can be known."""
    names = holders(_PROC, device.bus, device.address) if device is not None else []
    return OpenError(
        f"{port} is busy: {', '.join(names) or 'something else'} has it open",
        port=port,
        hint="end that program, or close the display there",
    )


def holders(proc: Path, bus: int | None, address: int | None) -> list[str]:
    """Name the other processes that have a USB device open, as far as the system lets us see.

    Parameters
    ----------
    proc : Path
        The folder of processes: ``/proc``.
    bus, address : int or None
        Place of the device.

    """
    node = f"/dev/bus/usb/{bus or 0:03d}/{address or 0:03d}"
    names = []
    for process in sorted(proc.glob("[0-9]*")):
        if process.name == str(os.getpid()):
            continue
        try:
            held = any(str(fd.readlink()) == node for fd in (process / "fd").iterdir())
            if held:
                name = re.sub(r"[^ -~]", "?", (process / "comm").read_text("utf-8").strip())
                names.append(f"{name} (process {process.name})")
        except OSError:  # it has ended, or is none of ours
            continue
    return names[:_MOST_HOLDERS]

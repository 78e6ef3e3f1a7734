"""Table of what pyserial, pyusb, other packages' pipes and the system raise on a port.

None of these libraries documents it in full, and a device that goes away in mid-call makes more of
them: a handle that is None, a descriptor that ends early, a number that is no number. Every call
into them is made under `LIBRARY_ERRORS`, so that a caller sees a `TransportError` and nothing else.
Knows no port.
"""

from __future__ import annotations

import ctypes
import re
import struct
import sys
from typing import Final

_SYSTEM: tuple[type[Exception], ...] = ()
if sys.platform != "win32":
    import termios

    _SYSTEM = (termios.error,)  # not an OSError

LIBRARY_ERRORS: Final[tuple[type[Exception], ...]] = (
    # System calls and sockets; serial.SerialException and usb.core.USBError are OSErrors, too.
    OSError,
    # An unknown URL or option, a host name that cannot be encoded, no libusb, a USB device without
    # language ids, a rejected option of RFC 2217, a closed descriptor.
    ValueError,
    # A handle that another thread or an unplugged device has made None; sysfs without a number.
    TypeError,
    AttributeError,
    # A descriptor that ends early, an option of a URL that has no such value.
    LookupError,
    # A rate or a count for which C has no number.
    ArithmeticError,
    # NotImplementedError of a system; a thread that cannot start.
    RuntimeError,
    struct.error,
    ctypes.ArgumentError,
    # hwgrep:// takes a regular expression.
    re.error,
    # A backend whose library is damaged or missing.
    ImportError,
    EOFError,
    # libusb 0.1, of a device that does not answer which configuration is active.
    AssertionError,
    *_SYSTEM,
)


def message_of(error: BaseException) -> str:
    """Return what an error says, or at least its kind."""
    return str(error) or type(error).__name__

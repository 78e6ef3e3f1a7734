"""The latency timer of FTDI's USB-serial chips: 16 ms of waiting in each answer, unless it is set.

The chip keeps back what it has received until a USB packet is full or the timer runs out. Linux
shows the timer in sysfs, and lets its owner set it; where it cannot be set, nothing is lost but
time. Knows no pipe.
"""

from __future__ import annotations

from pathlib import Path

_LEAST_MS = 1
_SYSFS = Path("/sys")


def lower_latency(device: str, *, sysfs: Path = _SYSFS) -> bool:
    """Set the latency timer of a serial device to its least, if it has one that may be set.

    Parameters
    ----------
    device : str
        Such as ``/dev/ttyUSB0``, or a link to it.
    sysfs : Path
        Where sysfs is mounted.

    Returns
    -------
    bool
        Whether the timer is at its least now.

    """
    try:
        name = Path(device).resolve().name
        timer = sysfs / "bus" / "usb-serial" / "devices" / name / "latency_timer"
        if int(timer.read_text()) > _LEAST_MS:
            timer.write_text(f"{_LEAST_MS}\n")
    except (OSError, ValueError):
        return False
    return True

"""Latency timer of FTDI's USB-serial chips: up to 16 ms of delay in each answer by default.

The chip holds back what it has received until a USB packet is full or the timer runs out. Linux
shows the timer in sysfs, and lets its owner set it; where it cannot be set, nothing is lost but
time. Knows no pipe.
"""

from __future__ import annotations

from pathlib import Path

_MIN_MS = 1
_SYSFS = Path("/sys")


def lower_latency(device: str, *, sysfs: Path = _SYSFS) -> bool:
    """Set the latency timer of a serial device to its minimum, if it has one that may be set.

    Parameters
    ----------
    device : str
        Such as ``/dev/ttyUSB0``, or a link to it.
    sysfs : Path
        Mount point of sysfs.

    Returns
    -------
    bool
        True if the timer is at its minimum now.

    """
    try:
        name = Path(device).resolve().name
        timer = sysfs / "bus" / "usb-serial" / "devices" / name / "latency_timer"
        if int(timer.read_text()) > _MIN_MS:
            timer.write_text(f"{_MIN_MS}\n")
    except (OSError, ValueError, RuntimeError):  # RuntimeError: a loop of links
        return False
    return True

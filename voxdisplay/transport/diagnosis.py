"""Causes of a port that does not open, and their remedies.

Asks the system which ports there are, who holds this one, and who owns it. Of pyserial it knows
only the shape and the wording of its errors. Knows no packet.
"""

from __future__ import annotations

import contextlib
import errno
import os
import socket
import stat
import sys
from collections.abc import Iterator
from pathlib import Path

from voxdisplay.errors import OpenError
from voxdisplay.printable_text import printable
from voxdisplay.transport.discovery import serial_ports
from voxdisplay.transport.library_errors import message_of

_PROC = Path("/proc")
_MAX_LISTED = 8

# What pyserial says of a server of RFC 2217 that is there, and what to do about it.
_OF_SERVER = (
    (
        ("does not seem to support RFC2217", "remote rejected value for option 'we-"),
        "what listens there does not speak RFC 2217; does it pass bytes on? Then try tcp://",
    ),
    (
        ("does not accept parameter change", "remote rejected value for option"),
        "the server did not confirm the line's rate or format; does it pass bytes on? Then try tcp://",
    ),
    (
        ("server has closed the connection", "reader thread died"),
        "the server is there, and hung up: is its port busy, or not plugged in?",
    ),
)


def as_open_error(port: str, error: BaseException) -> OpenError:
    """Return the error for a serial port that did not open, with cause and remedy.

    Parameters
    ----------
    port : str
        As the user named it.
    error : BaseException
        What was raised.

    """
    if "://" in port and not port.lower().startswith(("spy:", "alt:")):
        return _url_error(port, error)
    number = _errno(error)
    path = _device_path(port)
    for cause in _causes(error):
        file = getattr(cause, "filename", None)
        if "://" in port and isinstance(file, str) and file != path:  # the one that spy:// writes
            reason = getattr(cause, "strerror", cause)
            return OpenError(
                f"{port} cannot be opened: {file} cannot be written: {reason}",
                port=port,
                hint="take another path behind file=",
            )
    if number in {errno.EACCES, errno.EPERM}:
        return _permission_error(port, path)
    if number in {errno.EBUSY, errno.EAGAIN} or "PermissionError" in str(error):
        # Windows says of a port that is open elsewhere that access is denied.
        return busy_error(port, path)
    if number == errno.ENOENT or "FileNotFoundError" in str(error):
        return OpenError(f"{port} does not exist", port=port, hint=_available_ports())
    if number in {errno.EIO, errno.ENXIO, errno.ENODEV}:
        return OpenError(
            f"{port} has no device behind it: {os.strerror(number)}",
            port=port,
            hint=f"it was pulled out, or never there; {_available_ports()}",
        )
    if number in {errno.ENOTTY, errno.EISDIR}:
        return OpenError(f"{port} is no serial port", port=port, hint=_available_ports())
    if number in {errno.ELOOP, errno.ENOTDIR, errno.ENAMETOOLONG}:
        return OpenError(
            f"{port} names nothing: {os.strerror(number)}", port=port, hint=_available_ports()
        )
    return OpenError(f"{port} cannot be opened: {message_of(error)}", port=port)


def _url_error(port: str, error: BaseException) -> OpenError:
    """Return the error for a URL of pyserial: with a hint only where the cause is known."""
    text = message_of(error)
    if "no ports found matching" in text:  # hwgrep://
        return OpenError(f"{port} matches no port", port=port, hint=_available_ports())
    hint = next((hint for parts, hint in _OF_SERVER if any(part in text for part in parts)), None)
    return OpenError(
        f"{port} cannot be opened: {text}", port=port, hint=hint or network_hint(error)
    )


def network_hint(error: BaseException) -> str | None:
    """Return what to do about a connection that failed; None where the cause is not known."""
    for cause in _causes(error):
        match cause:
            case socket.gaierror():
                return "is the name of the host right?"
            case ConnectionRefusedError() | ConnectionResetError():
                return "is the device, or the server for it, running there?"
            case TimeoutError():
                return "is the host on, and does a firewall let this port through?"
            case OSError(errno=errno.EHOSTUNREACH):
                return "is the host on, and in a network that is reachable from here?"
            case OSError(errno=errno.ENETUNREACH):
                return "is this machine in a network from which the host is reachable?"
    return None


def _causes(error: BaseException) -> Iterator[BaseException]:
    """Yield an error and those that it was raised from, the newest first."""
    cause: BaseException | None = error
    while cause is not None:
        yield cause
        cause = cause.__cause__ or cause.__context__


def _errno(error: BaseException) -> int | None:
    """Return the system's number of an error, or of one that it was raised from."""
    for cause in _causes(error):
        for number in (getattr(cause, "errno", None), *cause.args[:1]):
            if isinstance(number, int):
                return number
    return None


def _device_path(port: str) -> str:
    """Return the device of a port's name: spy:///dev/ttyUSB0?file=x has one, too."""
    return port.partition("://")[2].partition("?")[0] if "://" in port else port


def _available_ports() -> str:
    found = [found.port for found in serial_ports()]
    more = f" and {len(found) - _MAX_LISTED} more" if len(found) > _MAX_LISTED else ""
    known = "there is " + ", ".join(found[:_MAX_LISTED]) if found else "no serial port was found"
    return f"{known}{more}; sim: is the built-in emulator"


# -- busy


def busy_error(port: str, path: str) -> OpenError:
    """Return the error for a port that a process has open, at a path of the system."""
    names = [f"{_process_name(pid)} (process {pid})" for pid in _holding_processes(path)]
    if not names:
        hint = "another program has it open"
        if sys.platform != "win32" and Path(path).exists():
            hint += f"; this shows which: sudo fuser -v {path}"
        return OpenError(f"{port} is busy", port=port, hint=hint)
    return OpenError(
        f"{port} is busy: {', '.join(names)} has it open",
        port=port,
        hint="end that program, or close the port there",
    )


def _holding_processes(path: str) -> list[int]:
    """Return the processes that have a device open; of these, those that locked it, if any."""
    try:
        device = os.stat(path)  # noqa: PTH116 - a port's name need not be a path
    except (OSError, ValueError):
        return []
    openers = sorted(set(_processes_with_open(device.st_rdev)))
    locked = set(_processes_with_lock(device.st_ino))
    return [pid for pid in openers if pid in locked] or openers


def _processes_with_open(device: int) -> Iterator[int]:
    with contextlib.suppress(OSError):
        for descriptor in _PROC.glob("[0-9]*/fd/*"):
            try:
                status = descriptor.stat()
            except OSError:  # closed meanwhile, or not for us to see
                continue
            if stat.S_ISCHR(status.st_mode) and status.st_rdev == device:
                yield int(descriptor.parts[-3])


def _processes_with_lock(inode: int) -> Iterator[int]:
    """Read /proc/locks: `1: FLOCK  ADVISORY  WRITE 8280 00:1a:3 0 EOF`."""
    try:
        lines = (_PROC / "locks").read_text(encoding="ascii", errors="replace").splitlines()
    except OSError:
        return
    for line in lines:
        match line.split():
            case [_, "FLOCK", _, _, pid, place, *_] if place.endswith(f":{inode}"):
                yield int(pid)


def _process_name(pid: int) -> str:
    if pid == os.getpid():
        return "this program itself"
    try:
        name = (_PROC / str(pid) / "comm").read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return "a program"
    return printable(name) or "a program"


# -- no permission


def _permission_error(port: str, path: str) -> OpenError:
    try:
        status = os.stat(path)  # noqa: PTH116 - a port's name need not be a path
    except OSError:
        return OpenError(f"{port} may not be opened", port=port, hint="look at its permissions")
    import grp  # noqa: PLC0415 - not on every system
    import pwd  # noqa: PLC0415

    def name(of: object, number: int) -> str:
        try:
            entry = pwd.getpwuid(number) if of is pwd else grp.getgrgid(number)
        except KeyError:
            return str(number)
        return entry[0]

    user, owner, group = name(pwd, os.geteuid()), name(pwd, status.st_uid), name(grp, status.st_gid)
    message = (
        f"{port} may not be opened by {user}: it is {owner}'s and the group {group}'s, "
        f"{stat.filemode(status.st_mode)}"
    )
    both = stat.S_IRGRP | stat.S_IWGRP
    if status.st_mode & both != both or status.st_gid == 0:
        # Nobody should join root's group for a port, nor would it help where the group may not.
        return OpenError(message, port=port, hint=f"allow it: sudo chmod a+rw {path}")
    try:
        joined = user in grp.getgrgid(status.st_gid).gr_mem
    except KeyError:
        joined = False
    if joined and status.st_gid not in os.getgroups():
        hint = f"{user} is in {group} since the last login: log in again, or: newgrp {group}"
    else:
        hint = f"join its group: sudo usermod -aG {group} $USER  (then log in again)"
    return OpenError(message, port=port, hint=hint)

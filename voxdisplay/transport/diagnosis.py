"""Why a port does not open, and what a person can do about it.

Asks the system: which ports there are, who holds this one, whose it is. Knows nothing of pyserial
but the shape of its errors, and no packet.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from pathlib import Path

from voxdisplay.errors import OpenError
from voxdisplay.transport.discovery import serial_ports

_PROC = Path("/proc")
_MAX_LISTED = 8


def message_of(error: BaseException) -> str:
    """Give what an error says, or at least its kind."""
    return str(error) or type(error).__name__


def as_open_error(port: str, error: BaseException) -> OpenError:
    """Turn what was said when a serial port was opened into what a person can do.

    Parameters
    ----------
    port : str
        As it was named.
    error : BaseException
        What was raised.

    """
    number = _errno(error)
    path = _device_path(port)
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
    hint = "is the device, or the server for it, running there?" if "://" in port else None
    return OpenError(f"{port} cannot be opened: {message_of(error)}", port=port, hint=hint)


def _errno(error: BaseException) -> int | None:
    """Find the system's number in an error, or in one that it was made of."""
    cause: BaseException | None = error
    while cause is not None:
        numbers = (getattr(cause, "errno", None), *cause.args[:1])
        for number in numbers:
            if isinstance(number, int):
                return number
        cause = cause.__cause__ or cause.__context__
    return None


def _device_path(port: str) -> str:
    """Give the device behind a port's name: spy:///dev/ttyUSB0?file=x is one, too."""
    return port.partition("://")[2].partition("?")[0] if "://" in port else port


def _available_ports() -> str:
    found = [found.port for found in serial_ports()]
    more = f" and {len(found) - _MAX_LISTED} more" if len(found) > _MAX_LISTED else ""
    known = "there is " + ", ".join(found[:_MAX_LISTED]) if found else "no serial port was found"
    return f"{known}{more}; sim: is the built-in emulator"


# -- somebody else has it


def busy_error(port: str, path: str) -> OpenError:
    """Give the error for a port that somebody else has open, at a path of the system."""
    names = [f"{_process_name(pid)} (process {pid})" for pid in _holding_processes(path)]
    if not names:
        return OpenError(
            f"{port} is busy",
            port=port,
            hint=f"another program has it open; this shows which: sudo fuser -v {path}",
        )
    return OpenError(
        f"{port} is busy: {', '.join(names)} has it open",
        port=port,
        hint="end that program, or let go of the port there",
    )


def _holding_processes(path: str) -> list[int]:
    """Find the processes that have a device open; of these, those that have locked it, if any."""
    try:
        device = os.stat(path)  # noqa: PTH116 - a port's name need not be a path
    except OSError:
        return []
    openers = sorted(set(_processes_with_open(device.st_rdev)))
    locked = set(_processes_with_lock(device.st_ino))
    return [pid for pid in openers if pid in locked] or openers


def _processes_with_open(device: int) -> Iterator[int]:
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
        lines = (_PROC / "locks").read_text(encoding="ascii").splitlines()
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
    return "".join(c if c.isprintable() else "?" for c in name) or "a program"


# -- it is not for us


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
        return OpenError(message, port=port, hint=f"let yourself: sudo chmod a+rw {path}")
    try:
        joined = user in grp.getgrgid(status.st_gid).gr_mem
    except KeyError:
        joined = False
    if joined and status.st_gid not in os.getgroups():
        hint = f"{user} is in {group} since the last login: log in again, or: newgrp {group}"
    else:
        hint = f"join its group: sudo usermod -aG {group} $USER  (then log in again)"
    return OpenError(message, port=port, hint=hint)

"""The pumps: a device behind a pseudo-terminal, a TCP port, or in the host's process (16).

They move bytes and let time pass; they know nothing of packets. A pump sleeps until a byte comes,
until one can go or has gone its way, or until a tick swaps; and it takes nothing from a host that
does not read.
"""

import contextlib
import ipaddress
import os
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from firmware_sim.baud_pacing import PacedDevice
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.in_process import InProcessPort, open_in_process
from firmware_sim.readiness import wait_ready

__all__ = [
    "InProcessPort",
    "listen_tcp",
    "open_in_process",
    "open_pty",
    "require_loopback",
    "serve_tcp",
    "serve_wire",
    "symbolic_link",
]

_UNREAD_POLL_S: Final = 0.02  # seconds between looks at a host that does not read
_READ_BYTES: Final = 4096  # bytes to read at a time
_MAX_UNREAD_BYTES: Final = (
    65_536  # with so many bytes that the host has not read, none are taken from it
)


def serve_wire(wire: DeviceOnLine | PacedDevice, line: int, stop: int) -> bool:
    """Run a device on a line until the line ends or something tells it to stop.

    Parameters
    ----------
    wire
        The device.
    line
        File descriptor of the line, not blocking.
    stop
        File descriptor that becomes readable when it is time to stop.

    Returns
    -------
    bool
        Whether it was told to stop; else the line has ended, at either end.
    """
    out = bytearray()
    while True:
        try:
            readers = [stop]
            if len(out) < _MAX_UNREAD_BYTES:
                if wire.accepts_data():
                    readers.append(line)
                out += wire.transmit()  # last: a tick may have come with each call before
            writers = [line] if out else []
            readable, writable = wait_ready(readers, writers, _pause(wire, out))
            if stop in readable:
                return True
            if writable:
                del out[: os.write(line, out)]
            if line in readable:
                data = os.read(line, _READ_BYTES)
                if not data:
                    return False
                wire.receive(data)
        except BlockingIOError:
            continue  # the other side was faster
        except OSError:
            return False


def _pause(wire: DeviceOnLine | PacedDevice, out: bytearray) -> float | None:
    """Return how long to sleep; what is due for a host that does not read stays due."""
    pause = wire.next_event_s()
    return pause if pause is None or len(out) < _MAX_UNREAD_BYTES else max(pause, _UNREAD_POLL_S)


@contextlib.contextmanager
def open_pty() -> Iterator[tuple[int, str]]:
    """Open a pseudo-terminal, raw from the beginning.

    Yields
    ------
    line : int
        File descriptor of the device's side, not blocking.
    name : str
        Path of the host's side. It stays open here too, so that hosts may come and go.
    """
    import tty  # noqa: PLC0415 - not on Windows, where sim: ports work all the same

    line, host = os.openpty()
    try:
        tty.setraw(host)
        os.set_blocking(line, False)
        yield line, os.ttyname(host)
    finally:
        os.close(line)
        os.close(host)


@contextlib.contextmanager
def symbolic_link(link: Path, target: str) -> Iterator[None]:
    """Keep a symbolic link; put it there at once, and remove it in the end if it is still ours.

    Parameters
    ----------
    link
        Path of the link. An older link there is replaced.
    target
        What it points to.

    Raises
    ------
    FileExistsError
        If something stands there that is no link.
    """
    if link.exists() and not link.is_symlink():
        raise FileExistsError(f"{link} is there and no link: remove it or take another path")
    beside = link.with_name(f".{link.name}.{os.getpid()}.tmp")
    beside.symlink_to(target)
    beside.replace(link)
    try:
        yield
    finally:
        if link.is_symlink() and str(link.readlink()) == target:
            link.unlink()


def listen_tcp(host: str, port: int, *, remote: bool = False) -> socket.socket:
    """Listen for TCP connections.

    Parameters
    ----------
    host, port
        Address; port 0 is any that is free.
    remote
        Whether other machines may reach it.

    Raises
    ------
    PermissionError
        If other machines could reach it and must not.
    OSError
        If there is no such address, or it is taken.
    """
    require_loopback(host, "draw", remote=remote)
    family, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    return socket.create_server(address[:2], family=family, backlog=1)


def require_loopback(host: str, what: str = "look on", *, remote: bool) -> None:
    """Refuse to listen where other machines could come, unless they may.

    Parameters
    ----------
    host
        Name or number of the address.
    what
        What who comes could do.
    remote
        Whether other machines may reach it.

    Raises
    ------
    PermissionError
        If they could and must not.
    OSError
        If there is no such address.
    """
    *_, address = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0]
    if not (remote or ipaddress.ip_address(address[0]).is_loopback):
        raise PermissionError(
            f"anyone who reaches {host} could {what}: listen on 127.0.0.1, or add --allow-remote"
        )


def serve_tcp(wire: DeviceOnLine | PacedDevice, listener: socket.socket, stop: int) -> None:
    """Run a device for one connection after the other until something tells it to stop.

    Parameters
    ----------
    wire
        The device. Its session ends with each connection.
    listener
        From `listen`.
    stop
        File descriptor that becomes readable when it is time to stop.
    """
    stopped = False
    while not stopped:
        readable, _ = wait_ready([listener.fileno(), stop])
        if stop in readable:
            return
        connection, _ = listener.accept()
        with connection:
            connection.setblocking(False)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            stopped = serve_wire(wire, connection.fileno(), stop)
        wire.disconnect()

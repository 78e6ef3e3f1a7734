"""Event loops that serve a device on a pseudo-terminal or a TCP port (16).

They move bytes and advance the device's time; they know nothing of packets. A loop sleeps until
bytes can be read or written or until a swap is due, and takes no bytes from a host that does not
read the responses.
"""

import contextlib
import errno
import os
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from firmware_sim.baud_pacing import PacedDevice
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.in_process import InProcessPort, open_in_process
from firmware_sim.quoting import excerpt
from firmware_sim.readiness import Waitable, wait_ready

__all__ = [
    "InProcessPort",
    "accept",
    "listen_tcp",
    "open_in_process",
    "open_pty",
    "require_loopback",
    "serve_tcp",
    "serve_wire",
    "symbolic_link",
]

_UNREAD_POLL_S: Final = 0.02  # between polls of a host that does not read
_READ_BYTES: Final = 4096  # at a time
_MAX_UNREAD_BYTES: Final = 65_536  # of output; with more pending, no input is taken
_ACCEPT_RETRY_S: Final = 0.1  # while the system is out of file descriptors or memory


def serve_wire(wire: DeviceOnLine | PacedDevice, line: int, stop: int) -> bool:
    """Run a device on a line until the line ends or ``stop`` becomes readable.

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
        True if it was told to stop; False if the line has ended, at either end.
    """
    out = bytearray()
    while True:
        try:
            readers = [stop]
            if len(out) < _MAX_UNREAD_BYTES:
                if wire.accepts_data():
                    readers.append(line)
                out += wire.transmit()  # after accepts_data, in which a tick may have passed
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
            continue  # the other side has read or closed meanwhile
        except OSError:
            return False


def _pause(wire: DeviceOnLine | PacedDevice, out: bytearray) -> float | None:
    """Return how long to sleep: what is due for a host that does not read stays due."""
    pause = wire.next_event_s()
    return pause if pause is None or len(out) < _MAX_UNREAD_BYTES else max(pause, _UNREAD_POLL_S)


@contextlib.contextmanager
def open_pty() -> Iterator[tuple[int, str]]:
    """Open a pseudo-terminal in raw mode.

    Yields
    ------
    line : int
        File descriptor of the device's side, not blocking.
    name : str
        Path of the host's side. It stays open here too, so that hosts may come and go.

    Raises
    ------
    OSError
        If the system has no pseudo-terminals, or none left.
    """
    if not hasattr(os, "openpty"):
        raise OSError("this system has no pseudo-terminals: use --tcp 127.0.0.1:0")
    import tty  # noqa: PLC0415 - not on Windows, where sim: ports work all the same

    try:
        line, host = os.openpty()
    except OSError as error:
        raise OSError(
            f"no pseudo-terminal: {error.strerror}; use --tcp 127.0.0.1:0, or end programs that "
            "have some open"
        ) from error
    try:
        tty.setraw(host)
        os.set_blocking(line, False)
        yield line, os.ttyname(host)
    finally:
        os.close(line)
        os.close(host)


@contextlib.contextmanager
def symbolic_link(link: Path, target: str) -> Iterator[None]:
    """Create a symbolic link atomically, and remove it at the end if it is still the same.

    Parameters
    ----------
    link
        Path of the link. An older link there is replaced.
    target
        Where it points to.

    Raises
    ------
    FileExistsError
        If the path exists and is not a link.
    OSError
        If the link cannot be created.
    """
    if link.exists() and not link.is_symlink():
        raise FileExistsError(f"{link} exists and is no link: remove it or take another path")
    beside = link.with_name(f".{link.name}.{os.urandom(6).hex()}.tmp")
    try:
        beside.symlink_to(target)
        beside.replace(link)
    except OSError as error:
        beside.unlink(missing_ok=True)
        raise OSError(f"link {link}: {error.strerror}; take another path") from error
    try:
        yield
    finally:
        with contextlib.suppress(OSError):  # removed or replaced by others meanwhile
            if str(link.readlink()) == target:
                link.unlink()


def listen_tcp(host: str, port: int, *, remote: bool = False) -> socket.socket:
    """Listen for TCP connections.

    Parameters
    ----------
    host, port
        Address; port 0 is any that is free.
    remote
        True if other machines may reach it.

    Raises
    ------
    PermissionError
        If other machines could reach it and must not.
    OSError
        If there is no such address, or it is in use; the message names it and the remedy.
    """
    require_loopback(host, "draw", remote=remote)
    family, address = _resolve(host, port)
    try:
        return socket.create_server(address[:2], family=family, backlog=1)
    except OSError as error:
        remedies = {
            errno.EADDRINUSE: "it is in use; end the other program, or take port 0",
            errno.EACCES: "ports below 1024 need privileges; take port 0",
            errno.EADDRNOTAVAIL: "this machine has no such address; take 127.0.0.1",
        }
        reason = remedies.get(error.errno or 0, error.strerror)
        raise OSError(error.errno, f"cannot listen on {host} port {port}: {reason}") from error


def require_loopback(host: str, what: str = "look on", *, remote: bool) -> None:
    """Raise unless an address is reached from this machine only, or may be reached from others.

    Parameters
    ----------
    host
        Name or number of the address.
    what
        What others could do, for the message.
    remote
        True if other machines may reach it.

    Raises
    ------
    PermissionError
        If other machines could reach it and must not.
    OSError
        If there is no such address.
    """
    import ipaddress  # noqa: PLC0415 - devices in the host's process have no address

    _, address = _resolve(host, None)
    if not (remote or ipaddress.ip_address(address[0]).is_loopback):
        raise PermissionError(
            f"anyone who reaches {host} could {what}: listen on 127.0.0.1, or add --allow-remote"
        )


def _resolve(host: str, port: int | None) -> tuple[socket.AddressFamily, tuple[Any, ...]]:
    try:
        family, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except (OSError, UnicodeError) as error:  # names that cannot be encoded raise the latter
        raise OSError(f"there is no address {excerpt(host)}: take 127.0.0.1") from error
    return family, address


def accept(listener: socket.socket, stop: Waitable) -> socket.socket | None:
    """Accept a connection, not blocking.

    Parameters
    ----------
    listener
        A listening socket that is ready.
    stop
        Becomes readable when it is time to stop.

    Returns
    -------
    socket or None
        None if the client has gone, or if the system has no file descriptor or memory left for it:
        then after a pause, in which connections of this and other programs may end.
    """
    try:
        connection, _ = listener.accept()
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    except ConnectionError:
        return None
    except OSError:
        wait_ready([stop], timeout_s=_ACCEPT_RETRY_S)
        return None
    return connection


def serve_tcp(wire: DeviceOnLine | PacedDevice, listener: socket.socket, stop: int) -> None:
    """Run a device for one connection after the other until ``stop`` becomes readable.

    Parameters
    ----------
    wire
        The device. Its session ends with each connection.
    listener
        From `listen_tcp`.
    stop
        File descriptor that becomes readable when it is time to stop.
    """
    stopped = False
    while not stopped:
        wire.advance()  # a recording is played without a host, too
        readable, _ = wait_ready([listener.fileno(), stop], timeout_s=wire.next_event_s())
        if stop in readable:
            return
        if not readable:
            continue
        connection = accept(listener, stop)
        if connection is None:
            continue
        with connection:
            stopped = serve_wire(wire, connection.fileno(), stop)
        wire.disconnect()

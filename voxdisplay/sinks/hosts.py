"""Addresses of receivers: names resolved within a deadline, broadcast refused unless asked for.

Must not know what is sent.
"""

from __future__ import annotations

import ipaddress
import queue
import socket
import threading
from typing import Any, Final

from voxdisplay.errors import OpenError
from voxdisplay.transport.diagnosis import network_hint
from voxdisplay.transport.library_errors import LIBRARY_ERRORS, message_of

BROADCAST_HINT: Final = "name one receiver, or add broadcast=yes if all shall have it"

Address = tuple[Any, ...]


def resolve_host(
    port: str, host: str, number: int, kind: socket.SocketKind, timeout_s: float
) -> tuple[int, Address]:
    """Return the address family and the address of a host.

    Parameters
    ----------
    port : str
        As the user named it, for errors.
    host : str
        A name or an address.
    number : int
        Port number.
    kind : SocketKind
    timeout_s : float
        How long the system may take: it has no deadline of its own.

    Raises
    ------
    OpenError
        If there is no such host, or the system does not know in time.

    """
    answer: queue.SimpleQueue[Any] = queue.SimpleQueue()

    def look_up() -> None:
        try:
            answer.put(socket.getaddrinfo(host, number, type=kind))
        except LIBRARY_ERRORS as error:
            answer.put(error)

    # A thread that is left behind: a look-up cannot be cancelled.
    threading.Thread(target=look_up, daemon=True).start()
    try:
        found = answer.get(timeout=timeout_s)
    except queue.Empty:
        raise OpenError(
            f"{port}: the name {host!r} was not resolved in {timeout_s:g} s",
            port=port,
            hint="is the name right, and a name server reachable? An address needs none",
        ) from None
    if isinstance(found, Exception):
        raise OpenError(
            f"{port}: the host {host!r} is not known: {message_of(found)}",
            port=port,
            hint=network_hint(found) or "is the name of the host right?",
        ) from found
    family, _, _, _, address = found[0]
    return family, address


def check_receiver(port: str, address: Address, *, broadcast: bool) -> bool:
    """Return whether an address is a multicast address.

    Raises
    ------
    OpenError
        If it is for all hosts or for many, and that was not asked for; or for none.

    """
    host = ipaddress.ip_address(str(address[0]).partition("%")[0])
    if host.is_unspecified:
        raise OpenError(
            f"{port}: {host} is no receiver's address", port=port, hint="name the receiver"
        )
    if not broadcast and (host.is_multicast or str(host) == "255.255.255.255"):
        kind = "multicast" if host.is_multicast else "broadcast"
        raise OpenError(f"{port}: {host} is a {kind} address", port=port, hint=BROADCAST_HINT)
    return host.is_multicast

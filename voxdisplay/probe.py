"""Asking who is there: HELLO over an open pipe, and nothing else.

What a device shows does not change by it, though any session that it had ends. Knows no frames.
"""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Iterable
from typing import TypeAlias

from voxdisplay.device import DeviceInfo, device_info
from voxdisplay.errors import TransportClosed, VoxDisplayError
from voxdisplay.link import Link
from voxdisplay.transport import Transport, open_transport
from voxdisplay.wire.packet import Info

Answer: TypeAlias = DeviceInfo | str  # who is there, or why nobody is

_LONGEST_WAIT_S = 0.25


def new_session() -> int:
    """Give the number of a session: at random, as protocol.md, section 5, would have it."""
    return 1 + secrets.randbelow(0xFFFF)


def greet(transport: Transport, timeout_s: float) -> Info:
    """Say HELLO until a device answers.

    Parameters
    ----------
    transport : Transport
        An open pipe; it stays open.
    timeout_s : float
        How long to ask.

    Raises
    ------
    TransportTimeout
        If nothing answers, saying what came instead.
    TransportClosed
        If the pipe ends.

    """
    link = Link(new_session(), time.monotonic(), patience_s=timeout_s)
    try:
        while link.info is None:
            if out := link.transmit(time.monotonic()):
                transport.write(out, timeout_s)
            wait_s = link.next_timeout(time.monotonic()) or 0.0
            link.receive(transport.read(min(wait_s, _LONGEST_WAIT_S)), time.monotonic())
    except TransportClosed as error:
        raise said_before(error, link.stream.noise) from error
    return link.info


def said_before(error: TransportClosed, noise: bytes) -> TransportClosed:
    """Give the error for a pipe that ended before HELLO was answered: with what came instead."""
    if not noise:
        return error
    return TransportClosed(
        f"{error}; what it had said is no packet: {noise[:24]!r}",
        hint="is this the display's port? Something else answers there",
    )


def probe_all(
    ports: Iterable[str], *, baud: int, timeout_s: float, slack_s: float
) -> dict[str, Answer]:
    """Ask at all ports at once who is there.

    Parameters
    ----------
    ports : iterable of str
    baud : int
        Bits per second of serial lines.
    timeout_s : float
        How long to ask.
    slack_s : float
        How much longer opening a port may take.

    Returns
    -------
    dict of str to DeviceInfo or str
        What each device says of itself, or what is wrong, in the order of the ports.

    """
    answers: dict[str, Answer] = dict.fromkeys(ports, "it could not be opened in time")

    def ask(port: str) -> None:
        try:
            answers[port] = _probe(port, baud, timeout_s)
        except VoxDisplayError as error:
            answers[port] = str(error)

    # One that hangs in the system's call must not keep the program.
    askers = [threading.Thread(target=ask, args=(port,), daemon=True) for port in answers]
    for asker in askers:
        asker.start()
    end_s = time.monotonic() + timeout_s + slack_s
    for asker in askers:
        asker.join(max(0.0, end_s - time.monotonic()))
    return dict(answers)


def _probe(port: str, baud: int, timeout_s: float) -> DeviceInfo:
    transport = open_transport(port, baud=baud)
    try:
        return device_info(greet(transport, timeout_s))
    finally:
        transport.close()

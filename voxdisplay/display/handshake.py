"""Asking who is there: HELLO over an open pipe, and nothing else.

What a device shows does not change by it, though any session that it had ends. Knows no frames.
"""

from __future__ import annotations

import secrets
import time

from voxdisplay.errors import TransportClosed
from voxdisplay.link import Link
from voxdisplay.transport import Transport
from voxdisplay.wire.packet import Info

_LONGEST_WAIT_S = 0.25


def random_session() -> int:
    """Give the number of a session: at random, as protocol.md, section 5, would have it."""
    return 1 + secrets.randbelow(0xFFFF)


def request_info(transport: Transport, timeout_s: float) -> Info:
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
    link = Link(random_session(), time.monotonic(), timeout_s=timeout_s)
    try:
        while link.info is None:
            if out := link.transmit(time.monotonic()):
                transport.write(out, timeout_s)
            wait_s = link.next_timeout(time.monotonic()) or 0.0
            link.receive(transport.read(min(wait_s, _LONGEST_WAIT_S)), time.monotonic())
    except TransportClosed as error:
        raise closed_before_info(error, link.stream.noise) from error
    return link.info


def closed_before_info(error: TransportClosed, noise: bytes) -> TransportClosed:
    """Give the error for a pipe that ended before HELLO was answered: with what came instead."""
    if not noise:
        hint = "it had not answered HELLO: is it the display's port, and has no other program it?"
        return TransportClosed(str(error), hint=error.hint or hint)
    return TransportClosed(
        f"{error}; what it had said is no packet: {noise[:24]!r}",
        hint="is this the display's port? Something else answers there",
    )

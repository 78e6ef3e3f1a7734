"""HELLO over an open pipe until INFO comes, and nothing else.

Any session that the device had ends by it; what it shows does not change. Must not know frames.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable

from voxdisplay.errors import LocalProtocolError, TransportClosed
from voxdisplay.link import Link
from voxdisplay.link.session_opening import PARTIAL_INFO_HINT
from voxdisplay.transport import Transport
from voxdisplay.wire.packet import Info

_MAX_WAIT_S = 0.25


def random_session() -> int:
    """Return a random session number (protocol.md, section 5)."""
    return 1 + int.from_bytes(os.urandom(8), "little") % 0xFFFF


def request_info(
    transport: Transport, timeout_s: float, cancelled: Callable[[], bool] = lambda: False
) -> Info:
    """Send HELLO until the device answers with INFO.

    Parameters
    ----------
    transport : Transport
        An open pipe; it stays open.
    timeout_s : float
        How long to try.
    cancelled : callable
        Returns True when the answer is not wanted any more.

    Raises
    ------
    TransportTimeout
        If no INFO came; it describes what came instead.
    TransportClosed
        If the pipe ends.
    LocalProtocolError
        If it was cancelled.

    """
    link = Link(random_session(), time.monotonic(), timeout_s=timeout_s)
    try:
        while link.info is None:
            if cancelled():
                raise closed_meanwhile()
            if out := link.transmit(time.monotonic()):
                transport.write(out, timeout_s)
            wait_s = link.next_timeout(time.monotonic()) or 0.0
            link.receive(transport.read(min(wait_s, _MAX_WAIT_S)), time.monotonic())
    except TransportClosed as error:
        raise closed_before_info(error, link) from error
    return link.info


def closed_before_info(error: TransportClosed, link: Link) -> TransportClosed:
    """Return the error for a pipe that ended before INFO came, which describes what came instead.

    Parameters
    ----------
    error : TransportClosed
        How it ended.
    link : Link
        That which had sent HELLO.

    """
    if partial := link.partial_info:
        return TransportClosed(
            f"{error}; before, HELLO was answered by {partial}", hint=PARTIAL_INFO_HINT
        )
    if noise := link.stream.noise:
        return TransportClosed(
            f"{error}; what came before is no packet: {noise[:24]!r}",
            hint="is this the display's port? Something else answers there",
        )
    hint = "it had not answered HELLO: is it the display's port, and has no other program it open?"
    return TransportClosed(str(error), hint=error.hint or hint)


def closed_meanwhile() -> LocalProtocolError:
    """Return the error for an operation during which the display was closed elsewhere."""
    return LocalProtocolError(
        "the display was closed by another thread or a signal handler in the meantime"
    )

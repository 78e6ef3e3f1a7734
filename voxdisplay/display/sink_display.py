"""`SinkDisplay`: the user's handle of a display that takes pictures and answers nothing.

A sink of a lighting protocol shows what arrives, and reports nothing of it: receipts prove nothing.
Must not know protocols, wiring or sockets.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, NoReturn, cast

from voxdisplay.display.display import Display
from voxdisplay.display.display_operations import DisplayOperations
from voxdisplay.display.fair_lock import FairLock
from voxdisplay.display.sink_connection import Sink, SinkConnection
from voxdisplay.display.sink_operations import SinkOperations
from voxdisplay.errors import IncompatibleDevice

if TYPE_CHECKING:
    from voxdisplay.display.connection import Clock, Connection


class SinkDisplay(Display):
    """An open sink. It is used like any `Display`, and proves nothing.

    `present` returns when the frame has been sent, and not sooner than the sink's rate allows; its
    receipt has no digest. `read` and `verify` raise `IncompatibleDevice`.

    Parameters
    ----------
    sink : Sink
    note : callable, optional
        As of `Display`.
    clock, sleep : callable
        Return seconds, and wait for some, on any monotonic clock.

    """

    answers = False

    def __init__(
        self,
        sink: Sink,
        *,
        note: Callable[[str], None] | None = None,
        clock: Clock = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._note = note
        self._clock = clock
        self._lock = FairLock()
        connection = SinkConnection(sink)
        # The two below have all that a display and a player use of those that they stand in for; a
        # test holds that. There is no session behind them.
        self._connection = cast("Connection", connection)
        operations = SinkOperations(connection, clock, sleep)
        self._operations = cast(DisplayOperations, operations)

    @staticmethod
    def _check_readable(operations: DisplayOperations) -> NoReturn:
        del operations
        raise IncompatibleDevice(
            "nothing answers on this port: what is shown cannot be read back, nor proved",
            hint="a display that speaks protocol.md can be read; of this one, look at it",
        )

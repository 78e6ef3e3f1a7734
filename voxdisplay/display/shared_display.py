"""Turns of the threads that share an open display, and its end.

Must not know frames, but for the last one that nobody waits for.
"""

from __future__ import annotations

import contextlib
import time
import warnings
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import Self, TextIO

from voxdisplay.argument_checks import duration, flag
from voxdisplay.display.connection import Clock, Connection
from voxdisplay.display.display_operations import DisplayOperations
from voxdisplay.display.fair_lock import FairLock
from voxdisplay.display.reconnect import Reconnector
from voxdisplay.errors import LocalProtocolError, VoxDisplayError
from voxdisplay.transport import Transport

TIMEOUT_S = 5.0
FLUSH_TIMEOUT_S = 30.0  # for the last frame: a large one on a slow line takes that long
_BLANK_TIMEOUT_S = 2.0


class SharedDisplay:
    """An open connection that threads use in turn, until one of them closes it.

    Parameters
    ----------
    transport, timeout_s, reconnector, note, capture, clock
        As of `Display`.

    """

    def __init__(
        self,
        transport: Transport,
        *,
        timeout_s: float = TIMEOUT_S,
        reconnector: Reconnector | None = None,
        note: Callable[[str], None] | None = None,
        capture: TextIO | None = None,
        clock: Clock = time.monotonic,
    ) -> None:
        self._note = note
        self._clock = clock
        self._lock = FairLock()
        self._connection = Connection(
            transport, timeout_s=timeout_s, reconnector=reconnector, capture=capture, clock=clock
        )
        self._operations = DisplayOperations(self._connection, clock)

    @property
    def port(self) -> str:
        """The name the pipe was opened by."""
        return self._connection.port

    @contextlib.contextmanager
    def _turn(self) -> Iterator[DisplayOperations]:
        """Lock the display for one call, as long as it is open and this process's."""
        if self._connection.is_inherited:
            raise LocalProtocolError(
                "this display was opened by the process that this one was forked from",
                hint="open it in the process that uses it, and use it in no other",
            )
        with self._lock:
            if self._connection.closed:
                raise LocalProtocolError("the display is closed")
            yield self._operations

    def close(
        self, *, blank: bool = False, flush: bool = True, flush_timeout_s: float = FLUSH_TIMEOUT_S
    ) -> None:
        """Close the port. Twice is fine.

        The last frame from ``present(wait=False)`` is shown first. If that fails or takes too long,
        the port is closed all the same, and `vd.open`'s ``note`` is called, or a `RuntimeWarning`
        is given. A call of another thread may finish within the same time; then it raises
        `LocalProtocolError`. So does a call that a signal handler interrupts to close the display,
        at once: then the last frame is not waited for. In a forked process, this only closes what
        that has inherited.

        Parameters
        ----------
        blank : bool
            Make the display dark first, at once; frames that are not displayed yet are dropped.
            Otherwise the display keeps its last whole picture.
        flush : bool
            False drops frames that are not displayed yet, and ends calls of other threads at once.
        flush_timeout_s : float
            How long to wait for the last frame, and for other threads.

        Raises
        ------
        TransportError, DeviceError
            If the display could not be made dark. The port is closed all the same.

        """
        if self._connection.is_inherited:
            self._connection.close()
            return
        blank = flag("blank", blank)
        flush = flag("flush", flush) and not blank
        flush_timeout_s = duration("flush_timeout_s", flush_timeout_s)
        if not self._lock.acquire(flush_timeout_s if flush else 0.0):
            self._connection.cancel()
            self._lock.acquire()
        try:
            if self._connection.closed:
                return
            if blank:
                self._operations.blank(_BLANK_TIMEOUT_S)
            elif not flush:
                pass
            elif not self._lock.is_reentered:
                self._flush_last(flush_timeout_s)
            elif self._operations.queue.has_unwaited:
                self._report_not_shown("it was closed in the middle of another call")
        finally:
            self._connection.close()
            self._lock.release()

    def _flush_last(self, timeout_s: float) -> None:
        """Show the last frame that nobody waits for; report if that fails."""
        try:
            if self._operations.flush_unwaited(timeout_s):
                return
            reason = f"that took longer than {timeout_s:g} s"
        except VoxDisplayError as error:
            reason = str(error)
        self._report_not_shown(reason)

    def _report_not_shown(self, reason: str) -> None:
        text = f"the last frame was not shown before {self.port} was closed: {reason}"
        if self._note is not None:
            self._note(text)
        else:
            warnings.warn(text, RuntimeWarning, stacklevel=4)

    def __del__(self) -> None:
        # What __init__ has not made is not there.
        operations: DisplayOperations | None = getattr(self, "_operations", None)
        if operations is None or self._connection.closed or self._connection.is_inherited:
            return
        if operations.queue.has_unwaited:
            warnings.warn(
                f"the last frame was not shown: {self.port} was never closed",
                ResourceWarning,
                stacklevel=2,
                source=self,
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        # A generator that is closed, and sys.exit, end a program as it is meant to end.
        self.close(flush=error is None or isinstance(error, GeneratorExit | SystemExit))

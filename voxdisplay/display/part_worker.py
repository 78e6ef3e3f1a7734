"""Thread that drives one part of a display: opens it, shows its share of frames, is gone, is back.

Whoever holds the whole display gives it work, and asks what became of it. Must not know the other
parts.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from itertools import chain
from typing import TYPE_CHECKING, Any, Final, TypeVar

from voxdisplay.display.connection import Clock
from voxdisplay.display.handshake import closed_meanwhile
from voxdisplay.display.tick_phase import TickPhase
from voxdisplay.errors import (
    LocalProtocolError,
    TransportClosed,
    TransportError,
    VoxDisplayError,
)

if TYPE_CHECKING:
    from voxdisplay.display.display import Display
    from voxdisplay.display.display_operations import DisplayOperations
    from voxdisplay.display.frame_queue import Payloads
    from voxdisplay.display.part_profile import PartProfile
    from voxdisplay.display.playback_counts import Playback
    from voxdisplay.display.swap_barrier import SwapBarrier
    from voxdisplay.frame import Frame
    from voxdisplay.raster.pixel_format import Pixels

_T = TypeVar("_T")
_PUMP_S: Final = 0.01  # after which new work is begun
_JOIN_S: Final = 2.0


@dataclass(slots=True)
class _Streamed:
    """A frame that nobody waits for: the part's share, and its number in the whole display.

    It is encoded while the frame before it is on its way: then a line has no pauses.
    """

    frame: Frame
    number: int
    barrier: SwapBarrier
    encoded: list[list[bytes]] = field(default_factory=list)
    rest: Payloads | None = None  # that is still being encoded; None before it is begun

    def encode(self, operations: DisplayOperations) -> bool:
        """Encode a portion; return False if there is none left."""
        if self.rest is None:
            self.rest = operations.encode(self.frame)
        portion = next(self.rest, None)
        if portion is not None:
            self.encoded.append(portion)
        return portion is not None

    @property
    def payloads(self) -> Payloads | None:
        """All of its payloads; None if none are encoded yet."""
        return None if self.rest is None else chain(self.encoded, self.rest)


class PartWorker:
    """Thread that owns one part.

    Parameters
    ----------
    part : PartProfile
    opener : callable
        Opens the part's display.
    clock : callable
        Returns seconds.
    wake : callable
        Called whenever something has changed that others may wait for.

    Attributes
    ----------
    part : PartProfile
    opened : Future of Display
    lost : TransportError or None
        Why the part takes no frames any more.
    fault : Exception or None
        What a streamed frame has raised besides, until somebody takes it away.
    shown_number : int
        Of the streamed frame displayed last.
    tick_phase : TickPhase or None
        When its device ticks; None if it has no ticks.

    """

    def __init__(
        self,
        part: PartProfile,
        opener: Callable[[], Display],
        clock: Clock,
        wake: Callable[[], None],
    ) -> None:
        self.part = part
        self.opened: Future[Display] = Future()
        self.lost: TransportError | None = None
        self.fault: Exception | None = None
        self.shown_number = 0
        self.tick_phase: TickPhase | None = None
        self._opener, self._clock, self._wake = opener, clock, wake
        self._changed = threading.Condition()
        self._calls: deque[tuple[Callable[[], None], Future[Any]]] = deque()
        self._streamed: _Streamed | None = None
        self._numbers: dict[int, int] = {}  # ticket of the part -> number of the frame
        self._closing = False
        self.is_cancelled = False
        self._thread = threading.Thread(
            target=self._run, name=f"voxdisplay {part.name}", daemon=True
        )
        self._thread.start()

    # -- asked by others

    @property
    def display(self) -> Display:
        """The part's display, which is open or was."""
        return self.opened.result()

    @property
    def _connection(self) -> Any:
        return self.display._connection  # noqa: SLF001 - drives it in its user's stead

    @property
    def playback(self) -> Playback:
        """Counts of the part's own frames."""
        return self.display.playback

    def cut(self, frame: Frame) -> Frame:
        """Return the part's share of a frame of the whole display."""
        share = frame.cropped(self.part.at, self.part.size)
        return share.with_output(self.display._output)  # noqa: SLF001 - as above

    def to_user(self, page: Pixels) -> Pixels:
        """Return a page of the part's memory as the user of the whole display sees it."""
        output = self.display._output  # noqa: SLF001 - as above
        return page if output is None else output.to_user(page)

    @property
    def shown_s(self) -> float:
        """When its device reported last that it displays a frame, on the clock."""
        return self.display._operations.queue.shown_s  # noqa: SLF001 - as above

    @property
    def is_present(self) -> bool:
        """True unless its device is gone: waited for, or lost for ever."""
        return self.lost is None and not self._connection.is_away

    @property
    def is_hungry(self) -> bool:
        """True if no streamed frame waits to be begun: its line may run idle."""
        return self._streamed is None

    @property
    def reconnects(self) -> int:
        """Number of times that it was gone and has come back."""
        return int(self._connection.reconnects)

    # -- work

    def call(self, function: Callable[[DisplayOperations], _T]) -> Future[_T]:
        """Have a function called with the part's operations, and return what it will return."""
        future: Future[_T] = Future()

        def work() -> None:
            try:
                result = self._with_operations(function)
            except BaseException as error:  # noqa: BLE001 - raised where the result is asked for
                self._note_error(error)
                future.set_exception(error)
            else:
                future.set_result(result)
            self._wake()

        with self._changed:
            self._calls.append((work, future))
            self._changed.notify()
        return future

    def stream(self, frame: Frame, number: int, barrier: SwapBarrier) -> None:
        """Have a frame shown that nobody waits for; one that has not been begun is left out."""
        with self._changed:
            left_out, self._streamed = self._streamed, _Streamed(frame, number, barrier)
            self._changed.notify()
        if left_out is not None:
            left_out.barrier.leave(self)

    def cancel(self) -> None:
        """End what it does as soon as can be, and drop what it has not begun."""
        self.is_cancelled = True
        with self._changed:
            dropped = [future for _, future in self._calls]
            self._calls.clear()
            self._streamed = None
        for future in dropped:
            future.set_exception(closed_meanwhile())
        if self.opened.done() and not self.opened.exception():
            self._connection.cancel()

    def blank(self, timeout_s: float) -> Future[None]:
        """Cancel all, and show a dark frame at once: see `DisplayOperations.blank`."""

        def work(operations: DisplayOperations) -> None:
            self.is_cancelled = False
            operations.blank(timeout_s)  # by a queue of its own
            operations.queue.on_shown = self._note_shown

        self.cancel()
        return self.call(work)

    def close(self) -> None:
        """End the thread, and close the display."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        self._thread.join(_JOIN_S)

    # -- in its thread

    def _run(self) -> None:
        try:
            display = self._opener()
        except BaseException as error:  # noqa: BLE001 - raised where it is waited for
            self.opened.set_exception(error)
            self._wake()
            return
        if refresh_hz := display.info.refresh_hz:
            self.tick_phase = TickPhase(refresh_hz)
        display._operations.queue.on_shown = self._note_shown  # noqa: SLF001 - as above
        self.opened.set_result(display)
        self._wake()
        while (work := self._next_work()) is not None:
            work()
        display.close(flush=False)

    def _next_work(self) -> Callable[[], None] | None:
        """Wait for work, and turn the link meanwhile as long as frames are on their way."""
        while True:
            with self._changed:
                if self._closing:
                    return None
                if self._calls:
                    return self._calls.popleft()[0]
                if self._streamed is not None:
                    streamed, self._streamed = self._streamed, None
                    self._wake()  # the next one may be handed over
                    return lambda: self._show_streamed(streamed)
                if not self._has_unshown:
                    self._changed.wait()
                    continue
            try:
                self._with_operations(lambda operations: operations.pump(within_s=_PUMP_S))
            except Exception as error:  # noqa: BLE001 - taken by who waits
                self._note_error(error, streamed=True)

    @property
    def _has_unshown(self) -> bool:
        queue = self.display._operations.queue  # noqa: SLF001 - as above
        return self.lost is None and not self.is_cancelled and queue.has_unwaited

    def _with_operations(self, function: Callable[[DisplayOperations], _T]) -> _T:
        if self.lost is not None:
            raise self.lost
        with self.display._turn() as operations:  # noqa: SLF001 - as above
            return function(operations)

    def _show_streamed(self, streamed: _Streamed) -> None:
        try:
            self._with_operations(lambda operations: self._start(operations, streamed))
        except Exception as error:  # noqa: BLE001 - taken by who waits
            self._note_error(error, streamed=True)
        finally:
            streamed.barrier.leave(self)
            self._wake()

    def _start(self, operations: DisplayOperations, streamed: _Streamed) -> None:
        ticket = operations.start_held(
            streamed.frame, streamed.payloads, lambda: self._encode_next(operations)
        )
        self._numbers[ticket] = streamed.number
        operations.release(ticket, lambda commit: streamed.barrier.wait(self, commit))

    def _encode_next(self, operations: DisplayOperations) -> bool:
        following = self._streamed
        return following is not None and following.encode(operations)

    def note_swap(self) -> None:
        """Record that its device has reported a swap."""
        if self.tick_phase:
            self.tick_phase.note_swap(self.shown_s)

    def _note_shown(self, ticket: int, now: float) -> None:
        del now
        for started in [each for each in self._numbers if each <= ticket]:
            self.shown_number = max(self.shown_number, self._numbers.pop(started))
        self.note_swap()
        self._wake()

    def _note_error(self, error: BaseException, *, streamed: bool = False) -> None:
        if self.is_cancelled and isinstance(error, LocalProtocolError):
            return
        if isinstance(error, TransportError):
            if self.lost is None:
                self.lost = error
                self.display.close(flush=False)
        elif isinstance(error, VoxDisplayError) and self._connection.closed:
            # Another device came back behind its port: then the connection has closed itself.
            self.lost = self.lost or TransportClosed(str(error), hint=error.hint)
        elif streamed and isinstance(error, Exception):
            self.fault = self.fault or error
        self._wake()


def named_error(part: PartProfile, error: VoxDisplayError) -> VoxDisplayError:
    """Return an error of a part as one that names the part."""
    error.args = (f"{part.name} ({part.port}): {error}",)
    return error

"""Operations on a display that is made of several: each part has its share, in a thread of its own.

Stand in for `DisplayOperations`. A frame is shown in two phases: all parts get it but for the
COMMIT, and when all that are present hold it, all get that. Must not know how a part sends.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np

from voxdisplay.display.connection import MAX_WAIT_S, Clock
from voxdisplay.display.flushing import Flushing
from voxdisplay.display.part_worker import PartWorker, named_error
from voxdisplay.display.receipt import Receipt, describe_difference
from voxdisplay.display.swap_barrier import SwapBarrier
from voxdisplay.display.tiled_queue import TiledQueue
from voxdisplay.display.tiled_receipt import PartReceipt, TiledReceipt, sum_receipts
from voxdisplay.errors import TransportError, VoxDisplayError
from voxdisplay.frame import Frame

if TYPE_CHECKING:
    from voxdisplay.display.display_operations import DisplayOperations, Hold, Progress
    from voxdisplay.display.tiled_connection import TiledConnection
    from voxdisplay.raster.pixel_format import Pixels

_T = TypeVar("_T")
_WAIT_S: Final = 0.1  # after which progress is told, and an interrupt is noticed
_BLANK_S: Final = 5.0


class TiledOperations(Flushing):
    """Operations on all parts together.

    Parameters
    ----------
    connection : TiledConnection
    clock : callable
        Returns seconds.

    Attributes
    ----------
    queue : TiledQueue

    """

    longest_wait_s = _WAIT_S
    refresh_hz = 0.0  # see `TiledQueue`
    reconnects = 0  # one part that was gone does not move a player's time
    max_hold_ticks = 0  # nor do parts hold frames: each would by ticks of its own

    queue: TiledQueue

    def __init__(self, connection: TiledConnection, clock: Clock) -> None:
        self._connection = connection
        self._workers: Sequence[PartWorker] = connection.workers
        self._layout = connection.layout
        self._clock = clock
        self.queue = TiledQueue(self._workers, connection.info)

    @property
    def wire_bytes(self) -> int:
        """Bytes sent so far."""
        return self._connection.counters.wire_bytes

    def can(self, feature: str) -> bool:
        """Return whether all parts have announced a feature."""
        return feature in self._connection.info.features

    # -- waiting

    def pump(self, *, wait: bool = True, within_s: float = MAX_WAIT_S) -> None:
        """Take note of what parts have done; wait until one has done something.

        Raises
        ------
        VoxDisplayError
            What a frame that nobody waited for has raised.
        TransportError
            If all parts are lost.

        """
        self._collect()
        if wait:
            self._connection.wait_for_change(within_s)
            self._collect()

    def _collect(self) -> None:
        self._connection.report()
        for worker in self._workers:
            fault, worker.fault = worker.fault, None
            if isinstance(fault, VoxDisplayError):
                raise named_error(worker.part, fault)
            if fault is not None:
                raise fault
        self._check_any_left()
        self.queue.collect_shown()
        self.queue.start_pending()

    def _check_any_left(self) -> None:
        reasons = [worker.lost for worker in self._workers]
        if all(reasons) and (last := reasons[-1]):
            raise TransportError(f"all parts of the display are lost; {last}", hint=last.hint)

    def send_encoded(self) -> None:
        """Start the frame that waits, if its turn has come."""
        self.pump(wait=False)

    def _all(
        self,
        function: Callable[[PartWorker, DisplayOperations], _T],
        progress: Callable[[], None] = lambda: None,
    ) -> list[Future[_T]]:
        """Call a function for all parts at once, and wait until it has returned for all.

        Raises
        ------
        VoxDisplayError
            What it has raised, with the part's name, but for what means that a part is lost.

        """

        def bound(worker: PartWorker) -> Callable[[DisplayOperations], _T]:
            return lambda operations: function(worker, operations)

        futures = [worker.call(bound(worker)) for worker in self._workers]
        while not all(future.done() for future in futures):
            self._connection.wait_for_change(_WAIT_S)
            self._connection.report()
            progress()
        self._connection.report()
        for worker, future in zip(self._workers, futures, strict=True):
            error = future.exception()
            if worker.lost is not None:
                continue
            if isinstance(error, VoxDisplayError):
                raise named_error(worker.part, error)
            if error is not None:
                raise error
        self._check_any_left()
        return futures

    def _results(self, futures: Sequence[Future[_T]]) -> list[_T]:
        """Return what all parts have returned.

        Raises
        ------
        TransportError
            If one is lost.

        """
        for worker in self._workers:
            if worker.lost is not None:
                raise TransportError(
                    f"{worker.part.name} ({worker.part.port}) is lost: {worker.lost}",
                    hint="the other parts can be opened by their own ports",
                )
        return [future.result() for future in futures]

    # -- frames

    def show(
        self, frame: Frame, progress: Progress | None, hold: Hold | None = None
    ) -> TiledReceipt:
        """Show a frame on all parts together, and compare their digests. See `Display.present`.

        A part that is lost, or was before, is left out; one that is waited for delays the return,
        and not the others.
        """
        del hold  # the parts hold it: a display that is made of parts is itself none
        began_s = self._clock()
        frame = frame.copy()
        shares = {id(worker): worker.cut(frame) for worker in self._workers}
        steps = {id(worker): (0, 1) for worker in self._workers}
        barrier = SwapBarrier([worker for worker in self._workers if worker.is_present])

        def show_part(worker: PartWorker, operations: DisplayOperations) -> Receipt:
            def step(done: int, total: int) -> None:
                steps[id(worker)] = done, total

            def wait(commit: Callable[[], None]) -> None:
                barrier.wait(worker, commit)

            try:
                receipt = operations.show(shares[id(worker)], step, wait)
                worker.note_swap()
                return receipt
            finally:
                barrier.leave(worker)

        def tell() -> None:
            if progress is not None:
                done, total = np.array(list(steps.values())).sum(axis=0).tolist()
                progress(done, total)

        # A part whose thread does not come to the work never waits at the barrier.
        futures = self._all(show_part, tell)
        parts = [
            PartReceipt(
                worker.part.name,
                worker.display.port,
                None if future.exception() else future.result(),
                None if worker.lost is None else str(worker.lost),
            )
            for worker, future in zip(self._workers, futures, strict=True)
        ]
        times = [worker.shown_s for worker in self._workers if worker.lost is None]
        receipt = sum_receipts(
            parts,
            frame=self.queue.frames + 1,
            elapsed_s=self._clock() - began_s,
            digest=self._connection.whole_digest(frame),
            skew_s=max(times) - min(times),
        )
        self.queue.note_waited(frame, self._clock(), proved=receipt.digest is not None)
        return receipt

    def displayed_frame(self, blank: Frame) -> Frame:
        """Return what is displayed, from memory or read back from all parts."""
        if self.queue.displayed is not None:
            return self.queue.displayed
        frames = self._results(
            self._all(lambda worker, operations: operations.displayed_frame(worker.cut(blank)))
        )
        page = self._connection.blank_page()
        for worker, frame in reversed(list(zip(self._workers, frames, strict=True))):
            page[worker.part.box] = frame.array()
        blank.set(page)
        return blank

    # -- questions

    def request_digest(self) -> int | None:
        """Return the digest of the frame shown last, if all parts still report theirs of it."""
        frame = self.queue.displayed
        found = self._results(self._all(lambda _worker, operations: operations.request_digest()))
        if frame is None or found != [worker.cut(frame).digest() for worker in self._workers]:
            return None
        return self._connection.whole_digest(frame)

    def read_page(self, *, back: bool = False, progress: Progress | None = None) -> Pixels:
        """Return what all parts hold, as one page; what lies in no part is dark."""
        steps = {id(worker): (0, worker.part.size.voxels) for worker in self._workers}

        def read(worker: PartWorker, operations: DisplayOperations) -> Pixels:
            def step(done: int, total: int) -> None:
                steps[id(worker)] = done, total

            return worker.to_user(operations.read_page(back=back, progress=step))

        def tell() -> None:
            if progress is not None:
                done, total = np.array(list(steps.values())).sum(axis=0).tolist()
                progress(done, total)

        pages = self._results(self._all(read, tell))
        whole = self._connection.blank_page()
        for worker, page in reversed(list(zip(self._workers, pages, strict=True))):
            whole[worker.part.box] = page
        return whole

    def read_and_compare(self, frame: Frame, progress: Progress | None) -> tuple[Pixels, str]:
        """Return what all parts hold, and where that differs from a frame, or ""."""
        page = self.read_page(progress=progress)
        expected = self._connection.blank_page()
        meant = frame.readback()
        for worker in self._workers:
            expected[worker.part.box] = meant[worker.part.box]
        return page, describe_difference(expected, page)

    def blank(self, timeout_s: float) -> None:
        """Make all parts dark at once; frames that are not displayed are dropped.

        Raises
        ------
        VoxDisplayError
            If one could not be made dark; the others are.

        """
        self.queue.drop_all()
        futures: list[tuple[PartWorker, Future[Any]]] = [
            (worker, worker.blank(timeout_s)) for worker in self._workers if worker.lost is None
        ]
        failed: VoxDisplayError | None = None
        for worker, future in futures:
            with contextlib.suppress(TimeoutError):
                error = future.exception(timeout_s + _BLANK_S)
                if isinstance(error, VoxDisplayError):
                    failed = named_error(worker.part, error)
        if failed is not None:
            raise failed

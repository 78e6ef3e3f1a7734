"""Source that can be replaced by another while it is watched, such as when a file is saved.

Must not know why it is replaced.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable

from voxdisplay.errors import TransportClosed, VoxDisplayError
from voxdisplay.view.live.snapshot_message import Snapshot
from voxdisplay.view.live.sources import Source


class FollowedSource:
    """A source, and those that replace it.

    Parameters
    ----------
    first : Source
        It is closed when it is replaced, like all that follow.
    report : callable
        Called with the error that ended a source; its last picture stays until it is replaced.

    """

    def __init__(self, first: Source, report: Callable[[VoxDisplayError], None]) -> None:
        self._source, self._report = first, report
        self._generation = 0
        self._changed = threading.Condition()
        self._closed = False

    def replace(self, source: Source) -> None:
        """Go on with another source; called from another thread."""
        with self._changed:
            before, self._source = self._source, source
            self._generation += 1
            self._changed.notify_all()
        before.close()

    def next(self) -> tuple[Hashable, Snapshot]:
        """See `Source.next`."""
        while True:
            with self._changed:
                source, generation = self._source, self._generation
            try:
                key, snapshot = source.next()
            except VoxDisplayError as error:
                self._wait_for_another(generation, error)
            else:
                return (generation, key), snapshot

    def _wait_for_another(self, generation: int, error: VoxDisplayError) -> None:
        """Wait for another source in the place of one that has ended."""
        with self._changed:
            if generation == self._generation and not self._closed:
                self._report(error)
            self._changed.wait_for(lambda: self._closed or generation != self._generation)
            if self._closed:
                raise TransportClosed("the view is closed") from error

    def resend(self) -> None:
        """See `Source.resend`."""
        self._source.resend()

    def check_alive(self) -> None:
        """See `Source.check_alive`. What has ended may be replaced."""

    def close(self) -> None:
        """See `Source.close`."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
            self._source.close()

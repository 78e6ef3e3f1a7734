"""Thread that takes a source's pictures to a live view, no faster than a notebook takes them.

While a cell runs, its kernel reads no answers: pictures are limited by time and bytes instead.
Those that come in between are left out, and none is kept but the last. Must not know widgets.
"""

from __future__ import annotations

import threading
import zlib
from collections.abc import Callable
from typing import Final

from voxdisplay.errors import VoxDisplayError
from voxdisplay.printable_text import printable
from voxdisplay.view.live.snapshot_message import Snapshot, encode
from voxdisplay.view.live.sources import Source

_PERIOD_S: Final = 1 / 20
# A Jupyter server drops what exceeds a million bytes a second, over three seconds.
_BYTES_PER_S: Final = 500_000
_MAX_BYTES: Final = 1_500_000
_LEVEL: Final = 1  # deflates a picture in some milliseconds


class LiveFeed:
    """Feed of one view; it ends when its source does.

    Parameters
    ----------
    source : Source
    show : callable
        Called with the source's newest snapshot and its message, deflated.
    say : callable
        Called with why there is no new picture.
    end : callable
        Called when the source has ended, after `say`.

    """

    def __init__(
        self,
        source: Source,
        show: Callable[[Snapshot, bytes], None],
        say: Callable[[str], None],
        end: Callable[[], None],
    ) -> None:
        self._source, self._show, self._say, self._end = source, show, say, end
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="notebook view", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def close(self) -> None:
        """End without a word; wait until it has."""
        self._closing.set()
        self._source.close()
        self._thread.join()

    def _run(self) -> None:
        try:
            while not self._closing.is_set():
                _, snapshot = self._source.next()
                message = packed_message(snapshot)
                if len(message) > _MAX_BYTES:
                    self._say(f"frame {snapshot.number} is too large for a live view")
                    message = b""
                else:
                    self._show(snapshot, message)
                self._closing.wait(max(_PERIOD_S, len(message) / _BYTES_PER_S))
        except VoxDisplayError as error:
            if not self._closing.is_set():
                self._say(printable(str(error)))
                self._end()


def packed_message(snapshot: Snapshot) -> bytes:
    """Return a snapshot's message, deflated."""
    return zlib.compress(encode(snapshot), _LEVEL)

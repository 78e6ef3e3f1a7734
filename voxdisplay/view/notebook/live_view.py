"""Live view in a notebook: a widget, and the feed that brings it pictures.

When the feed ends, the PNG that the notebook saves becomes that of the last picture.
"""

from __future__ import annotations

import threading
import uuid
from typing import Final

from voxdisplay.view.html_export import page_with
from voxdisplay.view.live.snapshot_message import Snapshot
from voxdisplay.view.live.sources import Source
from voxdisplay.view.notebook.live_feed import LiveFeed, packed_message
from voxdisplay.view.notebook.widget import LiveWidget
from voxdisplay.view.rich_display import page_png

_BEAT_S: Final = 3.0


class LiveView:
    """View of one source.

    Parameters
    ----------
    source : Source
    first : Snapshot
        What is shown until the source has something.

    """

    def __init__(self, source: Source, first: Snapshot) -> None:
        self._snapshot = first
        self._display_id = uuid.uuid4().hex
        page = page_with({"cell": True}, first.title)
        self.widget = LiveWidget(page, self._png, packed_message(first))
        self._ended = threading.Event()
        self.feed = LiveFeed(source, self._show, self._say, self._end)
        self.feed.start()
        threading.Thread(target=self._beat, name="notebook heartbeat", daemon=True).start()

    def display(self) -> None:
        """Show it in the output of the cell that runs."""
        from IPython.display import display  # noqa: PLC0415 - loaded already

        display(self.widget, display_id=self._display_id)

    def _show(self, snapshot: Snapshot, message: bytes) -> None:
        self._snapshot = snapshot
        with self.widget.hold_sync():  # one message
            self.widget.latest, self.widget.state = message, "live"

    def _say(self, state: str) -> None:
        self.widget.state = state

    def _beat(self) -> None:
        """Tell the page now and then that there is a kernel, also while a cell runs."""
        while not self._ended.wait(_BEAT_S):
            self.widget.send({"kind": "alive"})

    def _end(self) -> None:
        """Have the notebook save the last picture."""
        self._ended.set()
        from IPython.display import update_display  # noqa: PLC0415 - loaded already

        update_display(self.widget, display_id=self._display_id)

    def _png(self) -> bytes:
        shown = self._snapshot
        return page_png(shown.page, shown.grid, shown.format, shown.palette) or b""

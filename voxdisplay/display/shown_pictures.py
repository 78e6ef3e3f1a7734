"""Source of the pictures that an open display shows, for a view in the same process.

It looks at what was shown, and asks the device nothing: the line stays free for frames. It does not
keep the display open. Must not know displays, nor who views.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from voxdisplay.display.frame_queue import Picture
from voxdisplay.errors import MissingExtra, TransportClosed
from voxdisplay.frame import Frame
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.palette import DEFAULT
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.raster.pixel_map import PixelMap
from voxdisplay.shows.show import EncodedFrame
from voxdisplay.view.live.snapshot_message import Snapshot
from voxdisplay.view.rich_display import in_notebook
from voxdisplay.wire.op_decoder import decode_ops

if TYPE_CHECKING:
    from voxdisplay.frame.output_transform import OutputTransform
    from voxdisplay.view.notebook.live_view import LiveView

_POLL_S: Final = 1 / 30


class Shown(NamedTuple):
    """What a display shows.

    Attributes
    ----------
    picture : Frame, EncodedFrame or None
        None: nothing was shown yet. A frame is as the user sees it, an encoded one as the memory.
    grid : Grid
        Of the memory.
    format : PixelFormat
    output : OutputTransform or None
        What lies between the user's picture and the memory.
    is_open : bool
        False if the display is closed: there will be no other.

    """

    picture: Picture | None
    grid: Grid
    format: PixelFormat
    output: OutputTransform | None
    is_open: bool

    def frame(self) -> Frame | None:
        """Return the picture as the user sees it, decoded."""
        if not isinstance(self.picture, EncodedFrame):
            return self.picture
        drawn = decode_ops(self.picture.payloads, self.grid, self.format)
        palette = None
        if drawn.colors and self.format is PixelFormat.INDEX8:
            palette = DEFAULT.copy()
            palette[list(drawn.colors)] = np.array(list(drawn.colors.values()), dtype=np.uint8)
        frame = Frame(self.grid, self.format, palette=palette)
        frame.set_voxels(drawn.index, drawn.values)
        if self.output is None:
            return frame
        turned = Frame(self.output.user_grid(self.grid), self.format, palette=palette)
        turned.set(self.output.to_user(frame.array()))
        return turned


class ShownPictures:
    """Source of pictures, as `voxdisplay.view.live.sources.Source`.

    Parameters
    ----------
    port : str
        Of the display.
    look : callable
        Returns a function that returns what the display shows now; None if there is no display any
        more. The function is called while other threads use the display.

    """

    def __init__(self, port: str, look: Callable[[], Callable[[], Shown] | None]) -> None:
        self._port, self._look = port, look
        self._last: Picture | None = None
        self._number = 0
        self._closing = threading.Event()

    def next(self) -> tuple[Hashable, Snapshot]:
        """See `Source.next`."""
        while True:
            look = self._look()
            shown = look() if look is not None else None
            del look  # it would keep the display
            if shown and shown.picture is not self._last and (frame := shown.frame()):
                self._last = shown.picture
                self._number += 1
                return self._number, snapshot_of(frame, self._number, self._port)
            if not (shown and shown.is_open):
                raise TransportClosed(f"{self._port} is closed: last picture")
            if self._closing.wait(_POLL_S):
                raise TransportClosed(f"{self._port} is not viewed any more")

    def resend(self) -> None:
        """See `Source.resend`."""
        self._last = None

    def check_alive(self) -> None:
        """See `Source.check_alive`. There is nothing to check."""

    def close(self) -> None:
        """See `Source.close`."""
        self._closing.set()


def snapshot_of(frame: Frame, number: int, title: str) -> Snapshot:
    """Return a frame as a snapshot for a view."""
    lit = PixelMap(*frame.lit())
    return Snapshot(lit, frame.grid, frame.format, number, title, palette=frame.palette)


def live_view(source: ShownPictures, first: Frame, title: str) -> LiveView | None:
    """Return a live view; None outside a notebook, and without the extra ``notebook``."""
    if not in_notebook():
        return None
    try:
        from voxdisplay.view.notebook.live_view import LiveView  # noqa: PLC0415 - an extra
    except MissingExtra:
        return None
    return LiveView(source, snapshot_of(first, 0, title))

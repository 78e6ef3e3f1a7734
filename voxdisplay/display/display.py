"""`Display`: the user's handle of an open display.

Blocks in the caller's thread, and needs no other. Must not know bytes, threads or how it ends.
"""

from __future__ import annotations

import math
import weakref
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Literal, NoReturn, overload

import numpy as np
from numpy.typing import NDArray

from voxdisplay.argument_checks import duration, flag, function
from voxdisplay.display.device_info import DeviceInfo, check_serial
from voxdisplay.display.display_operations import DisplayOperations, Progress
from voxdisplay.display.paced_display import PacedDisplay
from voxdisplay.display.receipt import Receipt, count_noun
from voxdisplay.errors import (
    DesyncError,
    IncompatibleDevice,
    LocalProtocolError,
)
from voxdisplay.frame import Frame
from voxdisplay.link import LinkCounters
from voxdisplay.raster.pixel_format import Pixels

__all__ = ["Display", "Receipt"]

if TYPE_CHECKING:
    from voxdisplay.display.player import Late, Pacing, Player
    from voxdisplay.display.shown_pictures import Shown
    from voxdisplay.display.tiled_receipt import PartState
    from voxdisplay.frame import Fit
    from voxdisplay.frame.output_transform import OutputTransform
    from voxdisplay.shows.play_report import PlayReport
    from voxdisplay.shows.playable import Playable
    from voxdisplay.view.notebook.live_view import LiveView


class Display(PacedDisplay):
    """An open display. Use it as a context manager, or `close` it.

    It may be used from several threads: each call waits until those before it have returned.

    Parameters
    ----------
    transport : Transport
        An open pipe to the device.
    timeout_s : float
        How long the device may be silent.
    reconnector : Reconnector, optional
        Finds a device again that has gone away.
    note : callable, optional
        Called with a line of text if `close` could not show the last frame; without it, that is a
        `RuntimeWarning`.
    capture : text file, optional
        Receives all bytes to and from the device.
    clock : callable
        Returns seconds, on any monotonic clock.

    """

    answers = True
    """False if nothing answers on its port: then no receipt is a proof, and nothing can be read."""

    parts: tuple[PartState, ...] = ()
    """State of each part of a display that is made of several; empty for any other."""

    # Of a display with a profile: see `set_output`.
    _output: OutputTransform | None = None
    _user_info: tuple[DeviceInfo, DeviceInfo] | None = None
    _view: LiveView | None = None  # in a notebook
    _limited = False  # it was noted that the current limit dims a picture

    def __repr__(self) -> str:
        """Return it in one line: ``<Display sim: 128x128x128 rgb888, 3 frames shown>``."""
        info, shown = self.info, count_noun(self._operations.queue.frames, "frame")
        state = "closed" if self._connection.closed else f"{shown} shown"
        name = f" {info.name!r}" if info.name else ""
        return f"<Display {self.port}{name} {info.grid} {info.format.value}, {state}>"

    def __reduce__(self) -> NoReturn:
        raise TypeError("a Display is open in this process only: pass its port, and open it there")

    def _repr_png_(self) -> bytes | None:
        """Return a picture for notebooks of the frame last proved; None without one, or Pillow."""
        frame = self._operations.queue.displayed
        return frame._repr_png_() if frame else None

    def show(self) -> None:
        """Show what is displayed: in a notebook a live view, else in the picture viewer.

        The live view follows the frames that this handle has shown, and stays as it is when the
        display is closed. Another call shows the same view once more.

        Raises
        ------
        MissingExtra
            If Pillow is not installed.
        VoxDisplayError
            If there is no screen, or no picture viewer.

        """
        from voxdisplay.display.shown_pictures import ShownPictures, live_view  # noqa: PLC0415

        if self._view is None:
            first = self._first_shown()
            source = ShownPictures(self.port, weakref.WeakMethod(self._shown))
            self._view = live_view(source, first, self.port)
            if self._view is None:
                first.show()
                return
        self._view.display()

    def _shown(self) -> Shown:
        """Return what is displayed, or was before the display was closed; without a turn."""
        from voxdisplay.display.shown_pictures import Shown  # noqa: PLC0415

        is_open, info = not self._connection.closed, self._connection.info
        picture = self._operations.queue.latest  # after `is_open`: there is no later one
        return Shown(picture, info.grid, info.format, self._output, is_open)

    def _first_shown(self) -> Frame:
        """Return what is displayed, read back if need be; a blank frame if it cannot be."""
        with self._turn() as operations:
            operations.flush()
            frame = self._shown().frame()
        if frame is not None:
            return frame
        try:
            return self.frame(keep=True)
        except IncompatibleDevice:
            return self.frame()

    @property
    def info(self) -> DeviceInfo:
        """Properties that the device has announced; the grid is as its user sees it."""
        announced = self._connection.info
        if self._output is None:
            return announced
        if self._user_info is None or self._user_info[0] is not announced:
            grid = self._output.user_grid(announced.grid)
            self._user_info = announced, replace(announced, grid=grid)
        return self._user_info[1]

    @property
    def counters(self) -> LinkCounters:
        """Counters of the link."""
        return self._connection.link.counters

    def set_output(self, output: OutputTransform | None, *, serial: str | None = None) -> None:
        """Set how the display stands, and what light it may give, as of its profile.

        From now on frames, pages and coordinates are those of its user.

        Parameters
        ----------
        output : OutputTransform or None
            None: as its memory is.
        serial : str, optional
            Serial number that the device must have, now and when it comes back.

        Raises
        ------
        IncompatibleDevice
            If it has another.

        """
        with self._turn():
            check_serial(self._connection.info, serial)
            self._connection.serial = serial
            self._output, self._user_info, self._limited = output, None, False

    # -- frames

    def frame(self, *, keep: bool = False, palette: NDArray[np.uint8] | None = None) -> Frame:
        """Return a frame of the display's grid and format.

        Parameters
        ----------
        keep : bool
            Whether it starts as what is displayed; otherwise it is blank. What is displayed is the
            frame that this handle has shown and proved last; or, if there is none, what can be read
            back from the device. (A palette cannot: then it is the default one.)
        palette : (256, 3) uint8 array, optional
            For index8 displays with the feature ``palette``: red, green and blue of each pixel
            value. Without it, such a display shows all colours exactly, as long as a frame has no
            more than 255 besides black.

        Raises
        ------
        IncompatibleDevice
            If it is not known what is displayed and the device cannot be read, or if there is a
            palette and the device has its own.

        """
        if flag("keep", keep):
            if palette is not None:
                raise ValueError("a frame that keeps what is on display keeps its palette, too")
            with self._turn() as operations:
                operations.flush()
                found = operations.displayed_frame(self.frame())
                if found.output is not self._output:
                    raise IncompatibleDevice(
                        "what is on display was shown before it was set how the display stands",
                        hint="present a whole frame first: display.frame() without keep",
                    )
                return found.copy()
        own = "palette" in self.info.features
        if palette is not None and not own:
            raise IncompatibleDevice(
                "this display has no palette that could be set",
                hint="leave the palette out: colours become the nearest of its own",
            )
        frame = Frame(self.info.grid, self.info.format, palette=palette, own_palette=own)
        return frame if self._output is None else frame.with_output(self._output)

    @overload
    def present(
        self, frame: Frame, *, wait: Literal[True] = True, progress: Progress | None = None
    ) -> Receipt: ...

    @overload
    def present(
        self, frame: Frame, *, wait: Literal[False], progress: Progress | None = None
    ) -> None: ...

    @overload
    def present(
        self, frame: Frame, *, wait: bool, progress: Progress | None = None
    ) -> Receipt | None: ...

    def present(
        self, frame: Frame, *, wait: bool = True, progress: Progress | None = None
    ) -> Receipt | None:
        """Show a frame.

        Parameters
        ----------
        frame : Frame
            Of this display's grid and format.
        wait : bool
            Whether to wait until the frame is displayed and its digest has been compared. If not,
            the frame is encoded within the call, and sent as far as the device has room for it; and
            only the newest frame is kept while earlier ones are on their way: a display that is
            slower than its caller skips frames, and never lags behind. `playback` counts them. The
            last one is shown before `close` returns.
        progress : callable, optional
            Called with (packets received, packets in all) while it waits.

        Returns
        -------
        Receipt or None
            None if it did not wait.

        Raises
        ------
        DesyncError
            If the device shows something else, also after the frame has been sent again.
        DeviceError
            If the device refused the frame.
        TransportError
            If the pipe failed.

        """
        wait = flag("wait", wait)
        function("progress", progress)
        with self._turn() as operations:
            frame = self._to_show(frame)
            if not wait:
                operations.queue.replace_pending(frame)
                operations.send_encoded()
                return None
            operations.flush()
            return operations.show(frame, progress)

    def _to_show(self, frame: Frame) -> Frame:
        """Return a frame for how this display stands; note what its current limit does."""
        self._check_frame(frame)
        if frame.output is not self._output:
            frame = frame.with_output(self._output)
        if self._output is not None and frame.output_note:
            self._note_limit(frame.output_note)
        return frame

    def _note_limit(self, text: str) -> None:
        """Note, once, what the current limit does."""
        if not self._limited and self._note is not None:
            self._note(text)
        self._limited = True

    def _check_frame(self, frame: Frame) -> None:
        if not isinstance(frame, Frame):
            raise TypeError(
                f"frame is a {type(frame).__name__}: draw it into a frame of display.frame()"
            )
        if (frame.grid, frame.format) != (self.info.grid, self.info.format):
            raise LocalProtocolError(
                f"the frame is {frame.grid} {frame.format.value}, the display "
                f"{self.info.grid} {self.info.format.value}",
                hint="make frames by display.frame()",
            )
        if frame.has_own_palette and "palette" not in self.info.features:
            raise LocalProtocolError(
                "the frame has a palette of its own, and the display's cannot be set",
                hint="make frames by display.frame()",
            )

    def poll(self) -> None:
        """Send and receive without waiting, for callers of ``present(wait=False)``."""
        with self._turn() as operations:
            operations.pump(wait=False)

    def flush(self, timeout_s: float | None = None) -> None:
        """Wait until every frame that was handed over is displayed, or was skipped.

        Parameters
        ----------
        timeout_s : float, optional
            How long to wait. None: as long as the device goes on.

        Raises
        ------
        TransportTimeout
            If that takes longer.

        """
        limit_s = math.inf if timeout_s is None else duration("timeout_s", timeout_s)
        with self._turn() as operations:
            operations.flush(limit_s)

    def play(
        self,
        show: Playable,
        *,
        speed: float = 1.0,
        start: float = 0.0,
        until: float | None = None,
        loop: bool | None = None,
        clock: Pacing = "device",
        late: Late = "drop",
        fit: Fit = "contain",
        observer: Callable[[Player], None] | None = None,
    ) -> PlayReport:
        """Play a show: a moving scene, a recording, a playlist, or any `Show`.

        Each frame's digest is known before it is displayed, and compared. Frames that take long to
        draw are prepared by another process.

        Parameters
        ----------
        show : Show, Scene, Playlist or Frame
        speed : float
            Seconds of the show per second.
        start, until : float
            Where it begins and ends, in seconds of the show.
        loop : bool, optional
            Whether it is repeated until `observer` stops it, or Ctrl-C. By default, what the show
            says of itself.
        clock : {"device", "host"}
            ``"device"`` gives each refresh tick a frame, so that swaps are as regular as ticks can
            be: with the feature HOLD frames stay for some ticks, otherwise they are repeated. A
            line that cannot carry that many, or a device without ticks, is paced by the clock
            of this machine.
        late : {"drop", "delay"}
            ``"drop"`` leaves frames out when a newer one is due; ``"delay"`` shows every frame, and
            takes longer.
        fit : {"contain", "none", "content"}
            As of `Frame.draw`, for scenes.
        observer : callable, optional
            Called with the `Player` at least every 20 ms; it may pause, seek and stop it.

        Returns
        -------
        PlayReport

        Raises
        ------
        DesyncError
            If the display shows something else than a frame twice in a row.
        TransportError, DeviceError
            As of `present`.
        SceneError, CurveError
            If a frame cannot be drawn.

        """
        from voxdisplay.display.play_show import play_show  # noqa: PLC0415 - push needs none of it

        return play_show(
            show, self.frame(), self._turn, self._to_show, self._clock, self._note_limit,
            speed=speed, start=start, until=until, loop=loop, pacing=clock, late=late, fit=fit,
            observer=observer,
        )  # fmt: skip

    def clear(self) -> Receipt:
        """Make the display dark."""
        with self._turn() as operations:
            operations.flush()
            blank = Frame(self.info.grid, self.info.format)
            return operations.show(self._to_show(blank), None)

    # -- questions

    def digest(self) -> int | None:
        """Return the digest of what is displayed (protocol.md, section 8), as the device reports.

        Returns
        -------
        int or None
            None if the device has no digest.

        """
        with self._turn() as operations:
            return operations.request_digest()

    def read(self, *, back: bool = False, progress: Progress | None = None) -> Pixels:
        """Read a page of the device's memory.

        Parameters
        ----------
        back : bool
            The back page, which is being written, instead of the front page.
        progress : callable, optional
            Called with (voxels read, voxels in all).

        Returns
        -------
        ndarray
            Indexed [z, y, x], as `Frame.array`.

        Raises
        ------
        IncompatibleDevice
            If the device cannot read.

        """
        back = flag("back", back)
        function("progress", progress)
        with self._turn() as operations:
            self._check_readable(operations)
            page = operations.read_page(back=back, progress=progress)
        return page if self._output is None else self._output.to_user(page)

    @staticmethod
    def _check_readable(operations: DisplayOperations) -> None:
        if not operations.can("read"):
            raise IncompatibleDevice(
                "this display cannot read its memory back",
                hint="its digest still proves what it shows",
            )

    def verify(self, frame: Frame, *, progress: Progress | None = None) -> Pixels:
        """Read the front page back and compare it with a frame, voxel by voxel.

        Frames from ``present(wait=False)`` are displayed first.

        Parameters
        ----------
        frame : Frame
            What should be displayed.
        progress : callable, optional
            As of `read`.

        Returns
        -------
        ndarray
            What was read back, as of `read`.

        Raises
        ------
        DesyncError
            If they differ; it says where.
        IncompatibleDevice
            If the device cannot read.

        """
        frame = self._to_show(frame)
        function("progress", progress)
        with self._turn() as operations:
            operations.flush()
            self._check_readable(operations)
            page, differs = operations.read_and_compare(frame, progress)
        if differs:
            raise DesyncError(f"what was read back is not the frame: {differs}")
        return page if self._output is None else self._output.to_user(page)

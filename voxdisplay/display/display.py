"""`Display`: the user's handle of an open display.

Blocks in the caller's thread, and needs no other. Threads that share a display take turns; a forked
process must open its own. Must not know bytes.
"""

from __future__ import annotations

import contextlib
import time
import warnings
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import Literal, NoReturn, Self, TextIO, overload

import numpy as np
from numpy.typing import NDArray

from voxdisplay.argument_checks import duration, flag, function
from voxdisplay.display.connection import Clock, Connection
from voxdisplay.display.device_info import DeviceInfo
from voxdisplay.display.display_operations import DisplayOperations, Progress
from voxdisplay.display.fair_lock import FairLock
from voxdisplay.display.receipt import Receipt, count_noun, describe_difference
from voxdisplay.display.reconnect import Reconnector
from voxdisplay.errors import (
    DesyncError,
    IncompatibleDevice,
    LocalProtocolError,
    VoxDisplayError,
)
from voxdisplay.frame import Frame
from voxdisplay.link import LinkCounters
from voxdisplay.raster.pixel_format import Pixels
from voxdisplay.transport import Transport

__all__ = ["TIMEOUT_S", "Display", "Receipt"]

TIMEOUT_S = 5.0
FLUSH_TIMEOUT_S = 30.0  # for the last frame: a large one on a slow line takes that long
_BLANK_TIMEOUT_S = 2.0


class Display:
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
        self._lock = FairLock()
        self._connection = Connection(
            transport, timeout_s=timeout_s, reconnector=reconnector, capture=capture, clock=clock
        )
        self._operations = DisplayOperations(self._connection, clock)

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

    @property
    def info(self) -> DeviceInfo:
        """Properties that the device has announced."""
        return self._connection.info

    @property
    def port(self) -> str:
        """The name the pipe was opened by."""
        return self._connection.port

    @property
    def counters(self) -> LinkCounters:
        """Counters of the link."""
        return self._connection.link.counters

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
                return operations.displayed_frame(self.frame()).copy()
        own = "palette" in self.info.features
        if palette is not None and not own:
            raise IncompatibleDevice(
                "this display has no palette that could be set",
                hint="leave the palette out: colours become the nearest of its own",
            )
        return Frame(self.info.grid, self.info.format, palette=palette, own_palette=own)

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
            only the newest frame is kept while an earlier one is on its way: a display that is
            slower than its caller skips frames, and never lags behind. The last one is shown before
            `close` returns.
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
            self._check_frame(frame)
            if not wait:
                operations.queue.replace_pending(frame)
                operations.pump(wait=False)
                return None
            operations.flush()
            return operations.show(frame, progress)

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

    def flush(self) -> None:
        """Wait until every frame that was handed over is displayed, or was skipped."""
        with self._turn() as operations:
            operations.flush()

    def clear(self) -> Receipt:
        """Make the display dark."""
        with self._turn() as operations:
            operations.flush()
            return operations.show(Frame(self.info.grid, self.info.format), None)

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
            if not operations.can("read"):
                raise IncompatibleDevice(
                    "this display cannot read its memory back",
                    hint="its digest still proves what it shows",
                )
            return operations.read_page(back=back, progress=progress)

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
        self._check_frame(frame)
        with self._turn() as operations:
            operations.flush()
            page = self.read(progress=progress)
        if differs := describe_difference(frame.array(), page):
            raise DesyncError(f"what was read back is not the frame: {differs}")
        return page

    # -- turns, and the end

    @contextlib.contextmanager
    def _turn(self) -> Iterator[DisplayOperations]:
        """Have the display to oneself, as long as it is open and this process's."""
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
        `LocalProtocolError`. In a forked process, this only closes what that has inherited.

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
            elif flush:
                self._flush_last(flush_timeout_s)
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
        text = f"the last frame was not shown before {self.port} was closed: {reason}"
        if self._note is not None:
            self._note(text)
        else:
            warnings.warn(text, RuntimeWarning, stacklevel=4)

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

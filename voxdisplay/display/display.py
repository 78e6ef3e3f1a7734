"""A display as its user sees it: frames in, proof out.

`Display` waits, blocking, in the caller's thread: the only one. It turns a `Connection` until a
`FrameQueue` has shown what it was given, and compares. How bytes are made and pipes are kept alive
is the business of others.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from types import TracebackType
from typing import Self, TextIO

import numpy as np
from numpy.typing import NDArray

from voxdisplay.display.connection import Clock, Connection, Reconnected
from voxdisplay.display.device_info import DeviceInfo, device_error
from voxdisplay.display.frame_queue import FrameQueue
from voxdisplay.display.receipt import (
    WRONG_TWICE_HINT,
    Receipt,
    describe_difference,
    describe_wrong_digest,
)
from voxdisplay.display.reconnect import Reconnector
from voxdisplay.errors import DesyncError, IncompatibleDevice, LocalProtocolError
from voxdisplay.frame import Frame
from voxdisplay.link import (
    Event,
    FrameShown,
    LinkCounters,
    PacketRefused,
    PageReceived,
    StatusReceived,
)
from voxdisplay.raster.pixel_format import Pixels
from voxdisplay.transport import Transport
from voxdisplay.wire.packet import Page
from voxdisplay.wire.spans import decode_spans

__all__ = ["TIMEOUT_S", "Display", "Receipt"]

TIMEOUT_S = 5.0
_BLANK_TIMEOUT_S = 2.0  # for a last dark picture
Progress = Callable[[int, int], None]


class Display:
    """An open display. Use it as a context manager, or `close` it.

    Parameters
    ----------
    transport : Transport
        An open pipe to the device.
    timeout_s : float
        How long the device may be silent.
    reconnect : Reconnect, optional
        Who waits for a device that has gone away, and finds it again.
    capture : text file, optional
        Gets all bytes to and from the device.
    clock : callable
        Gives seconds, on any steady clock.

    """

    def __init__(
        self,
        transport: Transport,
        *,
        timeout_s: float = TIMEOUT_S,
        reconnect: Reconnector | None = None,
        capture: TextIO | None = None,
        clock: Clock = time.monotonic,
    ) -> None:
        self._clock = clock
        self._pages: list[Page] = []
        self._status: StatusReceived | None = None
        self._connection = Connection(
            transport, timeout_s=timeout_s, reconnect=reconnect, capture=capture, clock=clock
        )
        self._queue = FrameQueue(self._connection)
        self._handle_events()

    @property
    def info(self) -> DeviceInfo:
        """What the device said of itself."""
        return self._connection.info

    @property
    def port(self) -> str:
        """The name the pipe was opened by."""
        return self._connection.port

    @property
    def counters(self) -> LinkCounters:
        """What the link has done so far."""
        return self._connection.link.counters

    def _repr_png_(self) -> bytes | None:
        """Return a picture for notebooks of the frame last proved; None without one, or Pillow."""
        frame = self._queue.displayed
        return frame._repr_png_() if frame else None

    # -- waiting

    def _pump(self, *, wait: bool = True) -> None:
        """Let the connection do what it can, and take what comes.

        It does not wait while there is something to be coded: then it does a part of that.
        """
        self._queue.encode()
        self._connection.pump(wait=wait and not self._queue.encoding)
        self._handle_events()

    def _handle_events(self) -> None:
        for event in self._connection.events():
            self._handle(event)

    def _handle(self, event: Event | Reconnected) -> None:
        match event:
            case FrameShown(ticket, digest):
                self._queue.note_shown(ticket, digest)
            case Reconnected():
                self._queue.note_reconnect()
            case StatusReceived():
                self._status = event
            case PageReceived(page):
                self._pages.append(page)
            case PacketRefused(error):
                self._queue.note_refusal()
                raise device_error(error)

    # -- frames

    def frame(self, *, keep: bool = False, palette: NDArray[np.uint8] | None = None) -> Frame:
        """Give a frame of the display's grid and format.

        Parameters
        ----------
        keep : bool
            Whether it starts as what is on display; otherwise it is blank. That is the frame
            that this handle has shown and proved last; or, if there is none, what can be read
            back from the device. (A palette cannot: then it is the default one.)
        palette : (256, 3) uint8 array, optional
            For index8 displays with the feature ``palette``: red, green and blue of each pixel
            value. Without it, such a display shows all colours exactly, as long as a frame has no
            more than 255 besides black.

        Raises
        ------
        IncompatibleDevice
            If it is not known what is on display and the device cannot be read, or if there is a
            palette and the device has its own.

        """
        if keep:
            self.flush()
            frame = self._displayed_frame().copy()
            if palette is not None:
                raise ValueError("a frame that keeps what is on display keeps its palette, too")
            return frame
        own = "palette" in self.info.features
        if palette is not None and not own:
            raise IncompatibleDevice(
                "this display has no palette that could be set",
                hint="leave the palette out: colours become the nearest of its own",
            )
        return Frame(self.info.grid, self.info.format, palette=palette, own_palette=own)

    def _displayed_frame(self) -> Frame:
        """Give what is on display, from memory or from the device."""
        if known := self._queue.displayed:
            return known
        if "read" not in self.info.features:
            raise IncompatibleDevice(
                "it is not known what is on display, and this device cannot be read",
                hint="present a whole frame first: display.frame() without keep",
            )
        link = self._connection.link
        place = link.displayed
        frame = self.frame()
        frame.set(self.read())
        # What else its palette shows, nobody can tell: then it is no base for a difference.
        if place == link.displayed and "palette" not in self.info.features:
            self._queue.set_displayed(frame.copy(), place)
        return frame

    def present(
        self, frame: Frame, *, wait: bool = True, progress: Progress | None = None
    ) -> Receipt | None:
        """Show a frame.

        Parameters
        ----------
        frame : Frame
            Of this display's grid and format.
        wait : bool
            Whether to wait until the frame is on display and its digest has been compared. If not,
            only the newest frame is kept while an earlier one is on its way: a display that is
            slower than its caller skips frames, and never lags behind.
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
        self._check_open()
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
        if not wait:
            self._queue.replace_pending(frame)
            self.poll()
            return None
        self.flush()
        return self._present_and_wait(frame, progress)

    def _present_and_wait(self, frame: Frame, progress: Progress | None) -> Receipt:
        began_s = self._clock()
        before = replace(self.counters)
        meant = frame.copy()
        ticket = self._queue.enqueue(meant)
        digest = self._wait_until_shown(ticket, progress)
        repaired = None
        if digest is not None and digest != meant.digest():
            ticket, repaired = self._repair(meant, digest)
            digest = meant.digest()
        self._queue.confirm(meant, ticket, digest)
        return Receipt(
            frame=self._queue.frames,
            voxels=len(meant.lit()[0]),
            packets=self.counters.packets - before.packets,
            wire_bytes=self.counters.wire_bytes - before.wire_bytes,
            retransmitted=self.counters.retransmitted - before.retransmitted,
            elapsed_s=self._clock() - began_s,
            digest=digest,
            repaired=repaired,
        )

    def _wait_until_shown(self, ticket: int, progress: Progress | None = None) -> int | None:
        """Wait until a frame is on display; give the device's digest."""
        link, total = self._connection.link, 1
        while not self._queue.is_shown(ticket):
            self._pump()
            total = max(total, link.payload_count)
            if progress and not self._queue.encoding:
                progress(total - link.unacknowledged_payloads, total)
        return self._queue.take_digest(ticket)

    def _repair(self, frame: Frame, digest: int) -> tuple[int, str]:
        """Find out what the display shows instead, and send the frame again; give its ticket."""
        self._queue.forget_displayed()
        meant = frame.digest()
        what = describe_wrong_digest(digest, meant)
        if "read" in self.info.features:
            differs = describe_difference(frame.array(), self.read())
            what += f"; {differs or 'but its memory reads back as it was meant'}"
        ticket = self._queue.enqueue(frame)
        again = self._wait_until_shown(ticket)
        if again != meant:
            raise DesyncError(
                f"{what}; sent once more, it is {again or 0:08x}", hint=WRONG_TWICE_HINT
            )
        return ticket, what

    def poll(self) -> None:
        """Do what can be done without waiting; for callers of ``present(wait=False)``."""
        self._check_open()
        self._pump(wait=False)

    def flush(self) -> None:
        """Wait until every frame that was handed over is on display, or was skipped."""
        self._check_open()
        while self._queue.busy:
            self._pump()

    def clear(self) -> Receipt:
        """Make the display dark."""
        self._check_open()
        self.flush()
        return self._present_and_wait(Frame(self.info.grid, self.info.format), None)

    # -- asking, and reading back

    def digest(self) -> int | None:
        """Ask what is on display now.

        Returns
        -------
        int or None
            The digest of the front page (protocol.md, section 8); None if the device gives none.

        """
        self._check_open()
        self._status = None
        self._connection.link.request_status()
        while self._status is None:
            self._pump()
        return self._status.digest

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
        self._check_open()
        if "read" not in self.info.features:
            raise IncompatibleDevice(
                "this display cannot read its memory back",
                hint="its digest still proves what it shows",
            )
        connection, link = self._connection, self._connection.link
        link.cancel_reads()  # of a call that was interrupted
        self._pages.clear()
        total = self.info.grid.voxels
        values = np.zeros(total, dtype=np.uint32)
        at, renewals = 0, connection.reconnects
        while at < total:
            link.read(at, total - at, back=back)
            while not self._pages:
                self._pump()
            if renewals != connection.reconnects:  # its memory may be lost: from the start
                self.flush()
                self._pages.clear()
                at, renewals = 0, connection.reconnects
                continue
            page = self._pages.pop()
            values[at : at + page.count] = decode_spans(page.ops, page.count, self.info.format)
            at += page.count
            if progress:
                progress(at, total)
        shape = self.info.format.shape(self.info.grid.array_shape)
        return self.info.format.pixels(values).reshape(shape)

    def verify(self, frame: Frame, *, progress: Progress | None = None) -> Pixels:
        """Read the front page back and compare it with a frame, voxel by voxel.

        Parameters
        ----------
        frame : Frame
            What should be on display.
        progress : callable, optional
            As of `read`.

        Returns
        -------
        ndarray
            What was read back, as of `read`.

        Raises
        ------
        DesyncError
            If they differ, saying where.
        IncompatibleDevice
            If the device cannot read.

        """
        page = self.read(progress=progress)
        if differs := describe_difference(frame.array(), page):
            raise DesyncError(f"what was read back is not the frame: {differs}")
        return page

    # -- the end

    def _check_open(self) -> None:
        if self._connection.closed:
            raise LocalProtocolError("the display is closed")

    def close(self, *, blank: bool = False) -> None:
        """Close the port. Twice is fine.

        Parameters
        ----------
        blank : bool
            Make the display dark first; whatever is not on display yet is dropped. Otherwise the
            display keeps its last whole picture.

        Raises
        ------
        TransportError, DeviceError
            If the display could not be made dark. The port is closed all the same.

        """
        try:
            if blank and not self._connection.closed:
                self._blank()
        finally:
            self._connection.close()

    def _blank(self) -> None:
        """Show a dark frame at once: a new session drops all that is on its way."""
        self._connection.restart(_BLANK_TIMEOUT_S)
        self._queue = FrameQueue(self._connection)
        self._wait_until_shown(self._connection.link.present([]))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

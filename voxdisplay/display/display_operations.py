"""Blocking operations of an open display: show and prove a frame, read a page, ask for a digest.

They pump the connection in the caller's thread until the answer is there. Must not know who calls
them: neither threads nor closing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import numpy as np

from voxdisplay.display.connection import MAX_WAIT_S, Clock, Connection, Reconnected
from voxdisplay.display.device_info import device_error
from voxdisplay.display.flushing import Flushing
from voxdisplay.display.frame_queue import FrameQueue, Payloads
from voxdisplay.display.receipt import (
    WRONG_TWICE_HINT,
    Receipt,
    describe_difference,
    describe_wrong_digest,
)
from voxdisplay.errors import DesyncError, IncompatibleDevice
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
from voxdisplay.wire import spec
from voxdisplay.wire.packet import Page
from voxdisplay.wire.spans import decode_runs

Progress: TypeAlias = Callable[[int, int], None]
Hold: TypeAlias = Callable[[Callable[[], None]], None]
Work: TypeAlias = Callable[[], bool]
# A page is compared by its lit voxels if no more than one of so many is lit.
SPARSE_SHARE = 8


class DisplayOperations(Flushing):
    """Blocking operations on one connection.

    Parameters
    ----------
    connection : Connection
    clock : callable
        Returns seconds, on any monotonic clock.

    Attributes
    ----------
    queue : FrameQueue

    """

    queue: FrameQueue

    def __init__(self, connection: Connection, clock: Clock) -> None:
        self.queue = FrameQueue(connection)
        self._connection = connection
        self._clock = clock
        self._pages: list[Page] = []
        self._status: StatusReceived | None = None
        self._handle_events()

    @property
    def _counters(self) -> LinkCounters:
        return self._connection.link.counters

    @property
    def refresh_hz(self) -> float:
        """Refresh ticks per second; 0 if there are none."""
        return self._connection.info.refresh_hz

    @property
    def max_hold_ticks(self) -> int:
        """For how many refresh ticks a frame may be held; 0 if the device cannot hold frames."""
        info = self._connection.info
        limit = int(info.refresh_hz * spec.LIMIT_MAX_HELD / 1000)
        return min(limit, spec.LIMIT_MAX_HOLD) if "hold" in info.features else 0

    @property
    def reconnects(self) -> int:
        """Number of times that the device was gone and has come back."""
        return self._connection.reconnects

    @property
    def wire_bytes(self) -> int:
        """Bytes sent so far."""
        return self._counters.wire_bytes

    def can(self, feature: str) -> bool:
        """Return whether the device has announced a feature."""
        return feature in self._connection.info.features

    # -- waiting

    def pump(self, *, wait: bool = True, within_s: float = MAX_WAIT_S) -> None:
        """Encode a portion, write, read, and handle what came.

        It waits for nothing while a frame is being encoded.
        """
        self.queue.encode()
        self._connection.pump(wait=wait and not self.queue.encoding, within_s=within_s)
        self._handle_events()

    def send_encoded(self) -> None:
        """Pump without waiting until frames are encoded whose turn it is, and sent if they may."""
        self.pump(wait=False)  # ACKs that have come meanwhile may let the next frame begin
        while self.queue.has_work or self._connection.link.has_more:
            self.pump(wait=False)

    def _handle_events(self) -> None:
        for event in self._connection.events():
            self._handle(event)

    def _handle(self, event: Event | Reconnected) -> None:
        match event:
            case FrameShown(ticket, digest):
                self.queue.note_shown(ticket, digest, self._clock())
            case Reconnected():
                self.queue.note_reconnect()
            case StatusReceived():
                self._status = event
            case PageReceived(page):
                self._pages.append(page)
            case PacketRefused(error):
                self.queue.note_refusal()
                raise device_error(error)

    # -- frames

    def show(self, frame: Frame, progress: Progress | None, hold: Hold | None = None) -> Receipt:
        """Show a frame and compare the digest. See `Display.present`.

        Parameters
        ----------
        frame, progress
            As of `Display.present`.
        hold : callable, optional
            Called when the device has all of the frame but its COMMIT, with a function that sends
            that, in any thread while this one waits. It returns when that was called.

        """
        began_s = self._clock()
        before = replace(self._counters)
        frame = frame.copy()
        ticket = self.queue.enqueue(frame, held=hold is not None)
        self.queue.playback.note_presented()
        if hold is not None:
            self._wait_until_held(ticket, progress)
            self.release(ticket, hold)
        digest = self.wait_until_shown(ticket, progress)
        repaired = None
        if digest is not None and digest != frame.digest():
            ticket, repaired = self._repair(frame, digest)
            digest = frame.digest()
        self.queue.confirm(frame, ticket, digest, self._clock())
        counters = self._counters
        return Receipt(
            frame=self.queue.frames,
            voxels=len(frame.lit()[0]),
            packets=counters.packets - before.packets,
            wire_bytes=counters.wire_bytes - before.wire_bytes,
            retransmitted=counters.retransmitted - before.retransmitted,
            elapsed_s=self._clock() - began_s,
            digest=digest,
            repaired=repaired,
        )

    def start_held(
        self, frame: Frame, payloads: Payloads | None = None, work: Work | None = None
    ) -> int:
        """Start a frame that nobody waits for; return its ticket when only its COMMIT is left.

        Parameters
        ----------
        frame : Frame
            It must not change.
        payloads : iterator of list of bytes, optional
            From `encode`, as far as it was encoded before.
        work : callable, optional
            Called while the frame is on its way, for a few milliseconds of work on another one;
            returns whether there was any.

        """
        ticket = self.queue.start_unwaited(frame, held=True, payloads=payloads)
        self._wait_until_held(ticket, work=work)
        return ticket

    def encode(self, frame: Frame) -> Payloads:
        """Return an iterator that encodes a frame in portions, for `start_held`."""
        return self.queue.iter_payloads(frame)

    def release(self, ticket: int, hold: Hold) -> None:
        """Have the COMMIT of a held frame sent by `hold`: see `show`."""
        hold(partial(self._commit, ticket))

    def _commit(self, ticket: int) -> None:
        self.queue.release(ticket)
        self._connection.write_now()

    def _wait_until_held(
        self, ticket: int, progress: Progress | None = None, work: Work | None = None
    ) -> None:
        while self.queue.encoding:  # at its end, a frame without ops is held without any answer
            self.pump(wait=False)
        link, total = self._connection.link, 1
        while not self.queue.is_held(ticket):
            self.pump(wait=work is None or not work())
            total = max(total, link.payload_count)
            if progress:
                progress(total - link.unacknowledged_payloads, total)

    def wait_until_shown(self, ticket: int, progress: Progress | None = None) -> int | None:
        """Wait until a frame is displayed and return the device's digest."""
        link, total = self._connection.link, 1
        while not self.queue.is_shown(ticket):
            self.pump()
            total = max(total, link.payload_count)
            if progress and not self.queue.encoding:
                progress(total - link.unacknowledged_payloads, total)
        return self.queue.take_digest(ticket)

    def _repair(self, frame: Frame, digest: int) -> tuple[int, str]:
        """Send a frame again; return its ticket, and what the display showed instead.

        Raises
        ------
        DesyncError
            If it is displayed wrongly again.

        """
        self.queue.forget_displayed()
        expected = frame.digest()
        fault = describe_wrong_digest(digest, expected)
        if self.can("read"):
            differs = self._difference(frame, self.read_page())
            fault += f"; {differs or 'but its memory reads back as it was meant'}"
        ticket = self.queue.enqueue(frame)
        again = self.wait_until_shown(ticket)
        if again != expected:
            raise DesyncError(
                f"{fault}; sent once more, it is {again or 0:08x}", hint=WRONG_TWICE_HINT
            )
        return ticket, fault

    def displayed_frame(self, blank: Frame) -> Frame:
        """Return what is displayed, from memory or read back from the device.

        Parameters
        ----------
        blank : Frame
            Receives the pixels if they must be read back.

        Raises
        ------
        IncompatibleDevice
            If it is not known and the device cannot be read.

        """
        if displayed := self.queue.displayed:
            return displayed
        if not self.can("read"):
            raise IncompatibleDevice(
                "it is not known what is on display, and this device cannot be read",
                hint="present a whole frame first: display.frame() without keep",
            )
        link = self._connection.link
        picture = link.displayed
        page = self.read_page()
        if blank.output is not None:
            if blank.output.dims:
                raise IncompatibleDevice(
                    "it is not known what is on display, and its memory holds dimmed light",
                    hint="present a whole frame first: display.frame() without keep",
                )
            page = blank.output.to_user(page)
        blank.set(page)
        # A palette cannot be read back; without it the frame is no base for a difference.
        if picture == link.displayed and not self.can("palette"):
            self.queue.set_displayed(blank.copy(), picture)
        return blank

    # -- questions

    def request_digest(self) -> int | None:
        """Return the digest of the front page. See `Display.digest`."""
        self._status = None
        self._connection.link.request_status()
        while self._status is None:
            self.pump()
        return self._status.digest

    def read_page(self, *, back: bool = False, progress: Progress | None = None) -> Pixels:
        """Return a page of the device's memory. See `Display.read`."""
        page, _ = self._read_lit(back=back, progress=progress)
        return page

    def read_and_compare(self, frame: Frame, progress: Progress | None) -> tuple[Pixels, str]:
        """Return the front page, as memory holds it, and where it differs from a frame, or ""."""
        page, lit = self._read_lit(back=False, progress=progress)
        if lit * SPARSE_SHARE <= frame.grid.voxels:
            index, values = frame.memory.lit()
            pixels = page.reshape(frame.format.shape((frame.grid.voxels,)))
            # As many lit voxels, and all of the frame's among them: there are no others.
            if len(index) == lit and np.array_equal(pixels[index], frame.format.pixels(values)):
                return page, ""
        return page, self._difference(frame, page)

    @staticmethod
    def _difference(frame: Frame, page: Pixels) -> str:
        """Return where a page of the memory differs from a frame, in the frame's coordinates."""
        seen = page if frame.output is None else frame.output.to_user(page)
        return describe_difference(frame.readback(), seen)

    def _read_lit(self, *, back: bool, progress: Progress | None) -> tuple[Pixels, int]:
        """Return a page of the device's memory, and how many of its voxels are lit."""
        connection, link, info = self._connection, self._connection.link, self._connection.info
        link.cancel_reads()  # of a call that was interrupted
        self._pages.clear()
        total = info.grid.voxels
        # Only what is lit is written to: the rest of a large page takes no memory.
        pixels = np.zeros(info.format.shape((total,)), dtype=info.format.dtype)
        at, lit, reconnects = 0, 0, connection.reconnects
        while at < total:
            link.read(at, total - at, back=back)
            while not self._pages:
                self.pump()
            if reconnects != connection.reconnects:  # the device may have lost its memory
                self.flush()
                self._pages.clear()
                pixels[:at] = 0
                at, lit, reconnects = 0, 0, connection.reconnects
                continue
            page = self._pages.pop()
            for start, run in decode_runs(page.ops, page.count, info.format):
                lit += int(np.count_nonzero(run))
                pixels[at + start : at + start + len(run)] = info.format.pixels(run)
            at += page.count
            if progress:
                progress(at, total)
        return pixels.reshape(info.format.shape(info.grid.array_shape)), lit

    def blank(self, timeout_s: float) -> None:
        """Show a dark frame at once: a new session drops all that is queued.

        Parameters
        ----------
        timeout_s : float
            How long the device may be silent, besides the time for bytes that are on the line.

        """
        self._connection.restart(timeout_s)
        self.queue = FrameQueue(self._connection)
        self.wait_until_shown(self._connection.link.present([]))

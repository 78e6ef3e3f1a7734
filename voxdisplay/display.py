"""A display as its user sees it: frames in, proof out.

`Display` pumps one `Link` over one `Transport`, blocking, in the caller's thread: the only one.
It writes only what the device has room for, so that writing cannot block against the device's
answers. It knows when to wait and what to compare; how bytes are made is the business of others.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from types import TracebackType
from typing import Literal, Self, TextIO

import numpy as np
from numpy.typing import NDArray

from voxdisplay.baud import DEFAULT_BAUD, open_at
from voxdisplay.device import DeviceInfo, device_error, device_info
from voxdisplay.errors import (
    DesyncError,
    IncompatibleDevice,
    LocalProtocolError,
    TransportClosed,
    TransportError,
    TransportTimeout,
)
from voxdisplay.frame import Frame
from voxdisplay.link import (
    Event,
    Link,
    LinkCounters,
    OnDisplay,
    PageRead,
    Ready,
    Refused,
    Shown,
    Told,
)
from voxdisplay.pixel import Pixels
from voxdisplay.probe import new_session, said_before
from voxdisplay.reconnect import Reconnect
from voxdisplay.transport import Transport
from voxdisplay.transport.capture import Capture
from voxdisplay.wire.packet import Info, Page
from voxdisplay.wire.spans import decode_spans

TIMEOUT_S = 5.0
_LONGEST_WAIT_S = 0.5
# Range coding saves about a bit a voxel and takes some 5 us for it: it pays below this.
_SLOW_BYTES_PER_S = 25_000
_LAST_S = 2.0  # for a last dark picture
# So many lit voxels for a byte of difference, and the whole frame surely takes more bytes.
_NEXT_TO_NOTHING = 64
# One that the device shows at its next tick, and one behind it.
_MOST_UNSHOWN = 2
_WRONG_TWICE = "the device does not draw what protocol.md says, or its memory is faulty"
_NOTHING: OnDisplay = (0, 0)  # is never on display
Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class Receipt:
    """What it took to show a frame.

    Attributes
    ----------
    frame : int
        Number of the frame on this display handle, from 1.
    voxels : int
        Lit voxels.
    packets, retransmitted : int
        DATA packets, and how many had to be sent again.
    wire_bytes : int
        All bytes sent.
    elapsed_s : float
        From handing the frame over to the device's word that it is on display.
    digest : int or None
        What the device says it shows; it has been compared. None if the device gives none.
    repaired : str or None
        What the display showed at first, if that was something else and the frame was sent again.

    """

    frame: int
    voxels: int
    packets: int
    wire_bytes: int
    retransmitted: int
    elapsed_s: float
    digest: int | None
    repaired: str | None = None


def open(  # noqa: A001 - as the built-in: vd.open(port)
    port: str | Transport,
    *,
    baud: int | Literal["auto"] = DEFAULT_BAUD,
    timeout_s: float = TIMEOUT_S,
    reconnect_s: float = 0.0,
    note: Callable[[str], None] | None = None,
    capture: TextIO | None = None,
) -> Display:
    """Open a display: the port, and a session with the device behind it.

    Parameters
    ----------
    port : str or Transport
        ``sim:``, ``/dev/ttyUSB0``, ``COM3``, ``tcp://host:port``, a URL of pyserial, or an open
        pipe, which is closed with the display.
    baud : int or "auto"
        Bits per second of a serial line; ``"auto"`` for the fastest common one at which the device
        answers: see `voxdisplay.baud`.
    timeout_s : float
        How long the device may be silent.
    reconnect_s : float
        How long a device that is pulled out is waited for. When the same device is back, it gets
        its picture again, whole, and all goes on. 0: it is not waited for.
    note : callable, optional
        Is told, in a line, when a device is lost and when it is back, and what rate was found.
    capture : text file, optional
        Gets all bytes to and from the device, with times: see `voxdisplay.transport.capture`.

    Raises
    ------
    OpenError
        If the port cannot be opened.
    TransportTimeout
        If nothing behind it answers HELLO.
    IncompatibleDevice
        If it speaks another protocol major, or has a pixel format we do not know.

    """
    note = note or (lambda _text: None)
    transport = open_at(port, baud, timeout_s, note) if isinstance(port, str) else port
    try:
        reconnect = None
        if reconnect_s:
            rate = getattr(transport, "baud", DEFAULT_BAUD)
            reconnect = Reconnect(transport.port, reconnect_s, baud=rate, note=note)
        return Display(transport, timeout_s=timeout_s, reconnect=reconnect, capture=capture)
    except BaseException:
        transport.close()
        raise


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

    Attributes
    ----------
    info : DeviceInfo
        What the device said of itself.
    port : str
        The name the pipe was opened by.

    """

    def __init__(
        self,
        transport: Transport,
        *,
        timeout_s: float = TIMEOUT_S,
        reconnect: Reconnect | None = None,
        capture: TextIO | None = None,
    ) -> None:
        self.port = transport.port
        self._capture = capture
        self._transport = self._captured(transport)
        self._reconnect: Reconnect | None = None  # not before the device is known
        self._renewals = 0
        self._last: Frame | None = None  # that was shown
        self._timeout_s = timeout_s
        self._closed = False
        self._frames = 0
        self._shown: dict[int, int | None] = {}  # ticket -> digest
        self._unwaited: dict[int, Frame] = {}  # ticket -> the frame, as it was
        self._known: _Known | None = None
        self._newest: Frame | None = None  # handed over, and not begun
        self._coder: _Coder | None = None
        self._wrong = 0  # frames that nobody waited for, in a row
        self._pages: list[Page] = []
        self._told: Told | None = None
        self._events: deque[Event] = deque()
        self._link = Link(new_session(), time.monotonic(), patience_s=timeout_s)
        self.info = self._greet()
        self._reconnect = reconnect

    # -- the session

    def _greet(self) -> DeviceInfo:
        try:
            while not self._link.ready:
                self._turn()
        except TransportTimeout as error:
            raise TransportTimeout(f"{self.port}: {error}", hint=error.hint) from error
        except TransportClosed as error:
            raise said_before(error, self._link.stream.noise) from error
        assert self._link.info is not None  # noqa: S101 - ready
        return device_info(self._link.info)

    def _turn(self, *, wait: bool = True) -> None:
        """Write what may be written, wait for an answer or the time to ask, take what comes.

        It does not wait while there is something to be coded: then it does a part of that.
        """
        self._code()
        try:
            self._exchange(wait=wait and self._coder is None)
        except (TransportClosed, TransportTimeout) as error:
            self._renew(error)
        while self._events:
            self._take(self._events.popleft())

    def _exchange(self, *, wait: bool) -> None:
        if out := self._link.transmit(time.monotonic()):
            self._transport.write(out, self._timeout_s)
        wait_s = self._link.next_timeout(time.monotonic()) if wait else 0.0
        wait_s = _LONGEST_WAIT_S if wait_s is None else min(wait_s, _LONGEST_WAIT_S)
        data = self._transport.read(wait_s)
        self._events += self._link.receive(data, time.monotonic())

    def _code(self) -> None:
        """Code a part of a frame; begin the newest if there is none and the line needs it."""
        if self._newest and not self._coder and self._may_begin:
            frame, self._newest = self._newest, None
            self._unwaited[self._hand_over(frame)] = frame
        if coder := self._coder:
            payloads = next(coder.payloads, None)
            self._link.supply(coder.ticket, payloads or [], last=payloads is None)
            if payloads is None:
                self._coder = None

    @property
    def _may_begin(self) -> bool:
        """Whether another frame keeps the line busy; more would make the display lag behind."""
        return self._link.ready and self._link.backlog < _MOST_UNSHOWN and self._link.hungry

    def _renew(self, error: TransportError) -> None:
        """Wait for the device to come back, and have it show again what it showed."""
        if self._reconnect is None:
            raise error
        self._transport.close()
        self._transport = self._captured(self._reconnect.wait(error, self.info.serial))
        self.port = self._transport.port
        self._renewals += 1
        self._link.renew(time.monotonic())
        if self._last and not self._link.backlog:
            # Coded when the device is there, and its line known.
            whole = partial(self._payloads, self._last)
            self._unwaited[self._link.present_on(_NOTHING, [], whole)] = self._last

    def _captured(self, transport: Transport) -> Transport:
        return Capture(transport, self._capture) if self._capture else transport

    def _take(self, event: Event) -> None:
        if self._reconnect and isinstance(event, Shown | PageRead):
            self._reconnect.settled()
        match event:
            case Ready(info) if self._link.counters.sessions > 1:
                self._check_same(info)
            case Shown(ticket, digest) if ticket in self._unwaited:
                self._settle(ticket, digest)
            case Shown(ticket, digest):
                self._shown[ticket] = digest
            case Told():
                self._told = event
            case PageRead(page):
                self._pages.append(page)
            case Refused(error):
                self._coder = None
                raise device_error(error)

    def _check_same(self, info: Info) -> None:
        """Refuse another device behind the same port: what waits to be sent is not for it."""
        try:
            self.info = _same(self.info, device_info(info))
        except IncompatibleDevice:
            self.close()
            raise

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
            frame = self._kept().copy()
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

    def _kept(self) -> Frame:
        """Give what is on display, from memory or from the device."""
        if self._known and self._known.place == self._link.on_display:
            return self._known.frame
        if "read" not in self.info.features:
            raise IncompatibleDevice(
                "it is not known what is on display, and this device cannot be read",
                hint="present a whole frame first: display.frame() without keep",
            )
        place = self._link.on_display
        frame = self.frame()
        frame.set(self.read())
        # What else its palette shows, nobody can tell: then it is no base for a difference.
        if place == self._link.on_display and "palette" not in self.info.features:
            self._known = _Known(frame.copy(), place)
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
            self._present_newest(frame)
            return None
        self.flush()
        return self._present_and_wait(frame, progress)

    def _present_and_wait(self, frame: Frame, progress: Progress | None) -> Receipt:
        began_s = time.monotonic()
        before = _Sent.of(self._link)
        meant = frame.copy()
        ticket = self._hand_over(meant)
        digest = self._shown_digest(ticket, progress)
        repaired = None
        if digest is not None and digest != meant.digest():
            ticket, repaired = self._repair(meant, digest)
            digest = meant.digest()
        self._last = meant
        self._frames += 1
        self._know(meant, ticket, digest)
        sent = _Sent.of(self._link)
        return Receipt(
            frame=self._frames,
            voxels=len(meant.lit()[0]),
            packets=sent.packets - before.packets,
            wire_bytes=sent.wire_bytes - before.wire_bytes,
            retransmitted=sent.retransmitted - before.retransmitted,
            elapsed_s=time.monotonic() - began_s,
            digest=digest,
            repaired=repaired,
        )

    def _payloads(self, frame: Frame) -> list[bytes]:
        return frame.payloads(self._link.payload_bytes, self._worth_using)

    @property
    def _bytes_per_s(self) -> float | None:
        return self._link.bytes_per_s or getattr(self._transport, "bytes_per_s", None)

    @property
    def _worth_using(self) -> tuple[str, ...]:
        """What the device announced, but for ARC on a line that is faster than its coder."""
        rate = self._bytes_per_s
        if rate is not None and rate < _SLOW_BYTES_PER_S:
            return self.info.features
        return tuple(name for name in self.info.features if name != "arc")

    def _hand_over(self, frame: Frame) -> int:
        """Give a frame to the link: whole, or as its difference from what is on display."""
        known = self._known
        if known and known.place == self._link.on_display and not self._link.backlog:
            whole = cache(partial(self._payloads, frame))
            lit = len(frame.lit()[0])
            if 2 * len(frame.changed(known.frame)) < lit:
                most, features = self._link.payload_bytes, self._worth_using
                payloads = frame.difference(known.frame, most, features)
                size = sum(map(len, payloads))
                # Where there is next to nothing to be sent, the whole frame need not be coded.
                if size * _NEXT_TO_NOTHING < lit or size < sum(map(len, whole())):
                    return self._link.present_on(known.place, payloads, whole)
                return self._link.present(whole())
        ticket = self._link.begin()
        coded = frame.coded(self._link.payload_bytes, self._worth_using, self._bytes_per_s or 0.0)
        self._coder = _Coder(ticket, coded)
        return ticket

    def _shown_digest(self, ticket: int, progress: Progress | None = None) -> int | None:
        """Wait until a frame is on display; give the device's digest."""
        total = 1
        while ticket not in self._shown:
            self._turn()
            total = max(total, self._link.payloads_in_all)
            if progress and not self._coder:
                progress(total - self._link.payloads_left, total)
        return self._shown.pop(ticket)

    def _know(self, frame: Frame, ticket: int, digest: int | None) -> None:
        """Note that a frame is on display, if the device has proved it."""
        place = self._link.counters.sessions, ticket
        self._known = None if digest is None else _Known(frame, place)

    def _repair(self, frame: Frame, digest: int) -> tuple[int, str]:
        """Find out what the display shows instead, and send the frame again; give its ticket."""
        self._known = None
        meant = frame.digest()
        what = _wrong_digest(digest, meant)
        if "read" in self.info.features:
            difference = _difference(frame.array(), self.read())
            what += f"; {difference or 'but its memory reads back as it was meant'}"
        ticket = self._hand_over(frame)
        again = self._shown_digest(ticket)
        if again != meant:
            raise DesyncError(
                f"{what}; sent once more, it is {again or 0:08x}",
                hint=_WRONG_TWICE,
            )
        return ticket, what

    def _present_newest(self, frame: Frame) -> None:
        self._newest = frame.copy()
        self.poll()

    def _settle(self, ticket: int, digest: int | None) -> None:
        """Note that a frame which nobody waited for is on display, and all before it are over."""
        frame = self._unwaited[ticket]
        again = frame is self._last  # after a renewal, or as it was shown wrongly
        self._last, self._known = frame, None
        self._unwaited = {later: f for later, f in self._unwaited.items() if later > ticket}
        self._frames += not again
        if digest is None or digest == (meant := frame.digest()):
            self._wrong = 0
            self._know(frame, ticket, digest)
            return
        self._wrong += 1
        if self._wrong > 1:
            raise DesyncError(_wrong_digest(digest, meant), hint=_WRONG_TWICE)
        if not (self._link.backlog or self._newest):  # else the next one mends it
            self._newest = frame

    def poll(self) -> None:
        """Do what can be done without waiting; for callers of ``present(wait=False)``."""
        self._check_open()
        self._turn(wait=False)

    def flush(self) -> None:
        """Wait until every frame that was handed over is on display, or was skipped."""
        self._check_open()
        while self._link.backlog or self._newest:
            self._turn()

    def clear(self) -> Receipt:
        """Make the display dark."""
        self._check_open()
        self.flush()
        return self._present_and_wait(Frame(self.info.grid, self.info.format), None)

    # -- asking, and reading back

    @property
    def counters(self) -> LinkCounters:
        """What the link has done so far."""
        return self._link.counters

    def digest(self) -> int | None:
        """Ask what is on display now.

        Returns
        -------
        int or None
            The digest of the front page (protocol.md, section 8); None if the device gives none.

        """
        self._check_open()
        self._told = None
        self._link.ask()
        while self._told is None:
            self._turn()
        return self._told.digest

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
        self._link.forget_reads()  # of a call that was interrupted
        self._pages.clear()
        total = self.info.grid.voxels
        values = np.zeros(total, dtype=np.uint32)
        at, renewals = 0, self._renewals
        while at < total:
            self._link.read(at, total - at, back=back)
            while not self._pages:
                self._turn()
            if renewals != self._renewals:  # it may have lost its memory: once more, from the start
                self.flush()
                self._pages.clear()
                at, renewals = 0, self._renewals
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
        difference = _difference(frame.array(), page)
        if difference:
            raise DesyncError(f"what was read back is not the frame: {difference}")
        return page

    # -- the end

    def _check_open(self) -> None:
        if self._closed:
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
        if self._closed:
            return
        try:
            if blank:
                self._blank()
        finally:
            self._closed = True
            self._transport.close()

    def _blank(self) -> None:
        """Show a dark frame at once: a new session drops all that is on its way."""
        self._reconnect = None
        self._timeout_s = min(self._timeout_s, _LAST_S)
        self._unwaited.clear()
        self._events.clear()
        self._known = self._last = self._newest = self._coder = None
        self._link = Link(new_session(), time.monotonic(), patience_s=self._timeout_s)
        self._greet()
        self._shown_digest(self._link.present([]))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


@dataclass(frozen=True, slots=True)
class _Coder:
    """A frame that is being coded: its payloads as they are ready, and the link's ticket."""

    ticket: int
    payloads: Iterator[list[bytes]]


@dataclass(frozen=True, slots=True)
class _Known:
    """A frame that is on display, as long as what the link says of the place is the same."""

    frame: Frame
    place: OnDisplay


@dataclass(frozen=True, slots=True)
class _Sent:
    packets: int
    wire_bytes: int
    retransmitted: int

    @classmethod
    def of(cls, link: Link) -> _Sent:
        counters = link.counters
        return cls(counters.packets, counters.wire_bytes, counters.retransmitted)


def _wrong_digest(digest: int, meant: int) -> str:
    return f"the display's digest is {digest:08x}, the frame's {meant:08x}"


def _same(before: DeviceInfo, now: DeviceInfo) -> DeviceInfo:
    if (now.grid, now.format) != (before.grid, before.format):
        raise IncompatibleDevice(
            f"the device came back as another: {now.grid} {now.format.value}, "
            f"it was {before.grid} {before.format.value}"
        )
    if missing := set(before.features) - set(now.features):
        raise IncompatibleDevice(f"the device came back without {', '.join(sorted(missing))}")
    if now.max_payload_bytes < before.max_payload_bytes:
        raise IncompatibleDevice("the device came back with less room for a packet")
    return now


def _difference(meant: NDArray[np.generic], got: NDArray[np.generic]) -> str:
    """Say where two arrays [z, y, x] differ, in one line; nothing if they do not."""
    differs = meant != got
    if differs.ndim == 4:
        differs = differs.any(axis=-1)
    places = np.argwhere(differs)
    if len(places) == 0:
        return ""
    z, y, x = places[0].tolist()
    return (
        f"{len(places)} voxels differ, the first at ({x}, {y}, {z}): "
        f"{got[z, y, x]} instead of {meant[z, y, x]}"
    )

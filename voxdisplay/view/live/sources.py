"""Sources of pictures: the emulator's tap, a display that is read back, or one still picture.

A source waits, in a thread of its own, until the display shows something else; it is used only
while somebody watches. Knows no browser.
"""

from __future__ import annotations

import contextlib
import selectors
import socket
import struct
import threading
from collections.abc import Callable, Hashable
from typing import Protocol

import numpy as np

from voxdisplay.errors import OpenError, TransportClosed
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.palette import DEFAULT
from voxdisplay.raster.pixel_format import PixelFormat, Pixels
from voxdisplay.view.live.snapshot_message import Snapshot

_POLL_S = 0.05
# A display without a digest is read whole to find out whether it shows something else.
_FULL_READ_POLL_S = 0.5
_CONNECT_S = 5.0
_STALL_S = 10.0  # without a byte, in the middle of a picture


class Source(Protocol):
    """Interface of every source of pictures."""

    def next(self) -> tuple[Hashable, Snapshot]:
        """Wait for another picture than the last one; return a key that identifies it, and it.

        Raises
        ------
        VoxDisplayError
            If there will be no more.

        """

    def resend(self) -> None:
        """Make `next` return what is on display now, even if it was returned before."""

    def check_alive(self) -> None:
        """Check, without waiting, that there can be further pictures.

        Raises
        ------
        VoxDisplayError
            If not.

        """

    def close(self) -> None:
        """Release resources; called from another thread, it ends a `next` that waits."""


class TapSource:
    """The emulator's tap; its format stands in the first paragraphs of ``firmware_sim/tap.py``.

    Parameters
    ----------
    host, port
        Address of the tap.
    title : str
        Heading of its pictures.

    Raises
    ------
    OpenError
        If nothing accepts connections there.

    """

    _QUESTION = struct.Struct("<HI")
    _HEADER = struct.Struct("<4sHHHHHHIIIIII")
    _MAGIC = b"VXT1"
    _NOTHING = (0xFFFF, 0xFFFFFFFF)
    _COUNTED = ("Packets", "Refused", "Damaged", "Overruns")

    def __init__(self, host: str, port: int, title: str) -> None:
        self._name = f"the emulator's tap at {host}:{port}"
        self._title = title
        self._last_seen = self._NOTHING
        try:
            self._socket = socket.create_connection((host, port), _CONNECT_S)
        except OSError as error:
            raise OpenError(f"{self._name} cannot be reached: {error}", port=self._name) from error
        self._socket.settimeout(None)

    def resend(self) -> None:
        """See `Source.resend`."""
        self._last_seen = self._NOTHING

    def next(self) -> tuple[Hashable, Snapshot]:
        """See `Source.next`."""
        try:
            self._socket.sendall(self._QUESTION.pack(*self._last_seen))
            self._socket.settimeout(None)  # it answers when something else is on display
            first = self._receive(1)
            self._socket.settimeout(_STALL_S)
            header = self._HEADER.unpack(first + self._receive(self._HEADER.size - 1))
            magic, boot, _frame, nx, ny, nz, number, swaps, digest, *counts = header
            format_ = PixelFormat.from_wire(number)
            if magic != self._MAGIC or format_ is None:
                raise TransportClosed(
                    f"{self._name} is no tap of this version: it began with {magic!r}"
                )
            grid = Grid(nx, ny, nz)
            data = self._receive(grid.voxels * format_.bytes)
            palette = None
            if format_ is PixelFormat.INDEX8:
                palette = np.frombuffer(self._receive(DEFAULT.size), "u1").reshape(DEFAULT.shape)
        except TimeoutError as error:
            raise TransportClosed(f"{self._name} stopped in the middle of a picture") from error
        except OSError as error:
            raise TransportClosed(f"{self._name} is gone: {error}") from error
        page = np.frombuffer(data, "<u2" if format_ is PixelFormat.RGB565 else "u1")
        self._last_seen = boot, swaps
        return self._last_seen, Snapshot(
            page.reshape(format_.shape(grid.array_shape)),
            grid,
            format_,
            swaps,
            self._title,
            digest,
            dict(zip(self._COUNTED, counts, strict=True)),
            palette,
            port=self._title,
        )

    def check_alive(self) -> None:
        """See `Source.check_alive`. A tap sends nothing unasked: readable means closed."""
        try:
            with selectors.DefaultSelector() as selector:
                selector.register(self._socket, selectors.EVENT_READ)
                closed = bool(selector.select(0))
        except (OSError, ValueError) as error:  # ValueError: it was closed here
            raise TransportClosed(f"{self._name} is gone: {error}") from error
        if closed:
            raise TransportClosed(f"{self._name} is gone")

    def _receive(self, size: int) -> bytearray:
        data = bytearray(size)
        view = memoryview(data)
        while view:
            got = self._socket.recv_into(view)
            if not got:
                raise TransportClosed(f"{self._name} is gone")
            view = view[got:]
        return data

    def close(self) -> None:
        """See `Source.close`."""
        with contextlib.suppress(OSError):  # it is gone already
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()


class ReadableDisplay(Protocol):
    """The part of `Display` that a source uses."""

    port: str

    def digest(self) -> int | None:
        """Return the digest of the front page."""

    def read(self) -> Pixels:
        """Return the front page."""


class DisplaySource:
    """An open display: its digest is polled, and its page read back when that has changed.

    Parameters
    ----------
    display : Readable
        It belongs to the source: no other thread may use it.
    grid : Grid
    format : PixelFormat
    counters : callable
        Returns counters of the link, by names for users.

    """

    def __init__(
        self,
        display: ReadableDisplay,
        grid: Grid,
        format: PixelFormat,  # noqa: A002 - as the option --format
        counters: Callable[[], dict[str, int]] = dict,
    ) -> None:
        self._display = display
        self._grid, self._format = grid, format
        self._counters = counters
        self._last: Snapshot | None = None
        self._delivered = False  # `_last` was returned by `next` since `resend`
        self._closing = threading.Event()

    def resend(self) -> None:
        """See `Source.resend`."""
        self._delivered = False

    def next(self) -> tuple[Hashable, Snapshot]:
        """See `Source.next`."""
        while True:
            digest = self._display.digest()
            if self._last is None or digest is None or digest != self._last.digest:
                self._read_page(digest)
            if self._last and not self._delivered:
                self._delivered = True
                return self._last.number, self._last
            if self._closing.wait(_POLL_S if digest is not None else _FULL_READ_POLL_S):
                raise TransportClosed(f"{self._display.port} is closed")

    def _read_page(self, digest: int | None) -> None:
        """Read the page back; keep it if it differs."""
        page, last = self._display.read(), self._last
        if last and digest is None and np.array_equal(page, np.asarray(last.page)):
            return
        self._delivered = False
        number = last.number + 1 if last else 1
        self._last = Snapshot(
            page, self._grid, self._format, number, self._display.port, digest, self._counters()
        )

    def check_alive(self) -> None:
        """See `Source.check_alive`. An idle display is not polled."""

    def close(self) -> None:
        """See `Source.close`."""
        self._closing.set()


class StaticSource:
    """One picture that does not change."""

    def __init__(self, snapshot: Snapshot) -> None:
        self._snapshot = snapshot
        self._delivered = False
        self._closing = threading.Event()

    def resend(self) -> None:
        """See `Source.resend`."""
        self._delivered = False

    def next(self) -> tuple[Hashable, Snapshot]:
        """See `Source.next`."""
        if self._delivered:
            self._closing.wait()
            raise TransportClosed(f"{self._snapshot.title} is closed")
        self._delivered = True
        return self._snapshot.number, self._snapshot

    def check_alive(self) -> None:
        """See `Source.check_alive`. There is nothing to check."""

    def close(self) -> None:
        """See `Source.close`."""
        self._closing.set()

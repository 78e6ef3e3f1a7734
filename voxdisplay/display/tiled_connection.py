"""Parts of one display as a connection: threads that drive them, what they announce together.

Stands in for `Connection`. Must not know frames in flight.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from dataclasses import fields
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

import numpy as np

from voxdisplay.display.device_info import DeviceInfo
from voxdisplay.display.part_worker import PartWorker, named_error
from voxdisplay.errors import IncompatibleDevice, VoxDisplayError
from voxdisplay.frame import Frame
from voxdisplay.link import LinkCounters

if TYPE_CHECKING:
    from voxdisplay.display.connection import Clock
    from voxdisplay.display.display import Display
    from voxdisplay.display.part_layout import PartLayout
    from voxdisplay.display.part_profile import PartProfile
    from voxdisplay.raster.pixel_format import Pixels

_OPENING_WAIT_S = 0.1

PartOpener = Callable[["PartProfile", Callable[[str], None]], "Display"]


class TiledConnection:
    """Open parts of one display.

    Parameters
    ----------
    layout : PartLayout
    opener : callable
        Opens one part, given its profile and where notes go; called in a thread of its own.
    note : callable
        Called with lines of text, in the thread that uses the display.
    clock : callable
        Returns seconds.

    Attributes
    ----------
    layout : PartLayout
    workers : tuple of PartWorker
    info : DeviceInfo
        What all parts can do; the grid is that of the whole.
    closed : bool

    Raises
    ------
    VoxDisplayError
        If a part cannot be opened, or is not as its profile says; it names the part.

    """

    serial: str | None = None
    reconnects = 0
    is_away = False

    def __init__(
        self, layout: PartLayout, opener: PartOpener, note: Callable[[str], None], clock: Clock
    ) -> None:
        self.layout = layout
        self.closed = False
        self.link = self  # whose counters are asked for
        self._note = note
        self._notes: SimpleQueue[str] = SimpleQueue()
        self._changed = threading.Event()
        self._owner_pid = os.getpid()
        self._reported: set[int] = set()  # numbers of the parts that were reported to be lost
        self.workers = tuple(
            PartWorker(part, self._opener_of(part, opener), clock, self._changed.set)
            for part in layout.parts
        )
        try:
            self._wait_until_open()
            self.info = self._common_info()
        except BaseException:
            self.close()
            raise

    def _opener_of(self, part: PartProfile, opener: PartOpener) -> Callable[[], Display]:
        return lambda: opener(part, lambda text: self._notes.put(f"{part.name}: {text}"))

    def _wait_until_open(self) -> None:
        while not all(worker.opened.done() for worker in self.workers):
            self.wait_for_change(_OPENING_WAIT_S)
            self.report()
            if any(worker.opened.done() and worker.opened.exception() for worker in self.workers):
                break
        for worker in self.workers:
            if not worker.opened.done():
                continue
            error = worker.opened.exception()
            if isinstance(error, VoxDisplayError):
                raise named_error(worker.part, error)
            if error is not None:
                raise error

    def _common_info(self) -> DeviceInfo:
        infos = [worker.display.info for worker in self.workers]
        first = infos[0]
        for worker, info in zip(self.workers, infos, strict=True):
            part = worker.part
            if info.grid != part.size:
                axes = f" (axes {part.axes})" if str(part.axes) != "x,y,z" else ""
                raise IncompatibleDevice(
                    f"{part.name} ({part.port}) is a display of {info.grid}{axes}, its profile "
                    f"says {part.size}",
                    hint="write its true size into the profile, or plug in the other display",
                )
            if info.format is not first.format:
                raise IncompatibleDevice(
                    f"{part.name} ({part.port}) is a {info.format.value} display, "
                    f"{self.workers[0].part.name} a {first.format.value} one",
                    hint="the parts of one display have one pixel format",
                )
        return DeviceInfo(
            grid=self.layout.grid,
            format=first.format,
            protocol=min(info.protocol for info in infos),
            name=f"{len(infos)} displays as one",
            firmware="",
            serial="",
            refresh_hz=min(info.refresh_hz for info in infos),
            max_payload_bytes=min(info.max_payload_bytes for info in infos),
            rx_buffer_bytes=min(info.rx_buffer_bytes for info in infos),
            features=tuple(
                name for name in first.features if all(name in each.features for each in infos)
            ),
            boot=0,
        )

    # -- what a display asks of its connection

    @property
    def port(self) -> str:
        """Names of all ports."""
        return " + ".join(worker.part.port for worker in self.workers)

    @property
    def is_inherited(self) -> bool:
        """True in a process that was forked off the one that opened it."""
        return os.getpid() != self._owner_pid

    @property
    def counters(self) -> LinkCounters:
        """Sums over all parts."""
        each: Sequence[Any] = [worker.display.counters for worker in self.workers]
        return LinkCounters(
            **{
                field.name: sum(getattr(counters, field.name) for counters in each)
                for field in fields(LinkCounters)
            }
        )

    def wait_for_change(self, within_s: float) -> None:
        """Wait until something has changed in a part, and not for long."""
        self._changed.wait(within_s)
        self._changed.clear()

    def report(self) -> None:
        """Note what threads have to say, and which parts are lost."""
        while not self._notes.empty():
            self._note(self._notes.get())
        for number, worker in enumerate(self.workers):
            if worker.lost is not None and number not in self._reported:
                self._reported.add(number)
                self._note(f"{worker.part.name} is lost: {worker.lost}; the others go on")

    def cancel(self) -> None:
        """Have calls that wait raise `LocalProtocolError`, soon."""
        for worker in self.workers:
            worker.cancel()

    def close(self) -> None:
        """Close all parts. Twice is fine."""
        if self.closed:
            return
        self.closed = True
        if self.is_inherited:
            return  # there are no threads in this process
        self.cancel()
        for worker in self.workers:
            worker.close()

    # -- the whole picture

    def blank_page(self) -> Pixels:
        """Return a dark page of the whole display, [z, y, x]."""
        format_, grid = self.info.format, self.info.grid
        return np.zeros(format_.shape(grid.array_shape), dtype=format_.dtype)

    def whole_digest(self, frame: Frame) -> int:
        """Return the digest of a frame, without what lies in no part."""
        if not self.layout.hole_voxels:
            return frame.digest()
        memory = frame.memory
        index, values = memory.lit()
        shown = self.layout.covered(index)
        palette = memory.palette if memory.has_own_palette else None
        covered = Frame(memory.grid, memory.format, palette=palette)
        covered.set_voxels(index[shown], values[shown])
        return covered.digest()

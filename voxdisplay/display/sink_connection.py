"""Interface of sinks, and an open one as a connection on which nothing comes back.

Must not know protocols, wiring or sockets.
"""

from __future__ import annotations

import os
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from voxdisplay.display.device_info import DeviceInfo
from voxdisplay.link import LinkCounters
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat

_MAX_PAYLOAD_BYTES = 1024  # of frames that another process encodes for this one


class Sink(Protocol):
    """What an entry point of the group ``voxdisplay.sink`` returns.

    Attributes
    ----------
    port : str
        The name it was opened by.
    protocol : str
        Name of the protocol.
    grid : Grid
    max_fps : float
        Frames per second that it may be sent at most.

    """

    port: str
    protocol: str
    grid: Grid
    max_fps: float

    def send(self, rgb: NDArray[np.uint8]) -> tuple[int, int]:
        """Send a picture, (nz, ny, nx, 3); return the packets and bytes sent.

        Raises
        ------
        TransportError
            If the receiver is known not to take it.

        """

    def close(self) -> None:
        """Close it. Twice is fine."""


class SinkConnection:
    """Stand-in for a `Connection`: an open sink, of which only the settings are known.

    Parameters
    ----------
    sink : Sink

    """

    reconnects = 0
    is_away = False
    serial: str | None = None

    def __init__(self, sink: Sink) -> None:
        self.port = sink.port
        self.sink = sink
        self.closed = False
        self.serial: str | None = None  # that it must have, of a profile: it has none
        self.link = self  # whose counters are asked for
        self.counters = LinkCounters()
        self._owner_pid = os.getpid()
        self.info = DeviceInfo(
            grid=sink.grid,
            format=PixelFormat.RGB888,
            protocol=sink.protocol,
            name="LED cube",
            firmware="",
            serial="",
            refresh_hz=0.0,
            max_payload_bytes=_MAX_PAYLOAD_BYTES,
            rx_buffer_bytes=0,
            features=(),
            boot=0,
        )

    @property
    def is_inherited(self) -> bool:
        """True in a process that was forked from the one that opened it."""
        return os.getpid() != self._owner_pid

    def cancel(self) -> None:
        """Do nothing: no call waits for an answer."""

    def close(self) -> None:
        """Close the sink. Twice is fine."""
        if not self.closed:
            self.closed = True
            self.sink.close()

"""LED cube behind a lighting protocol: takes pictures, sends their packets, hears nothing.

Must not know frames or displays.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from voxdisplay.sinks.led_bytes import LedBytes
from voxdisplay.sinks.outputs import Output
from voxdisplay.sinks.settings import SinkSettings


class Encoder(Protocol):
    """Encoder of a protocol."""

    def encode(self, data: NDArray[np.uint8]) -> Sequence[memoryview]:
        """Return the packets of a frame from its bytes along the wire."""


class LedSink:
    """An LED cube that is sent to.

    Parameters
    ----------
    port : str
        The name it was opened by.
    protocol : str
        Name of the protocol.
    settings : SinkSettings
    encoder : Encoder
    output : Output

    Attributes
    ----------
    port, protocol : str
    grid : Grid
    max_fps : float
        Frames per second that it may be sent at most.

    """

    def __init__(
        self, port: str, protocol: str, settings: SinkSettings, encoder: Encoder, output: Output
    ) -> None:
        self.port, self.protocol = port, protocol
        self.grid, self.max_fps = settings.size, settings.fps
        self._bytes = LedBytes(settings)
        self._encoder, self._output = encoder, output

    def send(self, rgb: NDArray[np.uint8]) -> tuple[int, int]:
        """Send a picture.

        Parameters
        ----------
        rgb : (nz, ny, nx, 3) uint8 array

        Returns
        -------
        packets, wire_bytes : int
            What was sent.

        Raises
        ------
        TransportError
            If the receiver is known not to take it.

        """
        packets = self._encoder.encode(self._bytes.convert(rgb))
        self._output.send(packets)
        return len(packets), sum(map(len, packets))

    def close(self) -> None:
        """Close its way out. Twice is fine."""
        self._output.close()

"""WLED's realtime UDP: DNRGB packets.

Source: WLED's documentation, "UDP Realtime Control". Nothing says which packet is a frame's last:
WLED shows each as it comes. Must not know sockets.
"""

from __future__ import annotations

import struct
from typing import Final

import numpy as np
from numpy.typing import NDArray

from voxdisplay.sinks.packet_rows import PacketRows, equal_chunks
from voxdisplay.sinks.settings import SinkSettings

NAME: Final = "WLED"
PORT: Final = 21_324

_HEADER: Final = struct.Struct(">BBH")  # protocol, seconds, first LED
_DNRGB: Final = 4
_MAX_LEDS: Final = 489  # of a packet
_MAX_LED: Final = 0xFFFF


class WledEncoder:
    """Encoder of frames as packets of 489 LEDs.

    Parameters
    ----------
    settings : SinkSettings

    Raises
    ------
    ValueError
        If an LED's number has more than 16 bits, or the colours have a white.

    """

    def __init__(self, settings: SinkSettings) -> None:
        if settings.bytes_per_led != 3:
            raise ValueError("order: DNRGB has no white: WLED makes it of red, green and blue")
        last = settings.offset + settings.leds - 1
        if last > _MAX_LED:
            raise ValueError(f"size: the last LED would be {last}, and DNRGB ends at {_MAX_LED}")
        chunks = equal_chunks(settings.leds * 3, _MAX_LEDS * 3)
        headers = [
            _HEADER.pack(_DNRGB, settings.hold, settings.offset + number * _MAX_LEDS)
            for number in range(len(chunks))
        ]
        self._rows = PacketRows(headers, chunks)

    def encode(self, data: NDArray[np.uint8]) -> list[memoryview]:
        """Return the packets of a frame; they are valid until the next call."""
        self._rows.fill(data)
        return self._rows.packets

"""Adalight: a frame behind ``Ada``, its number of LEDs and a check byte, over a serial line.

Source: Adafruit's Adalight, as its LEDstream sketch reads it. Must not know ports.
"""

from __future__ import annotations

import struct
from typing import Final

import numpy as np
from numpy.typing import NDArray

from voxdisplay.sinks.packet_rows import Chunk, PacketRows
from voxdisplay.sinks.settings import SinkSettings

NAME: Final = "Adalight"
GREETING: Final = b"Ada\n"
"""What a board sends when it has started, and now and then while nothing comes."""

_HEADER: Final = struct.Struct(">3sHB")  # magic, number of LEDs less 1, check byte
_MAX_LEDS: Final = 1 << 16


class AdalightEncoder:
    """Encoder of frames as one message.

    Parameters
    ----------
    settings : SinkSettings

    Raises
    ------
    ValueError
        If there are too many LEDs, or the colours have a white.

    """

    def __init__(self, settings: SinkSettings) -> None:
        if settings.bytes_per_led != 3:
            raise ValueError("order: Adalight sets red, green and blue, and has no white")
        if settings.leds > _MAX_LEDS:
            raise ValueError(f"size: Adalight has at most {_MAX_LEDS} LEDs")
        number = settings.leds - 1
        check = (number >> 8) ^ (number & 0xFF) ^ 0x55
        size = 3 * settings.leds
        self._rows = PacketRows([_HEADER.pack(b"Ada", number, check)], [Chunk(0, size, size)])

    def encode(self, data: NDArray[np.uint8]) -> list[memoryview]:
        """Return the message of a frame; it is valid until the next call."""
        self._rows.fill(data)
        return self._rows.packets

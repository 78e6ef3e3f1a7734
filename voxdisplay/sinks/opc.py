"""OPC, Open Pixel Control: messages that set the colours of a channel's LEDs.

Source: openpixelcontrol.org, "Open Pixel Control protocol". Must not know sockets.
"""

from __future__ import annotations

import struct
from typing import Final

import numpy as np
from numpy.typing import NDArray

from voxdisplay.sinks.packet_rows import PacketRows, equal_chunks
from voxdisplay.sinks.settings import SinkSettings

NAME: Final = "OPC"
PORT: Final = 7890

_HEADER: Final = struct.Struct(">BBH")  # channel, command, bytes
_SET_COLORS: Final = 0
_MAX_LEDS: Final = 0xFFFF // 3  # of a message
_MAX_CHANNEL: Final = 255
_ALL_CHANNELS: Final = 0


class OpcEncoder:
    """Encoder of frames as one message for each channel.

    Parameters
    ----------
    settings : SinkSettings

    Raises
    ------
    ValueError
        If there are not so many channels, or the colours have a white.

    """

    def __init__(self, settings: SinkSettings) -> None:
        if settings.bytes_per_led != 3:
            raise ValueError("order: OPC sets red, green and blue, and has no white")
        chunks = equal_chunks(settings.leds * 3, 3 * (settings.pixels or _MAX_LEDS))
        if len(chunks) > 1 and settings.channel == _ALL_CHANNELS:
            raise ValueError(
                f"channel: 0 is all channels, and {len(chunks)} are needed: name the first, from 1"
            )
        last = settings.channel + len(chunks) - 1
        if last > _MAX_CHANNEL:
            raise ValueError(f"channel: the last would be {last}, and OPC ends at {_MAX_CHANNEL}")
        headers = [
            _HEADER.pack(settings.channel + number, _SET_COLORS, chunk.size)
            for number, chunk in enumerate(chunks)
        ]
        self._rows = PacketRows(headers, chunks)

    def encode(self, data: NDArray[np.uint8]) -> list[memoryview]:
        """Return the messages of a frame; they are valid until the next call."""
        self._rows.fill(data)
        return self._rows.packets

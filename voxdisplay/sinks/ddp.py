"""DDP, Distributed Display Protocol: data packets with an offset, the last one with PUSH.

Source: the specification of 3waylabs, "Distributed Display Protocol (DDP)", packet format. Must not
know sockets.
"""

from __future__ import annotations

import struct
from typing import Final

import numpy as np
from numpy.typing import NDArray

from voxdisplay.sinks.packet_rows import PacketRows, equal_chunks
from voxdisplay.sinks.settings import SinkSettings

NAME: Final = "DDP"
PORT: Final = 4048

# Flags, sequence, data type, destination, offset in bytes, length in bytes.
_HEADER: Final = struct.Struct(">BBBBIH")
_VERSION_1, _PUSH = 0x40, 0x01
# 0 for none: a receiver drops numbers that it has just seen, and with 1 to 15 alone those of the
# next program could be such.
_NO_SEQUENCE: Final = 0
_TYPES: Final = {3: 0x0B, 4: 0x1B}  # RGB and RGBW, 8 bits each
_DEFAULT_OUTPUT: Final = 1
_MAX_DATA: Final = 1440  # 480 LEDs of three bytes, 360 of four


class DdpEncoder:
    """Encoder of frames as packets that are shown together when the last one has come.

    Parameters
    ----------
    settings : SinkSettings

    """

    def __init__(self, settings: SinkSettings) -> None:
        width = settings.bytes_per_led
        chunks = equal_chunks(settings.leds * width, _MAX_DATA)
        headers = []
        for number, chunk in enumerate(chunks):
            push = _PUSH if number == len(chunks) - 1 else 0
            offset = settings.offset * width + number * _MAX_DATA
            fields = (_VERSION_1 | push, _NO_SEQUENCE, _TYPES[width], _DEFAULT_OUTPUT)
            headers.append(_HEADER.pack(*fields, offset, chunk.size))
        self._rows = PacketRows(headers, chunks)

    def encode(self, data: NDArray[np.uint8]) -> list[memoryview]:
        """Return the packets of a frame; they are valid until the next call."""
        self._rows.fill(data)
        return self._rows.packets

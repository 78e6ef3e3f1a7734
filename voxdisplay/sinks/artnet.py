"""Art-Net 4: ArtDmx and ArtSync packets.

Source: Art-Net 4 Protocol Release, Artistic Licence: "ArtDmx packet definition" and "ArtSync packet
definition". Must not know sockets.
"""

from __future__ import annotations

import struct
from typing import Final

import numpy as np
from numpy.typing import NDArray

from voxdisplay.sinks.packet_rows import PacketRows
from voxdisplay.sinks.settings import SinkSettings
from voxdisplay.sinks.universes import plan_universes

NAME: Final = "Art-Net"
PORT: Final = 6454
MAX_UNIVERSE: Final = 0x7FFF  # a Port-Address has 15 bits

_ID: Final = b"Art-Net\0"
_OP_DMX, _OP_SYNC = 0x5000, 0x5200
_PROTOCOL_VERSION: Final = 14
# ID, OpCode (low byte first), ProtVer, Sequence, Physical, SubUni, Net, Length.
_HEADER: Final = struct.Struct("<8sH")
_DMX: Final = struct.Struct(">HBBBBH")
_SYNC: Final = struct.Struct(">HBB")
_SEQUENCE_AT: Final = 12


class ArtNetEncoder:
    """Encoder of frames as one ArtDmx for each universe, and an ArtSync behind several.

    Parameters
    ----------
    settings : SinkSettings
    sequence : int
        Number of the first frame: any whole number. Receivers drop packets of numbers that they
        have just seen, so it should not begin anew with each program.

    Raises
    ------
    ValueError
        If the universes or the address do not suit.

    """

    def __init__(self, settings: SinkSettings, sequence: int = 0) -> None:
        universes, chunks = plan_universes(settings, 0, MAX_UNIVERSE)
        # Length is an even number, 2 to 512.
        chunks = [chunk._replace(payload=chunk.payload + chunk.payload % 2) for chunk in chunks]
        headers = [
            _HEADER.pack(_ID, _OP_DMX)
            + _DMX.pack(_PROTOCOL_VERSION, 0, 0, number & 0xFF, number >> 8, chunk.payload)
            for number, chunk in zip(universes, chunks, strict=True)
        ]
        self.universes = universes
        self._rows = PacketRows(headers, chunks)
        self._sequence = sequence
        sync = memoryview(_HEADER.pack(_ID, _OP_SYNC) + _SYNC.pack(_PROTOCOL_VERSION, 0, 0))
        self._sync = [sync] if settings.sync and len(universes) > 1 else []

    def encode(self, data: NDArray[np.uint8]) -> list[memoryview]:
        """Return the packets of a frame; they are valid until the next call."""
        self._rows.fill(data)
        # 1 to 255: 0 would say that there are no sequence numbers.
        self._rows.headers[:, _SEQUENCE_AT] = self._sequence % 255 + 1
        self._sequence += 1
        return self._rows.packets + self._sync

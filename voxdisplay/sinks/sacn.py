"""sACN, streaming ACN: E1.31 data packets and synchronization packets.

Source: ANSI E1.31-2018, tables 4-1 (data packet) and 4-2 (synchronization packet), and section 6.
Must not know sockets.
"""

from __future__ import annotations

import struct
from typing import Final

import numpy as np
from numpy.typing import NDArray

from voxdisplay.sinks.packet_rows import PacketRows
from voxdisplay.sinks.settings import SinkSettings
from voxdisplay.sinks.universes import plan_universes

NAME: Final = "sACN"
PORT: Final = 5568
MIN_UNIVERSE, MAX_UNIVERSE = 1, 63_999

_ROOT_DATA, _ROOT_EXTENDED = 0x00000004, 0x00000008
_DATA_PACKET, _EXTENDED_SYNCHRONIZATION = 0x00000002, 0x00000001
_SET_PROPERTY: Final = 0x02
_ADDRESS_AND_DATA_TYPE: Final = 0xA1
# Preamble and postamble size, identifier, flags and length, vector, CID.
_ROOT: Final = struct.Struct(">HH12sHI16s")
# Flags and length, vector, source name, priority, synchronization address, sequence, options,
# universe.
_FRAMING: Final = struct.Struct(">HI64sBHBBH")
# Flags and length, vector, address and data type, first address, increment, count, START code.
_DMP: Final = struct.Struct(">HBBHHHB")
# Flags and length, vector, sequence, synchronization address, reserved.
_SYNCHRONIZATION: Final = struct.Struct(">HIBHH")
_ROOT_LENGTH_AT, _FRAMING_AT, _SEQUENCE_AT = 16, _ROOT.size, 111
_DMP_AT: Final = _FRAMING_AT + _FRAMING.size
_SYNC_SEQUENCE_AT: Final = 44
_HEADER_BYTES: Final = _DMP_AT + _DMP.size


def _flags_and_length(length: int) -> int:
    return 0x7000 | length


def _root(vector: int, packet_bytes: int, cid: bytes) -> bytes:
    length = _flags_and_length(packet_bytes - _ROOT_LENGTH_AT)
    return _ROOT.pack(0x0010, 0, b"ASC-E1.17", length, vector, cid)


class SacnEncoder:
    """Encoder of frames as one data packet for each universe, and a synchronization packet.

    The synchronization address is the first universe. With one universe there is none.

    Parameters
    ----------
    settings : SinkSettings
    cid : bytes
        Component identifier of the sender: 16 bytes, always the same.
    source : str
        Name of the sender for persons.
    sequence : int
        As of `ArtNetEncoder`.

    Attributes
    ----------
    universes : list of int
        Of the packets, in their order; the synchronization packet is behind them.

    Raises
    ------
    ValueError
        If the universes or the address do not suit.

    """

    def __init__(
        self, settings: SinkSettings, cid: bytes, source: str = "voxdisplay", sequence: int = 0
    ) -> None:
        universes, chunks = plan_universes(settings, MIN_UNIVERSE, MAX_UNIVERSE)
        sync = universes[0] if settings.sync and len(universes) > 1 else 0
        headers = []
        for universe, chunk in zip(universes, chunks, strict=True):
            size = _HEADER_BYTES + chunk.payload
            framing = _FRAMING.pack(
                _flags_and_length(size - _FRAMING_AT), _DATA_PACKET, source.encode()[:63],
                settings.priority, sync, 0, 0, universe,
            )  # fmt: skip
            dmp = _DMP.pack(
                _flags_and_length(size - _DMP_AT), _SET_PROPERTY, _ADDRESS_AND_DATA_TYPE, 0, 1,
                1 + chunk.payload, 0,
            )  # fmt: skip
            headers.append(_root(_ROOT_DATA, size, cid) + framing + dmp)
        self.universes = universes
        self._rows = PacketRows(headers, chunks)
        self._sequence = sequence
        self._sync: bytearray | None = None
        if sync:
            size = _ROOT.size + _SYNCHRONIZATION.size
            layer = _SYNCHRONIZATION.pack(
                _flags_and_length(size - _FRAMING_AT), _EXTENDED_SYNCHRONIZATION, 0, sync, 0
            )
            self._sync = bytearray(_root(_ROOT_EXTENDED, size, cid) + layer)
            self.universes = [*universes, sync]

    def encode(self, data: NDArray[np.uint8]) -> list[memoryview]:
        """Return the packets of a frame; they are valid until the next call."""
        self._rows.fill(data)
        number = self._sequence % 256
        self._sequence += 1
        self._rows.headers[:, _SEQUENCE_AT] = number
        if self._sync is None:
            return self._rows.packets
        self._sync[_SYNC_SEQUENCE_AT] = number
        return [*self._rows.packets, memoryview(self._sync)]


def multicast_group(universe: int) -> str:
    """Return the IPv4 multicast address of a universe (E1.31, section 9.3.1)."""
    return f"239.255.{universe >> 8}.{universe & 0xFF}"

"""Incremental packet reader: delimiting, CRC check, resynchronisation (protocol.md, section 3).

Takes any bytes in any portions; those that are no packet are counted and dropped, in bounded
memory. Must not know what packets mean.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from cobs import cobs

from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec

# Longest packet, and its segment with COBS's code bytes.
_LONGEST = spec.LIMIT_MAX_PAYLOAD + spec.LIMIT_OVERHEAD
_LONGEST_SEGMENT = _LONGEST + _LONGEST // 254 + 1
_KEPT_NOISE = 64


@dataclass(slots=True)
class StreamCounters:
    """Counters of a `PacketStream`; ``noise_bytes`` are all bytes that made no packet."""

    packets: int = 0
    unknown: int = 0
    damaged: int = 0
    noise_bytes: int = 0


class PacketStream:
    """Incremental reader of packets.

    Attributes
    ----------
    counters : StreamCounters

    """

    def __init__(self) -> None:
        self.counters = StreamCounters()
        self._noise = b""
        self._segment = bytearray()
        self._searched = 0  # leading bytes known to have no 00
        self._overlong = 0

    @property
    def noise(self) -> bytes:
        """First bytes that made no packet, at most 64, including those without a 00 yet."""
        return (self._noise + bytes(self._segment[:_KEPT_NOISE]))[:_KEPT_NOISE]

    def feed(self, data: bytes) -> Iterator[packets.Packet]:
        """Take bytes; yield the packets that they complete.

        Raises
        ------
        RemoteProtocolError
            If a packet with a valid CRC breaks protocol.md. Packets after it are not lost: continue
            with ``feed(b"")``.

        """
        self._segment += data
        return self._packets()

    def _packets(self) -> Iterator[packets.Packet]:
        while (end := self._segment.find(0, self._searched)) >= 0:
            segment = bytes(self._segment[:end])
            del self._segment[: end + 1]
            self._searched = 0
            if self._overlong:
                self._drop(segment, self._overlong + end)
                self._overlong = 0
                continue
            raw = self._decode_segment(segment)
            if raw is None:
                continue
            if raw[0] >> 4 not in packets.TYPES:  # section 12: perhaps of a later version
                self.counters.unknown += 1
                continue
            self.counters.packets += 1
            yield packets.decode(raw)
        if len(self._segment) > _LONGEST_SEGMENT:
            self._keep_noise(self._segment)
            self._overlong += len(self._segment)
            self._segment.clear()
        self._searched = len(self._segment)

    def _decode_segment(self, segment: bytes) -> bytes | None:
        if len(segment) < spec.LIMIT_MIN_SEGMENT:
            self.counters.noise_bytes += len(segment)
            self._keep_noise(segment)
            return None
        try:
            raw = bytes(cobs.decode(segment))
        except cobs.DecodeError:
            raw = b""
        if len(raw) <= _LONGEST and packets.has_valid_crc(raw):
            return raw
        self._drop(segment, len(segment))
        return None

    def _drop(self, segment: bytes, size: int) -> None:
        self.counters.damaged += 1
        self.counters.noise_bytes += size
        self._keep_noise(segment)

    def _keep_noise(self, data: bytes | bytearray) -> None:
        self._noise = (self._noise + bytes(data[:_KEPT_NOISE]))[:_KEPT_NOISE]

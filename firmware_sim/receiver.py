"""From bytes on the wire to packets: segments, COBS and the check value (3, 4).

An automaton as it would run in a microcontroller: COBS is undone on the fly into one buffer of
fixed size, every 00 makes a new beginning, and it is all the same how the bytes were cut into
pieces. It knows nothing of what packets mean.
"""

from firmware_sim import spec
from firmware_sim.crc import crc32

_CHECK = spec.CRC_WIDTH // 8


class Receiver:
    """Reads segments out of a stream of bytes.

    Parameters
    ----------
    longest
        Size of the longest packet in bytes, check value included.

    Attributes
    ----------
    packet : bytes or None
        Header and payload of the segment that `read` ended, if that was a packet.
    damaged : bool
        Whether the segment that `read` ended was damaged.
    size : int
        Bytes of the current segment, or of the one just ended, without its 00.
    idle : bool
        Whether the last byte read was a 00, or none has been read.
    """

    def __init__(self, longest: int) -> None:
        self._buffer = bytearray(longest)
        self.packet: bytes | None = None
        self.damaged = False
        self.at_boundary = True
        self._begin()

    def _begin(self) -> None:
        self.size = 0
        self._length = 0  # bytes decoded
        self._left = 0  # bytes that the current group still lacks
        self._implied = False  # a 00 follows the current group, if anything does
        self._too_long = False  # the packet is too long

    def read(self, data: bytes | bytearray, at: int) -> int:
        """Read on until a segment ends, or the data.

        Parameters
        ----------
        data
            Bytes as they came.
        at
            Where to begin in `data`, before its end.

        Returns
        -------
        int
            Where to go on: behind the 00 that ended a segment, or the size of `data`.
        """
        self.packet = None
        self.damaged = False
        if self.at_boundary:
            self._begin()
        end = data.find(0, at)
        self.at_boundary = end >= 0
        if end < 0:
            end = len(data)
        self.size += end - at
        while at < end:  # a group, or as much of it as is there
            if not self._left:
                if self._implied:
                    self._append(b"\0")
                self._left = data[at] - 1
                self._implied = data[at] != 0xFF
                at += 1
            piece = data[at : min(at + self._left, end)]
            self._append(piece)
            self._left -= len(piece)
            at += len(piece)
        if not self.at_boundary:
            return end
        self._end()
        return end + 1

    def _append(self, piece: bytes | bytearray) -> None:
        length = self._length + len(piece)
        if length > len(self._buffer):
            self._too_long = True
        else:
            self._buffer[self._length : length] = piece
            self._length = length

    def _end(self) -> None:
        if self.size < spec.LIMIT_MIN_SEGMENT:
            return
        if not (self._left or self._too_long):
            body = bytes(self._buffer[: self._length - _CHECK])
            check = self._buffer[len(body) : self._length]
            if crc32(body) == int.from_bytes(check, "little"):
                self.packet = body
        self.damaged = self.packet is None

"""Packet receiver: segments, COBS and the check value (3, 4).

A state machine as it would run in a microcontroller: COBS is decoded on the fly into one buffer of
fixed size, every 00 resets it, and it does not matter how the bytes are cut into pieces. Knows
nothing of what packets mean.
"""

from firmware_sim import spec
from firmware_sim.crc import crc32

_CHECK = spec.CRC_WIDTH // 8


class Receiver:
    """Parser of a byte stream into segments.

    Parameters
    ----------
    longest
        Size of the longest packet in bytes, check value included.

    Attributes
    ----------
    packet : bytes or None
        Header and payload of the segment that `read` has ended, if it was a packet.
    damaged : bool
        True if the segment that `read` has ended was damaged.
    size : int
        Number of bytes of the current segment, or of the one just ended, without its 00.
    at_boundary : bool
        True if the last byte read was a 00, or none has been read.
    """

    def __init__(self, longest: int) -> None:
        self._buffer = bytearray(longest)
        self.packet: bytes | None = None
        self.damaged = False
        self.at_boundary = True
        self._begin()

    def _begin(self) -> None:
        self.size = 0
        self._length = 0  # number of bytes decoded
        self._left = 0  # missing bytes of the current group
        self._implied = False  # a 00 follows the current group, if anything does
        self._too_long = False  # the packet is too long

    def read(self, data: bytes | bytearray, at: int) -> int:
        """Read to the end of a segment or of the data.

        Parameters
        ----------
        data
            Any bytes of the stream.
        at
            Position in `data` at which to begin, before its end.

        Returns
        -------
        int
            Position at which to continue: behind the 00 that ended a segment, or the size of
            `data`.
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
        while at < end:  # once per group, or per part of it
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

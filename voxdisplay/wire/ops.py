"""What all coders of ops share: bytes of coordinates and counts, and the filling of payloads.

This is protocol.md, sections 2 and 7.2.
Coders produce *pieces*: ops that may begin a packet, in which case they must say where they are and
set their pen, or go on from the piece before. `fill` decides which is which. Nothing here knows
what a piece draws.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.grid import Grid
from voxdisplay.pixel import PixelFormat

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]

# Counts above this need a LEB128 behind the op byte (section 7.2).
SHORT_COUNT = 31


@dataclass(frozen=True)
class Coding:
    """What the bytes of ops depend on: the display's grid and format, and its longest payload."""

    grid: Grid
    format: PixelFormat
    max_payload: int

    @property
    def coordinate_bytes(self) -> int:
        """Bytes of one coordinate (section 2)."""
        return 1 if max(self.grid) <= 256 else 2

    @property
    def move_bytes(self) -> int:
        """Bytes of the three coordinates of a MOVE or FROM."""
        return 3 * self.coordinate_bytes

    @property
    def pen_bytes(self) -> int:
        """Bytes of a PEN op."""
        return 1 + self.format.bytes


def little_endian(values: NDArray[np.integer], size: int) -> Bytes:
    """Give values, (n,), as an (n, size) array of bytes, lowest first."""
    shifts = np.arange(size, dtype=np.uint64) * np.uint64(8)
    return (values.astype(np.uint64)[:, None] >> shifts).astype(np.uint8)


def count_op(op: int, count: int) -> bytes:
    """Give one op that carries a count, 1 <= count < 2**32."""
    rest = count - 1 - SHORT_COUNT
    if rest < 0:
        return bytes((op | count - 1,))
    out = bytearray((op | SHORT_COUNT,))
    while rest >= 0x80:
        out.append(rest & 0x7F | 0x80)
        rest >>= 7
    out.append(rest)
    return bytes(out)


def fill(first: Ints, following: Ints, limit: int) -> list[tuple[int, int]]:
    """Pack pieces into payloads, in order, each as full as it goes.

    Parameters
    ----------
    first, following : (n,) int64 arrays
        Bytes of each piece when it begins a payload, and when it goes on from the piece before.
    limit : int
        Bytes of a payload; no piece is longer.

    Returns
    -------
    list of (int, int)
        The pieces [begin, end) of each payload.

    """
    total = np.concatenate(([0], np.cumsum(following)))
    spans = []
    begin = 0
    while begin < len(first):
        room = limit - first[begin] + total[begin + 1]
        end = max(int(np.searchsorted(total, room, side="right")) - 1, begin + 1)
        spans.append((begin, end))
        begin = end
    return spans

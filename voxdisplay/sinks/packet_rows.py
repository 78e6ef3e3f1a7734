"""Packets of one frame as rows of an array: headers are written once, data by whole blocks.

Must not know protocols.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Chunk(NamedTuple):
    """Share of the data that one packet carries.

    Attributes
    ----------
    lead : int
        Bytes between the header and the data, which stay 0.
    size : int
        Bytes of data.
    payload : int
        Bytes behind the header in all: lead, data, and padding.

    """

    lead: int
    size: int
    payload: int


def equal_chunks(total: int, most: int) -> list[Chunk]:
    """Return chunks for so many bytes, all of the largest size but the last."""
    sizes = [min(most, total - begin) for begin in range(0, total, most)]
    return [Chunk(0, size, size) for size in sizes]


class PacketRows:
    """Packets whose data are replaced for each frame.

    Parameters
    ----------
    headers : sequence of bytes
        One for each packet, all of one length.
    chunks : sequence of Chunk

    Attributes
    ----------
    headers : (n, bytes) uint8 array
        To be written where a field changes, such as a sequence number.
    packets : list of memoryview
        The packets, as they are to be sent.

    """

    def __init__(self, headers: Sequence[bytes], chunks: Sequence[Chunk]) -> None:
        length = len(headers[0])
        widest = max(chunk.payload for chunk in chunks)
        rows = np.zeros((len(chunks), length + widest), dtype=np.uint8)
        self.headers = rows[:, :length]
        self.headers[:] = np.frombuffer(b"".join(headers), dtype=np.uint8).reshape(-1, length)
        self.packets = [
            memoryview(row)[: length + chunk.payload]  # type: ignore[arg-type]
            for row, chunk in zip(rows, chunks, strict=True)
        ]
        # Neighbours of one shape are filled together.
        self._blocks: list[tuple[NDArray[np.uint8], int]] = []
        first = 0
        for (lead, size), group in itertools.groupby(chunks, key=lambda each: each[:2]):
            last = first + len(list(group))
            begin = length + lead
            self._blocks.append((rows[first:last, begin : begin + size], size))
            first = last

    def fill(self, data: NDArray[np.uint8]) -> None:
        """Write the data of a frame, (bytes,), into the packets."""
        begin = 0
        for block, size in self._blocks:
            end = begin + len(block) * size
            block[:] = data[begin:end].reshape(-1, size)
            begin = end

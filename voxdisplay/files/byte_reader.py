"""Reader of little-endian numbers and texts that checks every length against what there is."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from voxdisplay.errors import BodyError


class ByteReader:
    """Position in the bytes of a file.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    data : bytes
    start, end : int
        Part of the data to read.

    """

    def __init__(self, name: str, data: bytes, start: int = 0, end: int | None = None) -> None:
        self.name = name
        self.data = data
        self.at = start
        self.end = len(data) if end is None else end

    @property
    def left(self) -> int:
        """Bytes that are left."""
        return self.end - self.at

    def error(self, problem: str) -> BodyError:
        """Return an error at this position."""
        return BodyError(f"{self.name}: {problem} at byte {self.at}")

    def skip(self, count: int, what: str) -> int:
        """Move on by so many bytes, which must be there, and return where they begin."""
        if not 0 <= count <= self.left:
            raise self.error(f"{what} of {count} bytes, of which {self.left} are left,")
        start, self.at = self.at, self.at + count
        return start

    def bytes(self, count: int, what: str) -> bytes:
        """Return the next so many bytes."""
        start = self.skip(count, what)
        return self.data[start : self.at]

    def part(self, count: int, what: str) -> ByteReader:
        """Return a reader of the next so many bytes, and move behind them."""
        start = self.skip(count, what)
        return ByteReader(self.name, self.data, start, self.at)

    def integers(self, count: int, what: str, kind: str = "i") -> tuple[int, ...]:
        """Return the next so many numbers of a kind of `struct`."""
        layout = struct.Struct(f"<{count}{kind}")
        return layout.unpack_from(self.data, self.skip(layout.size, what))

    def integer(self, what: str, kind: str = "i") -> int:
        """Return the next number of a kind of `struct`."""
        return self.integers(1, what, kind)[0]

    def text(self, what: str, most: int = 1 << 16) -> str:
        """Return a text with its length, 32 bits, before it."""
        length = self.integer(what)
        if not 0 <= length <= most:
            raise self.error(f"{what} of {length} bytes")
        return self.bytes(length, what).decode("utf-8", "replace")

    def array(self, count: int, kind: Any, what: str) -> NDArray[Any]:
        """Return so many numbers of a kind of numpy, as a view of the data."""
        dtype = np.dtype(kind)
        if not 0 <= count <= self.left // dtype.itemsize:
            raise self.error(f"{what}: {count} x {dtype.itemsize} bytes, "
                             f"of which {self.left} are left,")  # fmt: skip
        start = self.skip(count * dtype.itemsize, what)
        return np.frombuffer(self.data, dtype, count, start)

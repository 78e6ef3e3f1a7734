"""Sparse pixel array in scan order: only blocks that have been written are stored.

A block is a number of consecutive voxels. Stored blocks lie in one pool in the order in which they
were first written; a table finds them. Knows nothing of digests and palettes.
"""

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from typing import Final

# Small enough that a curve across many rows does not store the rows, large enough that a dense
# page is written in few pieces.
BLOCK_BITS: Final = 7
BLOCK: Final = 1 << BLOCK_BITS  # voxels
_MASK: Final = BLOCK - 1
_PIECE_BYTES: Final = 1 << 16  # of long runs, to bound what a copy of them takes
_GROWTH_BYTES: Final = 1 << 24  # most that the pool grows by at once
_SMALL_POOL_BYTES: Final = 1 << 22  # kept by `clear` in any case
_WASTE: Final = 4  # `clear` keeps a pool of so many times what was stored
_SPARSE: Final = 4  # with more than one of so many blocks to copy, all are copied


class _Table(dict[int, int]):
    """Offsets of blocks in the pool; a block that is asked for and not stored is added.

    The offset is where the array's first voxel would be if all blocks before this one preceded it
    in the pool: a voxel's place is this offset and its own place in a dense array.
    """

    def __init__(self, pixel_size: int) -> None:
        super().__init__()
        self.pixel_size = pixel_size
        self.pool = bytearray()
        self.used = 0  # bytes of the pool
        self.written = 0  # bytes of the pool that may not be zero
        self.order: list[int] | None = None  # the stored blocks in scan order, if known

    def __missing__(self, block: int) -> int:
        size = self.pixel_size << BLOCK_BITS
        start, end = self.used, self.used + size
        pool = self.pool
        if end > len(pool):
            pool += bytes(min(max(end, _PIECE_BYTES), _GROWTH_BYTES))
        if start < self.written:
            pool[start:end] = bytes(size)
        else:
            self.written = end
        self.used = end
        self.order = None
        offset = self[block] = start - block * size
        return offset

    def block(self, block: int, size: int) -> bytearray:
        """Return the pixels of a block of so many bytes, stored or not."""
        offset = self.get(block)
        if offset is None:
            return bytearray(size)
        return self.pool[offset + block * size : offset + (block + 1) * size]

    def reset(self) -> None:
        """Store no block."""
        if len(self.pool) > max(_SMALL_POOL_BYTES, _WASTE * self.used):
            self.pool = bytearray()
            self.written = 0
        self.clear()
        self.used = 0
        self.order = None

    def assign(self, other: "_Table") -> None:
        """Store what another table stores."""
        self.clear()
        self.update(other)
        self.pool[: other.used] = memoryview(other.pool)[: other.used]
        self.used = other.used
        self.written = max(self.written, other.used)
        self.order = other.order


class SparsePixels:  # noqa: PLW1641 - not hashable: its pixels change
    """Pixels in scan order, initially dark.

    Parameters
    ----------
    volume
        Number of voxels.
    pixel_size
        Number of bytes of a pixel.
    """

    def __init__(self, volume: int, pixel_size: int) -> None:
        self.volume = volume
        self.pixel_size = pixel_size
        self._table = _Table(pixel_size)

    def __eq__(self, other: object) -> bool:
        """Compare pixels: a stored dark block equals one that is not stored."""
        if not isinstance(other, SparsePixels):
            return NotImplemented
        if (self.volume, self.pixel_size) != (other.volume, other.pixel_size):
            return False
        size = self.pixel_size << BLOCK_BITS
        return all(
            self._table.block(block, size) == other._table.block(block, size)  # noqa: SLF001 - of its own kind
            for block in {*self._table, *other._table}
        )

    def clear(self) -> None:
        """Make all pixels dark."""
        self._table.reset()

    def copy(self) -> "SparsePixels":
        """Return a copy, which takes what is stored."""
        twin = SparsePixels(self.volume, self.pixel_size)
        twin._table.assign(self._table)
        return twin

    def copy_from(self, other: "SparsePixels", blocks: "set[int] | None") -> None:
        """Make this array equal to another one of the same size.

        Parameters
        ----------
        other
            The other array.
        blocks
            Blocks that may differ; None: all may.
        """
        mine, theirs = self._table, other._table  # noqa: SLF001
        if blocks is None or len(blocks) * _SPARSE > len(theirs):
            mine.assign(theirs)
            return
        size = self.pixel_size << BLOCK_BITS
        for block in blocks:
            at = mine[block] + block * size
            mine.pool[at : at + size] = theirs.block(block, size)

    def read(self, start: int, count: int) -> bytes:
        """Return consecutive pixels.

        Parameters
        ----------
        start, count
            Index of the first voxel, and number of voxels; all exist.
        """
        return b"".join(pixels for _, pixels in self._pieces(start, start + count, dark=True))

    def __bytes__(self) -> bytes:
        return self.read(0, self.volume)

    def pieces(self) -> Iterator[tuple[int, memoryview]]:
        """Return all pixels but those of blocks that are not stored.

        Yields
        ------
        start : int
            Index of the first voxel.
        pixels : memoryview
            Its pixel, and those of voxels behind it. Valid until the next write.
        """
        return self._pieces(0, self.volume, dark=False)

    def dense_pieces(self) -> Iterator[memoryview]:
        """Return all pixels in scan order, in pieces that take no memory where they are dark."""
        return (pixels for _, pixels in self._pieces(0, self.volume, dark=True))

    def next_stored(self, start: int, end: int) -> int:
        """Return the index of the first stored voxel in a range; its end if there is none."""
        if start >> BLOCK_BITS in self._table:
            return start
        order = self._order()
        k = bisect_left(order, start >> BLOCK_BITS)
        return min(order[k] << BLOCK_BITS, end) if k < len(order) else end

    def _order(self) -> list[int]:
        table = self._table
        if table.order is None:
            table.order = sorted(table)
        return table.order

    def _pieces(self, start: int, end: int, *, dark: bool) -> Iterator[tuple[int, memoryview]]:
        table, size, order = self._table, self.pixel_size, self._order()
        zeros = memoryview(bytes(_PIECE_BYTES - _PIECE_BYTES % size))
        pool = memoryview(table.pool)
        k = bisect_left(order, start >> BLOCK_BITS)
        at = start
        while at < end:
            stored = max(order[k] << BLOCK_BITS, at) if k < len(order) else end
            stored = min(stored, end)
            if dark:
                while at < stored:
                    count = min(stored - at, len(zeros) // size)
                    yield at, zeros[: count * size]
                    at += count
            if stored == end:
                return
            # Consecutive blocks of the same offset follow each other in the pool, too.
            offset, first = table[order[k]], order[k] - k
            limit = min(k + (_PIECE_BYTES // size >> BLOCK_BITS), len(order))
            k += 1
            while k < limit and order[k] - k == first and table[order[k]] == offset:
                k += 1
            at = stored
            stop = min((order[k - 1] + 1) << BLOCK_BITS, end)
            yield at, pool[offset + at * size : offset + stop * size]
            at = stop

    def exchange_run(self, start: int, pixels: bytes) -> bytes | bytearray:
        """Write consecutive pixels.

        Parameters
        ----------
        start
            Index of the first voxel.
        pixels
            Their pixels, at least one.

        Returns
        -------
        bytes
            The pixels before.
        """
        table, size = self._table, self.pixel_size
        begin = start * size
        end = begin + len(pixels)
        first = start >> BLOCK_BITS
        last = (end - 1) // size >> BLOCK_BITS
        offset = table[first]
        offsets = [table[block] for block in range(first, last + 1)] if last > first else []
        pool = table.pool
        if offsets.count(offset) == len(offsets):  # in one piece in the pool, too
            begin += offset
            end += offset
            old = pool[begin:end]
            pool[begin:end] = pixels
            return old
        block_bytes = size << BLOCK_BITS
        old = bytearray()
        at = begin
        for block, offset in enumerate(offsets, first):
            stop = min((block + 1) * block_bytes, end)
            old += pool[offset + at : offset + stop]
            pool[offset + at : offset + stop] = pixels[at - begin : stop - begin]
            at = stop
        return old

    def exchange(self, indices: Sequence[int], pixel: bytes) -> bytearray:
        """Write the same pixel to many voxels.

        Parameters
        ----------
        indices
            Distinct indices.
        pixel
            The pixel.

        Returns
        -------
        bytearray
            The pixels before.
        """
        table, size = self._table, self.pixel_size
        if size == 1:
            places = [table[index >> BLOCK_BITS] + index for index in indices]
        else:
            places = [table[index >> BLOCK_BITS] + index * size for index in indices]
        pool = table.pool
        old = bytearray(len(places) * size)
        for k, value in enumerate(pixel):
            if k:
                places = [place + 1 for place in places]
            old[k::size] = bytes(map(pool.__getitem__, places))
            for place in places:
                pool[place] = value
        return old

"""Encoder of voxel sets as range-coded slabs: SLABS (protocol.md, section 7.11).

The page is cut into columns, cut down to what is lit. A box goes up a column until a payload is
full, and the next payload begins a new one there. Must not know what the voxels are.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute import kernel_backend
from voxdisplay.wire import slab_coder, spec
from voxdisplay.wire.op_encoding import Bytes, EncoderConfig, Ints, little_endian
from voxdisplay.wire.slab_contexts import CELL, MODEL_BASES, Models, slab_decisions

# Cells along the sides of a column: local statistics are worth more than long boxes.
_COLUMN_CELLS = 1 << spec.SLABS_SIDE_BITS
# Bytes kept for the last two bits, of at most 10 bits each.
_TAIL_BYTES = 3
# Slabs whose contexts are found at once: at first, and at most.
_FIRST_SLABS, _MOST_SLABS = 8, 64
# With more cells than this for each voxel, to code them takes longer than what they save takes on
# the line. A few cells are always tried.
_SPARSE_CELLS, _FEW_CELLS = 64, 1 << 15
# Samples of a curve that take as long to compute without kernels as a voxel takes to code.
_SAMPLES_PER_VOXEL = 6


def encode_slabs(index: Ints, pen: int, config: EncoderConfig) -> list[bytes]:
    """Return the payloads that draw a set of voxels with one pen; each ends with one SLABS.

    Parameters
    ----------
    index : (n,) int64 array
        Scan-order indices, ascending, each once.
    pen : int
        Pixel value.
    config : EncoderConfig

    Returns
    -------
    list of bytes
        At most ``config.max_payload`` bytes each.

    """
    kernel_backend.enable_if_worthwhile(_SAMPLES_PER_VOXEL * len(index))
    payloads = _Payloads(pen, config)
    for column in _columns(index, config):
        _draw_column(column, payloads)
    return payloads.finished()


def are_too_sparse(index: Ints, config: EncoderConfig) -> bool:
    """Return whether nearly all cells around a set are dark, which takes long to code.

    Parameters
    ----------
    index : (n,) int64 array
        As of `encode_slabs`.
    config : EncoderConfig

    """
    column, order = _column_numbers(index, config)
    first = np.flatnonzero(np.diff(column, prepend=-1))
    cells = np.ones(len(first), dtype=np.int64)
    for axis in config.grid.voxels_at(index).T:
        place = (axis // CELL)[order]
        cells *= np.maximum.reduceat(place, first) - np.minimum.reduceat(place, first) + 1
    return int(cells.sum()) > max(_SPARSE_CELLS * len(index), _FEW_CELLS)


@dataclass(frozen=True)
class _Column:
    """Voxels of a column, sorted by z: coordinates, (n,) each, and cells along its sides."""

    x: Ints
    y: Ints
    z: Ints
    cells: int

    def rows(self, which: NDArray[np.bool_] | slice, cells: int) -> _Column:
        """Return a part of the voxels, as a column of a size."""
        return _Column(self.x[which], self.y[which], self.z[which], cells)

    def quarters(self) -> Iterator[_Column]:
        """Yield the columns of half the side that have voxels."""
        half = self.cells // 2
        part = self.x // (half * CELL) % 2 + 2 * (self.y // (half * CELL) % 2)
        for number in range(4):
            if (part == number).any():
                yield self.rows(part == number, half)


def _column_numbers(index: Ints, config: EncoderConfig) -> tuple[Ints, Ints]:
    """Return the numbers of the columns of voxels, ascending, and their rows in that order."""
    nx, ny, _ = config.grid
    side = _COLUMN_CELLS * CELL
    number = index % nx // side + -(-nx // side) * (index // nx % ny // side)
    order = np.argsort(number, kind="stable")
    return number[order], order


def _columns(index: Ints, config: EncoderConfig) -> Iterator[_Column]:
    x, y, z = config.grid.voxels_at(index).T
    number, order = _column_numbers(index, config)
    ends = np.flatnonzero(np.diff(number, append=-1)) + 1
    begin = 0
    for end in ends.tolist():
        rows = order[begin:end]
        yield _Column(x[rows], y[rows], z[rows], _COLUMN_CELLS)
        begin = end


def _draw_column(column: _Column, payloads: _Payloads) -> None:
    """Encode a column as boxes, from below."""
    while len(column.z):
        box = _Box.around(column)
        drawn = payloads.draw(box)
        if drawn:
            at = int(np.searchsorted(column.z, (box.low[2] + drawn) * CELL))
            column = column.rows(slice(at, None), column.cells)
        elif payloads.end():
            continue
        else:  # a slab of it is too much for a payload
            for quarter in column.quarters():
                _draw_column(quarter, payloads)
            return


@dataclass(frozen=True)
class _Box:
    """The box that holds a column: first cell (x, y, z), cells along x, y and z."""

    column: _Column
    low: tuple[int, int, int]
    cells: tuple[int, int, int]

    @classmethod
    def around(cls, column: _Column) -> _Box:
        axes = (column.x, column.y, column.z)
        x, y, z = (int(axis.min()) // CELL for axis in axes)
        ends = [int(axis.max()) // CELL + 1 for axis in axes]
        return cls(column, (x, y, z), (ends[0] - x, ends[1] - y, ends[2] - z))

    def decisions(self, first: int, count: int) -> tuple[Models, Bytes, Ints]:
        """Return the decisions of some slabs, without NEXT."""
        x, y, z = (CELL * cell for cell in self.low)
        w, h, _ = self.cells
        base = z + CELL * (first - 1)
        column = self.column
        begin, end = np.searchsorted(column.z, (base, base + CELL * (count + 1)))
        voxels = np.zeros((CELL * (count + 1), CELL * h, CELL * w), dtype=np.bool_)
        place = slice(int(begin), int(end))
        voxels[column.z[place] - base, column.y[place] - y, column.x[place] - x] = True
        return slab_decisions(voxels, MODEL_BASES)

    def header(self, config: EncoderConfig) -> tuple[Models, Bytes]:
        """Return models and bits of MORE, place and size."""
        numbers = [
            (place, (-(-side // CELL) - 1).bit_length())
            for place, side in zip(self.low, config.grid, strict=True)
        ]
        numbers += [(cells - 1, spec.SLABS_SIDE_BITS) for cells in self.cells[:2]]
        bits = [value >> k & 1 for value, count in numbers for k in reversed(range(count))]
        models = np.full(1 + len(bits), slab_coder.PLAIN, dtype=np.int16)
        models[0] = spec.SLABS_MORE
        return models, np.array([1, *bits], dtype=np.uint8)


class _Payloads:
    """Payloads in the making."""

    def __init__(self, pen: int, config: EncoderConfig) -> None:
        self._config = config
        full = pen == config.format.full
        pixel = little_endian(np.array([pen]), config.format.bytes).tobytes()
        self._head = (b"" if full else bytes((spec.OP_PEN,)) + pixel) + bytes((spec.OP_SLABS,))
        self._limit = config.max_payload - len(self._head) - _TAIL_BYTES
        self._out = np.zeros(config.max_payload + _TAIL_BYTES + 8, dtype=np.int64)
        self._done: list[bytes] = []
        self._state = slab_coder.initial_state()
        self._boxes = 0

    def finished(self) -> list[bytes]:
        """Return all payloads."""
        self.end()
        return self._done

    def end(self) -> bool:
        """End the payload; return False if it is empty."""
        if not self._boxes:
            return False
        last = np.array([spec.SLABS_MORE], dtype=np.int16)
        self._code(last, np.zeros(1, dtype=np.uint8), self._limit + _TAIL_BYTES)
        self._done.append(self._head + slab_coder.finish(self._state, self._out))
        self._state = slab_coder.initial_state()
        self._boxes = 0
        return True

    def draw(self, box: _Box) -> int:
        """Encode as many slabs of a box as fit; return their number."""
        drawn, window = 0, min(_FIRST_SLABS, box.cells[2])
        before, before_bits = box.header(self._config)
        following = np.array([spec.SLABS_NEXT], dtype=np.int16), np.ones(1, dtype=np.uint8)
        while drawn < box.cells[2]:
            window = min(window, box.cells[2] - drawn)
            models, bits, ends = box.decisions(drawn, window)
            begin = 0
            for end in ends.tolist():
                kept = self._state.copy()
                if not (
                    self._code(before, before_bits, self._limit)
                    and self._code(models[begin:end], bits[begin:end], self._limit)
                ):
                    self._state = kept
                    return self._close(drawn)
                before, before_bits = following
                begin, drawn = end, drawn + 1
            window = min(2 * window, _MOST_SLABS)
        return self._close(drawn)

    def _close(self, drawn: int) -> int:
        """End a box, if it has slabs; return their number."""
        if drawn:
            last = np.array([spec.SLABS_NEXT], dtype=np.int16)
            self._code(last, np.zeros(1, dtype=np.uint8), self._limit + _TAIL_BYTES)
            self._boxes += 1
        return drawn

    def _code(self, models: Models, bits: Bytes, limit: int) -> bool:
        return slab_coder.code_bits(
            self._state, models, bits, self._out, slab_coder.state_table(), limit
        )

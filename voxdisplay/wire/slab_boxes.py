"""Division of voxels into boxes of slabs, coded until a payload is full (protocol.md, 7.11).

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
from voxdisplay.wire.op_encoding import Bytes, EncoderConfig, Ints
from voxdisplay.wire.slab_contexts import CELL, MODEL_BASES, Models, slab_decisions
from voxdisplay.wire.slab_values import (
    LITERALS,
    ValueMode,
    initial_carry,
    levels,
    split_channels,
    value_decisions,
)

# Bytes kept for the last two bits, of at most 10 bits each.
_TAIL_BYTES = 3
# Slabs whose contexts are found at once: at first, and at most.
_FIRST_SLABS, _MOST_SLABS, _MOST_VALUED = 8, 64, 16
# Samples of a curve that take as long to compute without kernels as a voxel takes to code.
_SAMPLES_PER_VOXEL = 6
Decisions = tuple[Models, Bytes]


@dataclass(frozen=True)
class Coding:
    """How the boxes of an op are coded.

    Attributes
    ----------
    head : bytes
        Ops before its operand.
    prefix : tuple of arrays
        Models and bits with which the operand begins.
    side_bits : int
        Bits of the sides of a box.
    mode : ValueMode or None
        How pixel values are coded; None if they are not.

    """

    head: bytes
    side_bits: int
    prefix: Decisions = (np.empty(0, dtype=np.int16), np.empty(0, dtype=np.uint8))
    mode: ValueMode | None = None


def encode_boxes(
    index: Ints,
    values: NDArray[np.integer] | None,
    column_cells: int,
    coding: Coding,
    config: EncoderConfig,
) -> list[bytes]:
    """Return the payloads that draw a set of voxels; each ends with one op.

    Parameters
    ----------
    index : (n,) int64 array
        Scan-order indices, ascending, each once.
    values : (n,) integer array or None
        Pixel values, if they are coded.
    column_cells : int
        Cells along the sides of the columns into which the page is cut.
    coding : Coding
    config : EncoderConfig

    Returns
    -------
    list of bytes
        At most ``config.max_payload`` bytes each.

    """
    kernel_backend.enable_if_worthwhile(_SAMPLES_PER_VOXEL * len(index))
    payloads = _Payloads(coding, config)
    for column in _columns(index, values, column_cells, config):
        _draw_column(column, payloads)
    return payloads.finished()


@dataclass(frozen=True)
class _Column:
    """Voxels of a column in scan order: coordinates, (n,) each, and cells along its sides.

    If values are coded, with the levels of their channels, (n, c).
    """

    x: Ints
    y: Ints
    z: Ints
    channels: NDArray[np.int16] | None
    cells: int

    def rows(self, which: NDArray[np.bool_] | slice, cells: int) -> _Column:
        """Return a part of the voxels, as a column of a size."""
        channels = None if self.channels is None else self.channels[which]
        return _Column(self.x[which], self.y[which], self.z[which], channels, cells)

    def parts(self) -> Iterator[_Column]:
        """Yield the columns of half the side that have voxels; of one cell, two halves of them."""
        half = self.cells // 2
        if not half:
            middle = len(self.z) // 2
            yield self.rows(slice(middle), 1)
            yield self.rows(slice(middle, None), 1)
            return
        part = self.x // (half * CELL) % 2 + 2 * (self.y // (half * CELL) % 2)
        for number in range(4):
            if (part == number).any():
                yield self.rows(part == number, half)


def column_numbers(index: Ints, cells: int, config: EncoderConfig) -> tuple[Ints, Ints]:
    """Return the numbers of the columns of voxels, ascending, and their rows in that order."""
    nx, ny, _ = config.grid
    side = cells * CELL
    number = index % nx // side + -(-nx // side) * (index // nx % ny // side)
    order = np.argsort(number, kind="stable")
    return number[order], order


def _columns(
    index: Ints, values: NDArray[np.integer] | None, cells: int, config: EncoderConfig
) -> Iterator[_Column]:
    x, y, z = config.grid.voxels_at(index).T
    number, order = column_numbers(index, cells, config)
    ends = np.flatnonzero(np.diff(number, append=-1)) + 1
    begin = 0
    for end in ends.tolist():
        rows = order[begin:end]
        channels = None if values is None else split_channels(values[rows], config.format)
        yield _Column(x[rows], y[rows], z[rows], channels, cells)
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
            for part in column.parts():
                _draw_column(part, payloads)
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

    def decisions(
        self, first: int, count: int, carry: Ints, coding: Coding, config: EncoderConfig
    ) -> tuple[list[list[Decisions]], Ints]:
        """Return the parts of the decisions of some slabs, without NEXT; and the carry.

        Parameters
        ----------
        first, count : int
            Number of the first slab, and how many.
        carry : int64 array
            What the slabs before leave: as in `value_decisions`.
        coding, config

        """
        x, y, z = (CELL * cell for cell in self.low)
        w, h, _ = self.cells
        base = z + CELL * (first - 1)
        column = self.column
        begin, end = np.searchsorted(column.z, (base, base + CELL * (count + 1)))
        voxels = np.zeros((CELL * (count + 1), CELL * h, CELL * w), dtype=np.bool_)
        some = slice(int(begin), int(end))
        place = column.z[some] - base, column.y[some] - y, column.x[some] - x
        voxels[place] = True
        slabs = [[part] for part in _cut(*slab_decisions(voxels, MODEL_BASES))]
        if coding.mode is not None and column.channels is not None:
            pixels = np.zeros((*voxels.shape, column.channels.shape[1]), dtype=np.int16)
            pixels[place] = column.channels[some]
            models, bits, ends, carry = value_decisions(
                pixels, voxels, carry, coding.mode.switches, levels(config.format), LITERALS
            )
            for slab, part in zip(slabs, _cut(models, bits, ends), strict=True):
                slab.append(part)
        return slabs, carry

    def header(self, side_bits: int, config: EncoderConfig) -> Decisions:
        """Return models and bits of MORE, place and size."""
        numbers = [
            (place, (-(-side // CELL) - 1).bit_length())
            for place, side in zip(self.low, config.grid, strict=True)
        ]
        numbers += [(cells - 1, side_bits) for cells in self.cells[:2]]
        models, bits = plain_decisions(numbers)
        more = np.array([spec.SLABS_MORE], dtype=np.int16)
        return np.concatenate((more, models)), np.concatenate((np.ones(1, dtype=np.uint8), bits))


def plain_decisions(numbers: list[tuple[int, int]]) -> Decisions:
    """Return models and bits of numbers without models, each with its count of bits."""
    bits = [value >> k & 1 for value, count in numbers for k in reversed(range(count))]
    return np.full(len(bits), slab_coder.PLAIN, dtype=np.int16), np.array(bits, dtype=np.uint8)


def _cut(models: Models, bits: Bytes, ends: Ints) -> list[Decisions]:
    """Return the decisions of each slab."""
    starts = [0, *ends[:-1].tolist()]
    return [
        (models[begin:end], bits[begin:end])
        for begin, end in zip(starts, ends.tolist(), strict=True)
    ]


class _Payloads:
    """Payloads in the making."""

    def __init__(self, coding: Coding, config: EncoderConfig) -> None:
        self._coding = coding
        self._config = config
        self._limit = config.max_payload - len(coding.head) - _TAIL_BYTES
        self._out = np.zeros(config.max_payload + _TAIL_BYTES + 8, dtype=np.int64)
        self._done: list[bytes] = []
        self._first_slabs = _FIRST_SLABS
        self._begin()

    def _begin(self) -> None:
        """Begin a payload."""
        self._state = slab_coder.initial_state()
        self._boxes = 0
        self._code(self._coding.prefix, self._limit)

    def finished(self) -> list[bytes]:
        """Return all payloads."""
        self.end()
        return self._done

    def end(self) -> bool:
        """End the payload; return False if it is empty."""
        if not self._boxes:
            return False
        self._code(_decision(spec.SLABS_MORE, 0), self._limit + _TAIL_BYTES)
        self._done.append(self._coding.head + slab_coder.finish(self._state, self._out))
        self._begin()
        return True

    def draw(self, box: _Box) -> int:
        """Encode as many slabs of a box as fit; return their number."""
        drawn, window = 0, self._first_slabs
        before = box.header(self._coding.side_bits, self._config)
        carry = initial_carry(self._config.format)
        while drawn < box.cells[2]:
            window = min(window, box.cells[2] - drawn)
            slabs, carry = box.decisions(drawn, window, carry, self._coding, self._config)
            for parts in slabs:
                kept = self._state.copy()
                if not all(self._code(part, self._limit) for part in (before, *parts)):
                    self._state = kept
                    return self._close(drawn)
                before = _decision(spec.SLABS_NEXT, 1)
                drawn += 1
            window = min(2 * window, _MOST_SLABS if self._coding.mode is None else _MOST_VALUED)
        return self._close(drawn)

    def _close(self, drawn: int) -> int:
        """End a box, if it has slabs; return their number."""
        if drawn:
            self._code(_decision(spec.SLABS_NEXT, 0), self._limit + _TAIL_BYTES)
            self._boxes += 1
        # A full payload has about as many slabs as the one before.
        self._first_slabs = min(drawn + 1, _FIRST_SLABS)
        return drawn

    def _code(self, decisions: Decisions, limit: int) -> bool:
        return slab_coder.code_bits(
            self._state, *decisions, self._out, slab_coder.state_table(), limit
        )


def _decision(model: int, bit: int) -> Decisions:
    """Return one decision."""
    return np.array([model], dtype=np.int16), np.array([bit], dtype=np.uint8)

"""Decoder of range-coded slabs: SLABS (protocol.md, section 7.11).

Bit after bit, as each depends on the one before. Must not know pages.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute import kernel_backend
from voxdisplay.compute.kernel_backend import with_kernel
from voxdisplay.raster.grid import Grid
from voxdisplay.wire import slab_coder, spec
from voxdisplay.wire.op_encoding import Bools, Bytes, Ints
from voxdisplay.wire.slab_contexts import CELL, MODEL_BASES

_BEGIN_BYTES = 3
_LEAST_RANGE = 1 << 24
_CODE, _RANGE, _AT = -3, -2, -1  # places in a state, behind the models
# Samples of a curve that take as long to compute without kernels as a byte takes to decode.
_SAMPLES_PER_BYTE = 200
_BLANK, _MIXED, _FULL = 0, 1, 2
CUT_OFF = "the payload ends inside the op"


def decode_slabs(data: bytes, grid: Grid) -> Iterator[Ints]:
    """Yield the scan-order indices of the voxels of each slab of a SLABS, each once.

    Parameters
    ----------
    data : bytes
        What follows the op byte.
    grid : Grid

    Raises
    ------
    ValueError
        If it is cut off or too long, or leaves the grid.

    """
    stream = SlabStream(data)
    for index, _, _ in stream.slabs(grid, spec.SLABS_SIDE_BITS):
        yield index


class SlabStream:
    """Coded bits of an op, and the state of their decoder.

    Attributes
    ----------
    data : uint8 array
        With the bytes that are read behind the op.
    state : (models + 4,) int64 array
        As in `decode_slab`.

    """

    def __init__(self, data: bytes) -> None:
        kernel_backend.enable_if_worthwhile(_SAMPLES_PER_BYTE * len(data))
        self.data = np.frombuffer(data + bytes(spec.ARC_BEHIND), dtype=np.uint8)
        self.state = slab_coder.initial_state()
        self.state[_CODE] = int.from_bytes(self.data[:_BEGIN_BYTES].tobytes(), "big")
        self.state[_AT] = _BEGIN_BYTES

    def slabs(self, grid: Grid, side_bits: int) -> Iterator[tuple[Ints, Bools, bool]]:
        """Yield the slabs of all boxes; what follows a slab is to be read before the next.

        Parameters
        ----------
        grid : Grid
        side_bits : int
            Bits of the sides of a box.

        Yields
        ------
        index : (n,) int64 array
            Scan-order indices of the lit voxels, ascending.
        lit : (4, 4 h, 4 w) bool array
            The voxels, until the next slab.
        first : bool
            True if a box begins.

        Raises
        ------
        ValueError
            If it is cut off or too long, or leaves the grid.

        """
        cells = [-(-side // CELL) for side in grid]
        left = cells[0] * cells[1] * cells[2]
        while self.bit(spec.SLABS_MORE):
            i, j, k = (self.plain((count - 1).bit_length()) for count in cells)
            w, h = (1 + self.plain(side_bits) for _ in range(2))
            states = np.zeros((h + 2, w + 2), dtype=np.int64)
            below = np.zeros((CELL * h + 2, CELL * w + 2), dtype=np.int64)
            lit = np.empty((CELL, CELL * h, CELL * w), dtype=np.bool_)
            z, y, x = (np.arange(size) for size in lit.shape)
            y, x = y + CELL * j, x + CELL * i
            index = x + grid.nx * (y[:, None] + grid.ny * z[:, None, None])
            outside = (x >= grid.nx) | (y >= grid.ny)[:, None]
            first, following = True, 1
            while following:
                left -= w * h
                if left < 0:
                    raise ValueError("more cells than the grid has")
                self._slab(states, below, lit)
                base = CELL * k
                if (outside.any() and lit[:, outside].any()) or lit[max(0, grid.nz - base) :].any():
                    raise ValueError("a voxel leaves the grid")
                yield index.reshape(-1)[np.flatnonzero(lit)] + grid.nx * grid.ny * base, lit, first
                k += 1
                first, following = False, self.bit(spec.SLABS_NEXT)
        if int(self.state[_AT]) != len(self.data):
            raise ValueError("bytes behind the last bit")

    def bit(self, model: int) -> int:
        """Return a bit by a model."""
        code, span, at = self.state[_CODE:].tolist()
        now = int(self.state[model])
        chance, *after = slab_coder.state_table()
        bound = (span >> 13) * int(chance[now])
        bit = int(code >= bound)
        code, span = (code - bound, span - bound) if bit else (code, bound)
        while span < _LEAST_RANGE:
            if at == len(self.data):
                raise ValueError(CUT_OFF)
            code, span, at = code << 8 | int(self.data[at]), span << 8, at + 1
        self.state[model] = after[bit][now]
        self.state[_CODE:] = code, span, at
        return bit

    def plain(self, count: int) -> int:
        """Return a number of so many bits without models."""
        value = 0
        for _ in range(count):
            value = value << 1 | self.bit(slab_coder.PLAIN)
        return value

    def _slab(self, states: Ints, below: Ints, lit: Bools) -> None:
        """Decode a slab: see `decode_slab`."""
        table = slab_coder.state_table()
        if not decode_slab(self.state, self.data, states, below, lit, table, MODEL_BASES):
            raise ValueError(CUT_OFF)


@with_kernel
def decode_slab(
    state: Ints,
    data: Bytes,
    states: Ints,
    below: Ints,
    lit: Bools,
    table: NDArray[np.int32],
    bases: tuple[int, int, int, int],
) -> bool:
    """Decode a slab; return False if the data end before.

    Parameters
    ----------
    state : (models + 4,) int64 array
        State of each model, then code, range and bytes read; changed in place.
    data : uint8 array
    states : (h + 2, w + 2) int64 array
        States of the cells of the slab before, with a blank rim: 0 blank, 1 mixed, 2 full. They
        become those of this slab.
    below : (4 h + 2, 4 w + 2) int64 array
        Last slice of the slab before, with a dark rim. It becomes that of this slab.
    lit : (4, 4 h, 4 w) bool array
        Becomes the voxels of the slab: axes z, y, x.
    table
        Of `slab_coder.state_table`.
    bases
        Of `slab_contexts.MODEL_BASES`.

    """
    del table  # as lists, which are faster here
    source = BitSource(state, data.tobytes())
    try:
        _decode_states(source, states, below, bases)
        _decode_voxels(source, states, below, lit, bases)
    except EOFError:
        return False
    source.save(state)
    return True


class BitSource:
    """A decoder's state as lists, for many bits; raises EOFError behind the last."""

    def __init__(self, state: Ints, data: bytes) -> None:
        self._models = state.tolist()
        self._code, self._range, self._at = self._models[_CODE:]
        self._data = data
        self._chance, *self._after = slab_coder.table_lists()

    def save(self, state: Ints) -> None:
        """Save the state in an array."""
        self._models[_CODE:] = self._code, self._range, self._at
        state[:] = self._models

    def bit(self, model: int) -> int:
        """Return a bit by a model."""
        now = self._models[model]
        bound = (self._range >> 13) * self._chance[now]
        bit = int(self._code >= bound)
        if bit:
            self._code -= bound
            self._range -= bound
        else:
            self._range = bound
        self._models[model] = self._after[bit][now]
        while self._range < _LEAST_RANGE:
            if self._at == len(self._data):
                raise EOFError
            self._range <<= 8
            self._code = self._code << 8 | self._data[self._at]
            self._at += 1
        return bit


def _decode_states(
    source: BitSource, states: Ints, below: Ints, bases: tuple[int, int, int, int]
) -> None:
    flag, full, *_ = bases
    height, width = states.shape[0] - 2, states.shape[1] - 2
    count = below[1:-1, 1:-1].reshape(height, CELL, width, CELL).sum(axis=(1, 3))
    under = np.zeros_like(states)
    under[1:-1, 1:-1] = np.where(count == CELL**2, _FULL, np.minimum(count, _MIXED))
    before, now, base = states.tolist(), np.zeros_like(states).tolist(), under.tolist()
    for y in range(1, height + 1):
        for x in range(1, width + 1):
            # In the order of the bits of both contexts.
            west, north, north_west, north_east = (
                now[y][x - 1], now[y - 1][x], now[y - 1][x - 1], now[y - 1][x + 1]
            )  # fmt: skip
            beneath = (base[y][x], base[y][x + 1], base[y + 1][x])
            around = (west, north, north_west, north_east, *beneath, before[y][x])
            if source.bit(flag + sum((value > 0) << n for n, value in enumerate(around))):
                filled = (west, north, *beneath, north_east)
                context = sum((value == _FULL) << n for n, value in enumerate(filled))
                now[y][x] = _FULL if source.bit(full + context) else _MIXED
    states[:] = now


def _decode_voxels(
    source: BitSource, states: Ints, below: Ints, lit: Bools, bases: tuple[int, int, int, int]
) -> None:
    group, shape = bases[2:]
    cells, under = states.tolist(), below.tolist()
    first, end = -1, CELL + 1
    for a in range(CELL):
        now = np.zeros_like(below).tolist()
        for y in range(1, len(now) - 1):
            row, north = now[y], now[y - 1]
            south, middle, up = under[y + 1], under[y], under[y - 1]
            of_cells = cells[(y - 1) // CELL + 1]
            for x in range(1, len(row) - 1, CELL):
                cell = of_cells[(x - 1) // CELL + 1]
                if cell == _FULL:
                    row[x : x + CELL] = [1] * CELL
                if cell != _MIXED:
                    continue
                part = slice(x + first, x + end)
                around = sum(map(sum, (north[part], south[part], middle[part], up[part])))
                around += row[x - 1]
                every = around == 4 * (CELL + 2) + 1
                if every or not around:
                    east = of_cells[(x - 1) // CELL + 2] > 0
                    if not source.bit(group + (y - 1) % CELL + 4 * a + 16 * every + 32 * east):
                        row[x : x + CELL] = [int(every)] * CELL
                        continue
                for at in range(x, x + CELL):
                    row[at] = source.bit(
                        shape
                        + north[at - 1] + 2 * north[at] + 4 * north[at + 1]
                        + 8 * middle[at - 1] + 16 * middle[at] + 32 * middle[at + 1]
                        + 64 * south[at - 1] + 128 * south[at] + 256 * south[at + 1]
                        + 512 * up[at] + 1024 * row[at - 1]
                    )  # fmt: skip
        lit[a] = np.array(now, dtype=np.bool_)[1:-1, 1:-1]
        under = now
    below[:] = under

"""Decoder of range-coded slabs, as of the op SLABS, into the voxels that they light (7.11).

Draws nothing. Refuses voxels off the grid group by group, in the order in which they are decoded.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from firmware_sim import spec
from firmware_sim.grid import Grid
from firmware_sim.operands import Operands
from firmware_sim.range_decoder import RangeDecoder

_BLANK, _MIXED, _FULL = 0, 1, 2  # states of a cell
_CELL: Final = spec.SLABS_CELL
_ROW: Final = (1 << _CELL) - 1  # a lit row of a cell
_ROUND: Final = (1 << _CELL + 2) - 1  # such a row and the voxels west and east of it
# Voxels of a group, by its four bits.
_LIT: Final = [[x for x in range(_CELL) if group >> x & 1] for group in range(_ROW + 1)]


def decode_slabs(operands: Operands, grid: Grid) -> Iterator[list[int]]:
    """Decode a SLABS.

    Parameters
    ----------
    operands
        Positioned behind the op byte; the rest of the packet is consumed.
    grid
        That of the page.

    Yields
    ------
    list of int
        Indices of the voxels of a slab, each once.

    Raises
    ------
    PacketError
        TRUNCATED, PADDING or OUTSIDE, after the slabs before have been yielded.
    """
    bits = RangeDecoder(
        operands.remaining(),
        lambda: operands.error(spec.CODE_TRUNCATED, "the payload ends inside the op"),
        spec.SLABS_MODELS,
        spec.SLABS_PACE,
        spec.SLABS_ENOUGH,
    )
    for slab in boxes_of_slabs(operands, bits, grid, spec.SLABS_SIDE_BITS):
        yield slab.voxels


@dataclass(frozen=True)
class Slab:
    """A decoded slab.

    Attributes
    ----------
    voxels
        Indices of its voxels, each once, in the order in which they were decoded.
    first
        True if a box begins with it.
    slices
        Its four slices and, before them, the one below: rows as integers, of which bit x + 1 is
        voxel x, with a dark row before and behind.
    """

    voxels: list[int]
    first: bool
    slices: list[list[int]]


def boxes_of_slabs(
    operands: Operands, bits: RangeDecoder, grid: Grid, side_bits: int
) -> Iterator[Slab]:
    """Decode the boxes of an op to its end.

    Parameters
    ----------
    operands
        Those of the op, for its errors.
    bits
        What follows the op byte, or what is left of it.
    grid
        That of the page.
    side_bits
        Bits of the sides of a box.

    Yields
    ------
    Slab
        What follows its voxels is to be decoded before the next.

    Raises
    ------
    PacketError
        As of `decode_slabs`.
    """
    cells = [-(-side // _CELL) for side in grid.sides]
    left = _cell_limit(cells)
    while bits.bit(spec.SLABS_MORE):
        x, y, z = (bits.plain_bits((count - 1).bit_length()) for count in cells)
        width, height = (1 + bits.plain_bits(side_bits) for _ in range(2))
        box = _Box(operands, bits, grid, (_CELL * x, _CELL * y, _CELL * z), width, height)
        first, following = True, 1
        while following:
            left -= width * height
            if left < 0:
                raise operands.error(spec.CODE_OUTSIDE, "more cells than the grid has")
            slices = [box.below]
            yield Slab(box.slab(slices), first, slices)
            first, following = False, bits.bit(spec.SLABS_NEXT)
    if not bits.exhausted:
        raise operands.error(spec.CODE_PADDING, "bytes behind the last bit")


def _cell_limit(cells: list[int]) -> int:
    """Return the most cells of an op, by the cells along the axes of the grid."""
    return cells[0] * cells[1] * cells[2]


class _Box:
    """State of a box: the slab before, of which the last slice is kept."""

    def __init__(
        self,
        operands: Operands,
        bits: RangeDecoder,
        grid: Grid,
        corner: tuple[int, int, int],
        width: int,
        height: int,
    ) -> None:
        self._operands = operands
        self._bits = bits
        self._grid = grid
        self._x, self._y, self._z = corner
        self._width = width
        self._height = height
        # Rows of a slice as integers: bit x + 1 is voxel x. With a dark one before and behind.
        self._below = [0] * (_CELL * height + 2)
        self._states = self._no_cells()

    def _no_cells(self) -> list[list[int]]:
        """Return blank cells, with a blank one around them: cell (x, y) is at [y + 1][x + 1]."""
        return [[_BLANK] * (self._width + 2) for _ in range(self._height + 2)]

    @property
    def below(self) -> list[int]:
        """The last slice so far."""
        return self._below

    def slab(self, slices: list[list[int]]) -> list[int]:
        """Decode the next slab, append its slices, and return the indices of its voxels."""
        self._decode_states()
        voxels: list[int] = []
        for a in range(_CELL):
            self._decode_slice(a, voxels)
            slices.append(self._below)
            self._z += 1
        return voxels

    def _decode_states(self) -> None:
        before, states = self._states, self._no_cells()
        under = self._cells_under()
        bit = self._bits.bit
        for y in range(1, self._height + 1):
            north, row = states[y - 1], states[y]
            for x in range(1, self._width + 1):
                here, east, south = under[y][x], under[y][x + 1], under[y + 1][x]
                flag = (
                    (row[x - 1] != _BLANK)
                    | (north[x] != _BLANK) << 1
                    | (north[x - 1] != _BLANK) << 2
                    | (north[x + 1] != _BLANK) << 3
                    | (here != _BLANK) << 4
                    | (east != _BLANK) << 5
                    | (south != _BLANK) << 6
                    | (before[y][x] != _BLANK) << 7
                )
                if not bit(spec.SLABS_FLAG + flag):
                    continue
                full = (
                    (row[x - 1] == _FULL)
                    | (north[x] == _FULL) << 1
                    | (here == _FULL) << 2
                    | (east == _FULL) << 3
                    | (south == _FULL) << 4
                    | (north[x + 1] == _FULL) << 5
                )
                row[x] = _FULL if bit(spec.SLABS_FULL + full) else _MIXED
        self._states = states

    def _cells_under(self) -> list[list[int]]:
        """Return for each cell whether none, some or all of the voxels under it are lit."""
        under = self._no_cells()
        for y in range(self._height):
            rows = self._below[_CELL * y + 1 : _CELL * y + _CELL + 1]
            some = every = rows[0]
            for row in rows[1:]:
                some |= row
                every &= row
            for x in range(self._width):
                first = _CELL * x + 1
                if some >> first & _ROW:
                    under[y + 1][x + 1] = _FULL if every >> first & _ROW == _ROW else _MIXED
        return under

    def _decode_slice(self, a: int, voxels: list[int]) -> None:
        below, rows = self._below, [0] * len(self._below)
        for y in range(_CELL * self._height):
            states = self._states[y // _CELL + 1]
            for x in range(self._width):
                state = states[x + 1]
                if state == _BLANK:
                    continue
                if state == _FULL:
                    group = _ROW
                else:
                    east = states[x + 2] != _BLANK
                    model = spec.SLABS_GROUP + y % _CELL + 4 * a + 32 * east
                    group = self._decode_group(
                        _CELL * x, rows[y], rows[y + 1], below[y : y + 3], model
                    )
                rows[y + 1] |= group << _CELL * x + 1
                if group:
                    self._add(_CELL * x, y, group, voxels)
        self._below = rows

    def _decode_group(self, x: int, north: int, row: int, below: list[int], model: int) -> int:
        """Decode four voxels from x on; return their bits.

        Parameters
        ----------
        x
            The first, in the box.
        north, row
            The row before in this slice, and this one so far.
        below
            The rows y - 1, y and y + 1 of the slice below.
        model
            The model of GROUP for dark surroundings.
        """
        bit = self._bits.bit
        around = [line >> x & _ROUND for line in (north, *below)]
        west = row >> x & 1
        if not west and not any(around):
            if not bit(model):
                return 0
        elif west and all(line == _ROUND for line in around) and not bit(model + 16):
            return _ROW
        of_north, under_north, under, under_south = around
        group = 0
        for place in range(_CELL):
            west = bit(
                spec.SLABS_SHAPE
                + (
                    of_north >> place & 7
                    | (under >> place & 7) << 3
                    | (under_south >> place & 7) << 6
                    | (under_north >> place + 1 & 1) << 9
                    | west << 10
                )
            )
            group |= west << place
        return group

    def _add(self, x: int, y: int, group: int, voxels: list[int]) -> None:
        """Add the lit voxels of a group; raise if one is not on the grid."""
        lit = _LIT[group]
        x, y = self._x + x, self._y + y
        if not self._grid.contains(x + lit[-1], y, self._z):
            raise self._operands.error(spec.CODE_OUTSIDE, f"({x + lit[-1]}, {y}, {self._z})")
        first = self._grid.index(x, y, self._z)
        voxels += [first + place for place in lit]

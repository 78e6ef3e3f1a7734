"""Decoder of range-coded chains, the op ARC, into pieces of one pen each (7.7).

Draws nothing. Refuses steps off the grid at once, because what follows them has no meaning.
"""

from collections.abc import Iterator
from typing import Final

from firmware_sim import spec
from firmware_sim.grid import Grid
from firmware_sim.memory import PixelFormat
from firmware_sim.operands import Operands
from firmware_sim.range_decoder import RangeDecoder

_HISTORY: Final = 0x7F  # mask of seven steps
_OTHERS: Final = 0x3F  # mask of the six before the latest


class _Axis:
    """Step memory of one axis."""

    def __init__(self, side: int) -> None:
        self.side = side
        self.bits = (side - 1).bit_length()
        self.reset(0)

    def reset(self, place: int) -> None:
        """Start at a coordinate, with an empty memory."""
        self.coordinate = place
        self.last = 0
        self.run = 0
        self.prev = 0
        self.prev2 = 0
        self.past = 0
        self.direction = 0

    @property
    def streak(self) -> int:
        return self.run if self.last else 0

    def move(self, bits: RangeDecoder) -> None:
        """Decode the direction and move by one."""
        if not self.direction:
            self.direction = -1 if bits.plain_bits(1) else 1
        elif bits.bit(spec.ARC_TURN + (0 if self.last else min(self.run, 15))):
            self.direction = -self.direction
        self.coordinate += self.direction

    def decode_moves(self, bits: RangeDecoder) -> int:
        """Decode whether the axis moves in a step in which the main axis does."""
        last, run = self.last, self.run
        history = self.past >> 1 ^ (_OTHERS if last else 0)
        longer = min(max(run - self.prev2, -2), 1) + 2
        runs = 64 * last + 16 * longer + 8 * (self.prev > 1) + min(run, 7)
        return last ^ bits.mixed_bit(spec.ARC_HISTORY + history, spec.ARC_RUNS + runs)

    def record(self, moved: int) -> None:
        """Record whether the axis moved."""
        self.past = (self.past << 1 | moved) & _HISTORY
        if moved == self.last:
            self.run = min(self.run + 1, spec.ARC_MAX_RUN)
        else:
            self.prev2 = self.prev
            self.prev = self.run
            self.run = 1
            self.last = moved


def decode_chains(
    operands: Operands, grid: Grid, pixel_format: PixelFormat, pen: bytes
) -> Iterator[tuple[bytes, list[int]]]:
    """Decode an ARC.

    Parameters
    ----------
    operands
        Positioned behind the op byte; the rest of the packet is consumed.
    grid, pixel_format
        Those of the page.
    pen
        The pen before the op.

    Yields
    ------
    pen : bytes
        The pen of a piece.
    voxels : list of int
        Indices of its voxels, possibly repeated.

    Raises
    ------
    PacketError
        TRUNCATED, PADDING or OUTSIDE, after the pieces before have been yielded.
    """
    bits = RangeDecoder(
        operands.remaining(),
        lambda: operands.error(spec.CODE_TRUNCATED, "the payload ends inside the op"),
    )
    axes = [_Axis(side) for side in grid.sides]
    pixel_bits = 1 if pixel_format.code == spec.FORMAT_MONO1 else 8 * pixel_format.size
    first = True
    while bits.bit(spec.ARC_MORE):
        jump = first or bits.bit(spec.ARC_JUMP)
        first = False
        if bits.bit(spec.ARC_INK):
            pen = bits.plain_bits(pixel_bits).to_bytes(pixel_format.size, "little")
        if jump:
            for axis in axes:
                axis.reset(bits.plain_bits(axis.bits))
        count = bits.number()
        voxels = []
        if jump:
            voxels.append(_checked_index(operands, grid, axes))
        for _ in range(count):
            _step(bits, axes)
            voxels.append(_checked_index(operands, grid, axes))
        yield pen, voxels
    if not bits.exhausted:
        raise operands.error(spec.CODE_PADDING, "bytes behind the last bit")


def _checked_index(operands: Operands, grid: Grid, axes: list[_Axis]) -> int:
    x, y, z = (axis.coordinate for axis in axes)
    if min(x, y, z) < 0 or not grid.contains(x, y, z):
        raise operands.error(spec.CODE_OUTSIDE, f"({x}, {y}, {z})")
    return grid.index(x, y, z)


def _step(bits: RangeDecoder, axes: list[_Axis]) -> None:
    streaks = [axis.streak for axis in axes]
    main = streaks.index(max(streaks))
    m, b, c = axes[main], axes[main - 2], axes[main - 1]
    others = max(streaks[main - 2], streaks[main - 1])
    m_moves = bits.bit(spec.ARC_MAIN + 8 * min(streaks[main], 3) + min(others, 7))
    if m_moves:
        m.move(bits)
        b_moves = b.decode_moves(bits)
    else:
        b_moves = bits.bit(spec.ARC_LONE + min(streaks[main - 2], 7))
    if b_moves:
        b.move(bits)
    if m_moves:
        c_moves = c.decode_moves(bits)
    else:
        c_moves = bits.bit(spec.ARC_LONE + min(streaks[main - 1], 7)) if b_moves else 1
    if c_moves:
        c.move(bits)
    m.record(m_moves)
    b.record(b_moves)
    c.record(c_moves)

"""Decoder of range-coded chains, the ops ARC and ARC2, into pieces of one pen each (7.7, 7.10).

Draws nothing. Refuses steps off the grid at once, because what follows them has no meaning.
"""

from collections.abc import Iterator
from typing import Final

from firmware_sim import spec
from firmware_sim.fades import Blend, Fade
from firmware_sim.grid import Grid
from firmware_sim.memory import PixelFormat
from firmware_sim.operands import Operands
from firmware_sim.range_decoder import RangeDecoder

_SIDE_BITS: Final = 10  # of a coordinate in a Morton index
_STOP_BITS: Final = 4  # of the number of a fade's colours
_HISTORY: Final = 0x7F  # mask of seven steps
_OTHERS: Final = 0x3F  # mask of the six before the latest
_PACE: Final = 2  # the shift of a model is 1 + (seen >> 1)


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
    operands: Operands,
    grid: Grid,
    pixel_format: PixelFormat,
    pen: bytes | Fade,
    *,
    second: bool = False,
) -> Iterator[tuple[bytes | Fade, list[int]]]:
    """Decode an ARC or ARC2.

    Parameters
    ----------
    operands
        Positioned behind the op byte; the rest of the packet is consumed.
    grid, pixel_format
        Those of the page.
    pen
        The pen before the op.
    second
        True for ARC2.

    Yields
    ------
    pen : bytes or Fade
        The pen of a piece.
    voxels : list of int
        Indices of its voxels, possibly repeated.

    Raises
    ------
    PacketError
        TRUNCATED, PADDING, OUTSIDE or COUNT, after the pieces before have been yielded.
    """
    bits = RangeDecoder(
        operands.remaining(),
        lambda: operands.error(spec.CODE_TRUNCATED, "the payload ends inside the op"),
        spec.ARC2_MODELS,  # those of ARC are the first
        _PACE,
        spec.ARC_ENOUGH,
    )
    axes = [_Axis(side) for side in grid.sides]
    has_near = second and max(grid.sides) <= spec.ARC2_MAX_SIDE
    latest: int | None = None  # Morton index of the latest start
    while bits.bit(spec.ARC_MORE):
        jump = latest is None or bits.bit(spec.ARC_JUMP)
        if bits.bit(spec.ARC_INK):
            pen = _pen(bits, operands, pixel_format, second=second)
        if jump:
            latest = _start(bits, operands, axes, latest if has_near else None)
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


def _pen(
    bits: RangeDecoder, operands: Operands, pixel_format: PixelFormat, *, second: bool
) -> bytes | Fade:
    """Decode the pen of a piece."""
    mono = pixel_format.code == spec.FORMAT_MONO1
    if not second or mono or not bits.bit(spec.ARC2_FADE):
        pixel = bits.plain_bits(1 if mono else 8 * pixel_format.size)
        return pixel.to_bytes(pixel_format.size, "little")
    stops = bits.plain_bits(_STOP_BITS) + 1
    count = bits.number() + 1
    place = bits.number()
    if place >= count:
        raise operands.error(spec.CODE_COUNT, f"voxel {place} of {count}")
    size = 1 if pixel_format.code == spec.FORMAT_INDEX8 else 3
    colors = [bytes(bits.plain_bits(8) for _ in range(size)) for _ in range(stops)]
    return Fade(pixel_format.code, Blend(colors, count, place))


def _start(bits: RangeDecoder, operands: Operands, axes: list[_Axis], latest: int | None) -> int:
    """Decode where a piece begins, and return its Morton index.

    ``latest`` is that of the latest start, or None if none can be near.
    """
    if latest is not None and bits.bit(spec.ARC2_NEAR):
        latest += bits.number(spec.ARC2_DELTA, spec.ARC2_MAX_DELTA)
        if latest >> 3 * _SIDE_BITS:
            raise operands.error(spec.CODE_OUTSIDE, f"Morton index {latest}")
        for shift, axis in enumerate(axes):
            axis.reset(_every_third_bit(latest >> shift))
        return latest
    for axis in axes:
        axis.reset(bits.plain_bits(axis.bits))
    return sum(_spread_bits(axis.coordinate) << shift for shift, axis in enumerate(axes))


def _spread_bits(number: int) -> int:
    """Return a number with two zeros between its bits, which are at most ten that matter."""
    return int(f"{number:b}", 8)


def _every_third_bit(number: int) -> int:
    """Return bits 0, 3, 6, ... of a number as bits 0, 1, 2, ..."""
    return int("".join(str(int(digit) & 1) for digit in f"{number:o}"), 2)


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

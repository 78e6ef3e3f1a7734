"""Decoder of range-coded chains: ARC (protocol.md, section 7.7).

Bit after bit, as each depends on the one before. Must not know pages.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import spec

_LEAST_RANGE: Final = 1 << 24
_EVEN_CHANCE: Final = 4096
_SCALE_BITS: Final = 13
_HISTORY: Final = 127
_OLDER: Final = 63  # six steps of the history


class _Bits:
    """Adaptive binary range decoder."""

    def __init__(self, data: bytes) -> None:
        self._data = data + bytes(spec.ARC_BEHIND)
        self._code = int.from_bytes(self._data[:3], "big")
        self._at = 3
        self._range = _LEAST_RANGE
        self._chance = [spec.ARC_HALF] * spec.ARC_MODELS
        self._seen = [0] * spec.ARC_MODELS

    @property
    def finished(self) -> bool:
        """True if all bytes have been read."""
        return self._at == len(self._data)

    def _bit(self, chance: int) -> int:
        bound = (self._range >> _SCALE_BITS) * chance
        bit = int(self._code >= bound)
        if bit:
            self._code -= bound
            self._range -= bound
        else:
            self._range = bound
        while self._range < _LEAST_RANGE:
            if self._at == len(self._data):
                raise ValueError("the payload ends inside ARC")
            self._range <<= 8
            self._code = self._code << 8 | self._data[self._at]
            self._at += 1
        return bit

    def modelled(self, first: int, second: int) -> int:
        """Return a bit by the mean of two models, which may be the same."""
        bit = self._bit(self._chance[first] + self._chance[second])
        for model in {first, second}:
            seen, chance = self._seen[model], self._chance[model]
            shift = 1 + (seen >> 1)
            self._chance[model] = (
                chance - (chance >> shift) if bit else chance + (_EVEN_CHANCE - chance >> shift)
            )
            self._seen[model] = min(seen + 1, spec.ARC_ENOUGH)
        return bit

    def by(self, model: int) -> int:
        """Return a bit by one model."""
        return self.modelled(model, model)

    def plain(self, count: int) -> int:
        """Return a number of so many bits without models."""
        value = 0
        for _ in range(count):
            value = value << 1 | self._bit(_EVEN_CHANCE)
        return value

    def number(self) -> int:
        """Return a number of any size up to 65534."""
        k = 0
        while k < spec.ARC_MAX_K and self.by(spec.ARC_COUNT + k):
            k += 1
        return (1 << k) - 1 + self.plain(k)


class _Axis:
    """Steps of one axis so far."""

    __slots__ = ("last", "past", "place", "previous", "previous2", "run", "side", "way")

    def __init__(self, side: int) -> None:
        self.side = side
        self.begin(0)

    def begin(self, place: int) -> None:
        """Begin at a coordinate, without steps."""
        self.place = place
        self.last = self.run = self.previous = self.previous2 = self.past = self.way = 0

    @property
    def streak(self) -> int:
        """Number of steps in a row in which the axis has moved."""
        return self.run if self.last else 0

    def changes(self, bits: _Bits) -> int:
        """Return whether the axis moves, where the main axis does."""
        history = self.past >> 1 ^ (_OLDER if self.last else 0)
        longer = min(max(self.run - self.previous2, -2), 1) + 2
        runs = 64 * self.last + 16 * longer + 8 * (self.previous > 1) + min(self.run, 7)
        return self.last ^ bits.modelled(spec.ARC_HISTORY + history, spec.ARC_RUNS + runs)

    def turn_and_move(self, bits: _Bits) -> None:
        """Read the direction, and move."""
        if not self.way:
            self.way = -1 if bits.plain(1) else 1
        elif bits.by(spec.ARC_TURN + (0 if self.last else min(self.run, 15))):
            self.way = -self.way
        self.place += self.way

    def record(self, moved: int) -> None:
        """Record a step."""
        self.past = (self.past << 1 | moved) & _HISTORY
        if moved == self.last:
            self.run = min(self.run + 1, spec.ARC_MAX_RUN)
        else:
            self.previous2, self.previous, self.run = self.previous, self.run, 1
            self.last = moved


def decode_range_coded(
    data: bytes, grid: Grid, format_: PixelFormat, pen: int
) -> Iterator[tuple[int, list[int]]]:
    """Yield the pieces of an ARC: pixel value, and indices of its voxels.

    Parameters
    ----------
    data : bytes
        All that follows the op byte.
    grid, format_
        Those of the display.
    pen : int
        Pixel value before the op.

    Raises
    ------
    ValueError
        If the data end early, have bytes behind the last bit, or leave the grid.

    """
    bits = _Bits(data)
    axes = [_Axis(side) for side in grid]
    pixel_bits = 1 if format_ is PixelFormat.MONO1 else 8 * format_.bytes
    first = True
    while bits.by(spec.ARC_MORE):
        jump = first or bool(bits.by(spec.ARC_JUMP))
        first = False
        if bits.by(spec.ARC_INK):
            pen = bits.plain(pixel_bits)
        if jump:
            for axis in axes:
                axis.begin(bits.plain((axis.side - 1).bit_length()))
        steps = bits.number()
        voxels = [_index(axes, grid)] if jump else []
        for _ in range(steps):
            _step(bits, axes)
            voxels.append(_index(axes, grid))
        yield pen, voxels
    if not bits.finished:
        raise ValueError("bytes behind the last bit of ARC")


def _index(axes: list[_Axis], grid: Grid) -> int:
    x, y, z = (axis.place for axis in axes)
    if not (0 <= x < grid.nx and 0 <= y < grid.ny and 0 <= z < grid.nz):
        raise ValueError(f"ARC leaves the grid at ({x}, {y}, {z})")
    return x + grid.nx * (y + grid.ny * z)


def _step(bits: _Bits, axes: list[_Axis]) -> None:
    """Read one step."""
    streaks = [axis.streak for axis in axes]
    main = streaks.index(max(streaks))
    second, third = (main + 1) % 3, (main + 2) % 3
    a, b, c = axes[main], axes[second], axes[third]
    longer = max(streaks[second], streaks[third])
    a_moves = bits.by(spec.ARC_MAIN + 8 * min(streaks[main], 3) + min(longer, 7))
    if a_moves:
        a.turn_and_move(bits)
        b_moves = b.changes(bits)
    else:
        b_moves = bits.by(spec.ARC_LONE + min(streaks[second], 7))
    if b_moves:
        b.turn_and_move(bits)
    if a_moves:
        c_moves = c.changes(bits)
    else:
        c_moves = bits.by(spec.ARC_LONE + min(streaks[third], 7)) if b_moves else 1
    if c_moves:
        c.turn_and_move(bits)
    a.record(a_moves)
    b.record(b_moves)
    c.record(c_moves)

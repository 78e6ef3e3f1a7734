"""Decoder of range-coded chains: ARC (protocol.md, section 7.7).

Bit after bit, as each depends on the one before. Must not know pages.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from voxdisplay.raster.display_list import Spread
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import spec

_LEAST_RANGE: Final = 1 << 24
_EVEN_CHANCE: Final = 4096
_SCALE_BITS: Final = 13
_HISTORY: Final = 127
_SIDE_BITS: Final = 10  # of a Morton index
_OLDER: Final = 63  # six steps of the history

# Pen of a piece: a pixel value, or a spread whose first place is that of its first voxel.
Ink = int | Spread


class _Bits:
    """Adaptive binary range decoder."""

    def __init__(self, data: bytes) -> None:
        self._data = data + bytes(spec.ARC_BEHIND)
        self._code = int.from_bytes(self._data[:3], "big")
        self._at = 3
        self._range = _LEAST_RANGE
        self._chance = [spec.ARC_HALF] * spec.ARC2_MODELS
        self._seen = [0] * spec.ARC2_MODELS

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
    data: bytes, grid: Grid, format_: PixelFormat, *, second: bool = False
) -> Iterator[tuple[Ink | None, list[int]]]:
    """Yield the pieces of an ARC: pen if it has one of its own, and indices of its voxels.

    Parameters
    ----------
    data : bytes
        All that follows the op byte.
    grid, format_
        Those of the display.
    second : bool
        Whether it is an ARC2.

    Raises
    ------
    ValueError
        If the data end early, have bytes behind the last bit, or leave the grid.

    """
    bits = _Bits(data)
    axes = [_Axis(side) for side in grid]
    first = True
    start = (0, 0, 0)
    while bits.by(spec.ARC_MORE):
        jump = first or bool(bits.by(spec.ARC_JUMP))
        ink = _ink(bits, format_, second=second) if bits.by(spec.ARC_INK) else None
        if jump:
            near = second and not first and max(grid) <= spec.ARC2_MAX_SIDE
            if near and bits.by(spec.ARC2_NEAR):
                start = _near_start(bits, start)
            else:
                x, y, z = (bits.plain((side - 1).bit_length()) for side in grid)
                start = (x, y, z)
            for axis, place in zip(axes, start, strict=True):
                axis.begin(place)
        first = False
        steps = bits.number()
        voxels = [_index(axes, grid)] if jump else []
        for _ in range(steps):
            _step(bits, axes)
            voxels.append(_index(axes, grid))
        yield ink, voxels
    if not bits.finished:
        raise ValueError("bytes behind the last bit of ARC")


def _ink(bits: _Bits, format_: PixelFormat, *, second: bool) -> Ink:
    """Read the pen of a piece."""
    if format_ is PixelFormat.MONO1:
        return bits.plain(1)
    if not second or not bits.by(spec.ARC2_FADE):
        return bits.plain(8 * format_.bytes)
    stops, count, place = bits.plain(4) + 1, bits.number() + 1, bits.number()
    if place >= count:
        raise ValueError(f"a fade begins at voxel {place} of {count}")
    size = 1 if format_ is PixelFormat.INDEX8 else 3
    colors = np.array([bits.plain(8) for _ in range(stops * size)], dtype=np.uint8)
    return Spread(colors.reshape(stops, size), count, place)


def _near_start(bits: _Bits, start: tuple[int, int, int]) -> tuple[int, int, int]:
    """Read a start by the difference of its Morton index from that of another."""
    k = 0
    while k < spec.ARC2_MAX_DELTA and bits.by(spec.ARC2_DELTA + k):
        k += 1
    morton = (1 << k) - 1 + bits.plain(k)
    morton += sum(
        (start[axis] >> bit & 1) << 3 * bit + axis for bit in range(_SIDE_BITS) for axis in range(3)
    )
    if morton >> 3 * _SIDE_BITS:
        raise ValueError("ARC2 leaves the grid at a start")
    x, y, z = (
        sum((morton >> 3 * bit + axis & 1) << bit for bit in range(_SIDE_BITS)) for axis in range(3)
    )
    return x, y, z


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

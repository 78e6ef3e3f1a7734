"""Decoder of pixel values in range-coded slabs: VALUES (protocol.md, section 7.13).

Bit after bit, as each depends on the one before. Must not know pages.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.kernel_backend import with_kernel
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import slab_coder, slab_values, spec
from voxdisplay.wire.op_encoding import Bools, Bytes, Ints
from voxdisplay.wire.slab_contexts import CELL
from voxdisplay.wire.slab_decoder import CUT_OFF, BitSource, SlabStream
from voxdisplay.wire.slab_values import LITERALS, NEIGHBOURS, WEIGHTS, Literals

_WHOLE, _CUT_OFF, _NO_PIXEL = range(3)
_ZERO_WEIGHT = 1 << spec.VALUES_WEIGHT_BITS - 1
# Neighbours as differences of z, y, x, in the order of the weights.
_AROUND = ((0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 0), (1, 1, 1))
Place = tuple[int, int, int]


def decode_valued_slabs(
    data: bytes, grid: Grid, format_: PixelFormat
) -> Iterator[tuple[Ints, Ints]]:
    """Yield scan-order indices and pixel values of each slab of a VALUES, each voxel once.

    Parameters
    ----------
    data : bytes
        What follows the op byte.
    grid : Grid
    format_ : PixelFormat
        Any but mono1.

    Raises
    ------
    ValueError
        If it is cut off or too long, leaves the grid, or has no pixel for a voxel.

    """
    stream = SlabStream(data)
    switches = np.zeros(2 + WEIGHTS, dtype=np.int64)
    switches[:2] = stream.plain(1), stream.plain(1)
    if switches[1]:
        weights = [stream.plain(spec.VALUES_WEIGHT_BITS) for _ in range(WEIGHTS)]
        switches[2:] = np.array(weights) - _ZERO_WEIGHT
    top = slab_values.levels(format_)
    table = slab_coder.state_table()
    for index, voxels, first in stream.slabs(grid, spec.VALUES_SIDE_BITS):
        if first:
            lit = np.zeros((CELL + 1, *voxels.shape[1:]), dtype=np.bool_)
            pixels = np.zeros((*lit.shape, len(top)), dtype=np.int16)
            carry = slab_values.initial_carry(format_)
        lit[0], pixels[0] = lit[-1], pixels[-1]
        lit[1:], pixels[1:] = voxels, 0
        state = (stream.state, stream.data)
        outcome = decode_values(*state, pixels, lit, carry, switches, top, table, LITERALS)
        if outcome == _CUT_OFF:
            raise ValueError(CUT_OFF)
        if outcome == _NO_PIXEL:
            raise ValueError("a value is no lit pixel")
        yield index, slab_values.join_channels(pixels[1:][voxels], format_)


@with_kernel
def decode_values(
    state: Ints,
    data: Bytes,
    pixels: NDArray[np.int16],
    lit: Bools,
    carry: Ints,
    switches: Ints,
    top: Ints,
    table: NDArray[np.int32],
    literals: Literals,
) -> int:
    """Decode the values of a slab; return 0, 1 if the data end before, or 2 if one is no pixel.

    Parameters
    ----------
    state, data, table
        As of `slab_decoder.decode_slab`.
    pixels : (5, 4 h, 4 w, c) int16 array
        Levels of the slice below and, filled in here, of the slab; 0 where dark.
    lit : (5, 4 h, 4 w) bool array
    carry, switches, top, literals
        As of `slab_values.value_decisions`; the carry is changed in place.

    """
    del table  # as lists, which are faster here
    source = BitSource(state, data.tobytes())
    slab = _Slab(source, pixels, lit, carry, switches, top, literals)
    outcome = _WHOLE
    try:
        for place in np.argwhere(lit[1:]).tolist():
            if not slab.decode((place[0] + 1, place[1], place[2])):
                outcome = _NO_PIXEL
                break
    except EOFError:
        outcome = _CUT_OFF
    source.save(state)
    carry[:] = slab.carry
    for (z, y, x), levels in slab.known.items():
        pixels[z, y, x] = levels
    return outcome


class _Slab:
    """A slab in the making: the levels of voxels that are known, by their place."""

    def __init__(
        self,
        source: BitSource,
        pixels: NDArray[np.int16],
        lit: Bools,
        carry: Ints,
        switches: Ints,
        top: Ints,
        literals: Literals,
    ) -> None:
        below = np.argwhere(lit[0]).tolist()
        self.known: dict[Place, list[int]] = {
            (0, y, x): levels
            for (y, x), levels in zip(below, pixels[0][lit[0]].tolist(), strict=True)
        }
        self._source = source
        self.carry: list[int] = carry.tolist()
        self._copies, self._weighted, *self._weights = switches.tolist()
        self._top = top.tolist()
        self._literals = literals

    def decode(self, place: Place) -> bool:
        """Decode a voxel; return False if it has no pixel."""
        z, y, x = place
        around = [self.known.get((z - dz, y - dy, x - dx)) for dz, dy, dx in _AROUND]
        channels = len(self._top)
        if self._copies:
            copy = self._copied(around[:NEIGHBOURS])
            self.carry[-1] = int(copy is None)
            if copy is not None:
                self.known[place] = copy
                self.carry[: 2 * channels] = copy + [0] * channels
                return True
        larger = 0
        levels: list[int] = []
        for channel, top in enumerate(self._top):
            residual, level = self._level(
                [each[channel] if each else None for each in around], channel, larger
            )
            if not 0 <= level <= top:
                return False
            levels.append(level)
            self.carry[channel] = level
            self.carry[channels + channel] = abs(residual)
            larger = max(larger, min(abs(residual), 2))
        self.known[place] = levels
        return any(levels)

    def _copied(self, near: list[list[int] | None]) -> list[int] | None:
        """Return the pixel that is copied, if any."""
        west, north, below = near
        alike = [
            one is not None and one == other
            for one, other in ((west, north), (west, below), (north, below))
        ]
        facts = [*(each is not None for each in near), *alike, bool(self.carry[-1])]
        context = self._literals[0] + sum(fact << n for n, fact in enumerate(facts))
        repeated = (False, alike[0], alike[1] or alike[2])
        for n, (pixel, known) in enumerate(zip(near, repeated, strict=True)):
            if pixel is not None and not known and self._source.bit(context + 128 * n):
                return pixel
        return None

    def _level(self, around: list[int | None], channel: int, larger: int) -> tuple[int, int]:
        """Decode the level of a channel; return its residual and itself."""
        before, top = self.carry[channel], self._top[channel]
        near = [level for level in around[:NEIGHBOURS] if level is not None]
        count = len(near)
        spread = max(near) - min(near) if count > 1 else 8
        if not near:
            value = before
        elif count < NEIGHBOURS:
            value = (sum(near) + count // 2) // count
        elif self._weighted:
            known = (before if level is None else level for level in around)
            value = sum(w * level for w, level in zip(self._weights, known, strict=True)) + 32 >> 6
        elif spread <= 8:
            value = 21 * near[0] + 21 * near[1] + 22 * near[2] + 32 >> 6
        else:
            low, middle, high = sorted(near)
            value = (high if high - middle <= middle - low else low) + middle + 1 >> 1
        value = min(max(value, 0), top)
        _, first, *_, per_set, _, _, most, _ = self._literals
        kind = min((spread + self.carry[len(self._top) + channel]).bit_length(), most)
        kind = max(kind, int(count < NEIGHBOURS))
        residual = self._residual(first + per_set * (3 * larger + channel), kind)
        return residual, value + residual

    def _residual(self, base: int, kind: int) -> int:
        _, _, zero, sign, magnitude, long, _, most_unary, most_long, *_, plain = self._literals
        bit = self._source.bit
        if not bit(base + zero + kind):
            return 0
        negative = bit(base + sign + kind)
        amount, rest = 0, 1
        while amount < most_unary and bit(base + magnitude + 16 * kind + amount):
            amount += 1
        if amount == most_unary:
            length = 0
            while length < most_long and bit(base + long + length):
                length += 1
            for _ in range(length):
                rest = rest << 1 | bit(plain)
        return -(amount + rest) if negative else amount + rest

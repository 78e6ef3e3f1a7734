"""Context modelling of pixel values in slabs: the decisions that code them (protocol.md, 7.13).

All contexts follow from the voxels and their values alone, so that those of many slabs are found at
once. Must not know a coder, nor payloads.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.kernel_backend import with_kernel
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import slab_coder, spec
from voxdisplay.wire.op_encoding import Bools, Bytes, Ints, concat_ranges
from voxdisplay.wire.slab_contexts import CELL, Models

NEIGHBOURS: Final = 3  # west, north and below
WEIGHTS: Final = 7
_LEVELS: Final = {
    PixelFormat.MONO1: (1,),
    PixelFormat.INDEX8: (255,),
    PixelFormat.RGB565: (31, 63, 31),
    PixelFormat.RGB888: (255, 255, 255),
}
_SHIFTS: Final = {
    PixelFormat.MONO1: (0,),
    PixelFormat.INDEX8: (0,),
    PixelFormat.RGB565: (11, 5, 0),
    PixelFormat.RGB888: (0, 8, 16),
}
# Literals, which must not be compiled in: an argument of both functions below.
LITERALS: Final = (
    spec.VALUES_COPY,
    spec.VALUES_CHANNEL,
    spec.VALUES_ZERO,
    spec.VALUES_SIGN,
    spec.VALUES_MAGNITUDE,
    spec.VALUES_LONG,
    spec.VALUES_SET,
    spec.VALUES_MAX_UNARY,
    spec.VALUES_MAX_LONG,
    spec.VALUES_MAX_CLASS,
    slab_coder.PLAIN,
)
Literals = tuple[int, int, int, int, int, int, int, int, int, int, int]
_FEW, _CLOSE = 8, 8  # spread of fewer than two neighbours; that up to which all three are averaged


@dataclass(frozen=True)
class ValueMode:
    """How an op codes its pixel values.

    Attributes
    ----------
    copies : bool
        True if it is asked first whether a pixel is that of a neighbour.
    weights : tuple of int, optional
        Of the seven neighbours, in 64ths; without them the three nearest predict.

    """

    copies: bool = False
    weights: tuple[int, ...] | None = None

    @property
    def switches(self) -> Ints:
        """Copies and weighted as 0 or 1, then the weights: (9,)."""
        weights = self.weights or (0,) * WEIGHTS
        return np.array((self.copies, self.weights is not None, *weights), dtype=np.int64)


def levels(format_: PixelFormat) -> Ints:
    """Return the highest level of each channel of a format, (c,)."""
    return np.array(_LEVELS[format_], dtype=np.int64)


def split_channels(values: NDArray[np.integer], format_: PixelFormat) -> NDArray[np.int16]:
    """Return the levels, (n, c), of pixel values, (n,)."""
    shifts = np.array(_SHIFTS[format_], dtype=np.int64)
    split = values.astype(np.int64)[:, None] >> shifts & levels(format_)
    return split.astype(np.int16)


def join_channels(channels: NDArray[np.integer], format_: PixelFormat) -> Ints:
    """Return the pixel values, (n,), of levels, (n, c)."""
    shifts = np.array(_SHIFTS[format_], dtype=np.int64)
    return np.asarray((channels.astype(np.int64) << shifts).sum(axis=1))


def initial_carry(format_: PixelFormat) -> Ints:
    """Return what a box begins with: levels before, errors, and whether no copy was made."""
    top = levels(format_)
    return np.concatenate(((top + 1) // 2, np.zeros(len(top) + 1, dtype=np.int64)))


@with_kernel
def value_decisions(
    pixels: NDArray[np.int16],
    lit: Bools,
    carry: Ints,
    switches: Ints,
    top: Ints,
    literals: Literals,
) -> tuple[Models, Bytes, Ints, Ints]:
    """Return the decisions that code the values of the slabs of a box, in order.

    Parameters
    ----------
    pixels : (4 (d + 1), 4 h, 4 w, c) int16 array
        Levels of the channels, 0 where dark; axes z, y, x. The first four slices are the slab
        before.
    lit : (4 (d + 1), 4 h, 4 w) bool array
    carry : (2 c + 1,) int64 array
        What the voxels before leave: as `initial_carry`.
    switches : (9,) int64 array
        Of `ValueMode`.
    top : (c,) int64 array
        Highest level of each channel.
    literals
        `LITERALS`.

    Returns
    -------
    models : (n,) int16 array
    bits : (n,) uint8 array
    ends : (d,) int64 array
        Number of decisions up to the end of each slab.
    carry : (2 c + 1,) int64 array
        What these voxels leave.

    """
    around = _Surroundings.of(pixels, lit)
    before = np.concatenate((carry[None, : len(top)], around.own[:-1]))
    residual = around.own - _predictions(around, before, switches, top)
    asked = np.zeros((len(residual), NEIGHBOURS), dtype=np.bool_)
    contexts, copied = np.zeros(len(residual), dtype=np.int64), asked[:, 0]
    if switches[0]:
        contexts, asked, copied = _copies(around, int(carry[-1]))
    error = np.where(copied[:, None], 0, np.abs(residual))
    errors = np.concatenate((carry[None, len(top) : -1], error[:-1]))
    spread = np.where(around.number[:, None] >= 2, around.high - around.low, _FEW)
    classes = np.minimum(_bit_lengths(spread + errors), literals[-2])
    classes = np.maximum(classes, around.number[:, None] < NEIGHBOURS)
    copy_bits = asked & around.same
    models, bits, ends = _emit(
        (literals[0] + contexts, asked, copy_bits), residual, classes, copied, literals
    )
    slab_ends = np.searchsorted(around.slab, np.arange(lit.shape[0] // CELL - 1), side="right")
    after = carry
    if len(residual):
        after = np.concatenate((around.own[-1], error[-1], [not copied[-1]])).astype(np.int64)
    return models, bits, np.concatenate(([0], ends))[slab_ends], after


class _Surroundings(NamedTuple):
    """Lit voxels in their order, and the neighbours that are known before each.

    Attributes
    ----------
    slab : (n,) int64 array
    own : (n, c) int64 array
        Levels.
    levels : (n, 7, c) int64 array
        Of west, north, below, north-west, west below, north below and north-west below.
    lit : (n, 7) bool array
    number : (n,) int64 array
        How many of the first three are lit.
    low, high : (n, c) int64 arrays
        Extremes of those.
    same : (n, 3) bool array
        Which of those are lit and have the same pixel.

    """

    slab: Ints
    own: Ints
    levels: Ints
    lit: Bools
    number: Ints
    low: Ints
    high: Ints
    same: Bools

    @classmethod
    def of(cls, pixels: NDArray[np.int16], lit: Bools) -> _Surroundings:
        depth, height, width, channels = pixels.shape
        framed = np.zeros((depth, height + 1, width + 1, channels), dtype=np.int64)
        framed[:, 1:, 1:] = pixels
        on = np.zeros(framed.shape[:3], dtype=np.bool_)
        on[:, 1:, 1:] = lit
        z, y, x = np.nonzero(lit[CELL:])
        row, layer = width + 1, (height + 1) * (width + 1)
        at = (z + CELL) * layer + (y + 1) * row + x + 1
        steps = np.array([1, row, layer, row + 1, layer + 1, layer + row, layer + row + 1])
        near = at[:, None] - steps
        flat, known = framed.reshape(-1, channels), on.reshape(-1)[near]
        own, found = flat[at], flat[near]
        first = known[:, :NEIGHBOURS]
        least = np.where(first[..., None], found[:, :NEIGHBOURS], 1 << 16).min(axis=1)
        same = first & (found[:, :NEIGHBOURS] == own[:, None]).all(axis=2)
        return cls(
            slab=z // CELL,
            own=own,
            levels=found,
            lit=known,
            number=first.sum(axis=1),
            low=least,
            high=found[:, :NEIGHBOURS].max(axis=1),
            same=same,
        )


def _predictions(around: _Surroundings, before: Ints, switches: Ints, top: Ints) -> Ints:
    """Return the predicted levels, (n, c)."""
    three = around.levels[:, :NEIGHBOURS]
    total = three.sum(axis=1)
    if switches[1]:
        known = np.where(around.lit[..., None], around.levels, before[:, None])
        by_three = ((known * switches[2:, None]).sum(axis=1) + 32) >> 6
    else:
        low, high = around.low, around.high
        middle = total - low - high
        upper = high - middle <= middle - low
        pair = (np.where(upper, high, low) + middle + 1) >> 1
        mean = (21 * three[:, 0] + 21 * three[:, 1] + 22 * three[:, 2] + 32) >> 6
        by_three = np.where(high - low <= _CLOSE, mean, pair)
    count = around.number[:, None]
    by_fewer = np.where(count > 0, (total + count // 2) // np.maximum(count, 1), before)
    return np.clip(np.where(count == NEIGHBOURS, by_three, by_fewer), 0, top)


def _copies(around: _Surroundings, missed: int) -> tuple[Ints, Bools, Bools]:
    """Return the context of each voxel, (n,), which copies are asked for, (n, 3), and made."""
    west, north, below = (around.levels[:, n] for n in range(NEIGHBOURS))
    lit = around.lit[:, :NEIGHBOURS]
    alike = [
        lit[:, a] & lit[:, b] & (one == other).all(axis=1)
        for a, b, one, other in ((0, 1, west, north), (0, 2, west, below), (1, 2, north, below))
    ]
    copied = np.asarray(around.same.any(axis=1))
    asked = lit.copy()
    asked[:, 1] &= ~alike[0] & ~around.same[:, 0]
    asked[:, 2] &= ~alike[1] & ~alike[2] & ~around.same[:, 0] & ~around.same[:, 1]
    no_copy = np.ones(len(copied), dtype=np.bool_)
    no_copy[1:] = ~copied[:-1]
    no_copy[:1] = missed > 0
    facts = np.stack((*lit.T, *alike, no_copy), axis=1)
    return facts @ (1 << np.arange(facts.shape[1])), asked, copied


def _bit_lengths(values: Ints) -> Ints:
    """Return the bit lengths of numbers from 0 on."""
    return np.searchsorted(1 << np.arange(16), values, side="right")


def _steps(counts: Ints) -> Ints:
    """Return 0, 1, ... up to each count, concatenated."""
    return concat_ranges(np.zeros_like(counts), counts)


def _emit(
    copies: tuple[Ints, Bools, Bools],
    residual: Ints,
    classes: Ints,
    copied: Bools,
    literals: Literals,
) -> tuple[Models, Bytes, Ints]:
    """Return models and bits, and their number up to the end of each voxel."""
    _, channel, zero, sign, magnitude, long, per_set, most_unary, most_long, *_, plain = literals
    voxels, channels = residual.shape
    amount = np.abs(residual)
    larger = np.zeros_like(amount)
    larger[:, 1:] = np.minimum(np.maximum.accumulate(amount, axis=1)[:, :-1], 2)
    bases = channel + per_set * (3 * larger + np.arange(channels))
    coded = np.repeat(~copied[:, None], channels, axis=1)
    nonzero = coded & (residual != 0)
    more = np.maximum(amount - 1, 0)
    unary = np.minimum(more, most_unary)
    unary += (unary < most_unary) & nonzero
    rest = more - most_unary
    is_long = nonzero & (rest >= 0)
    length = np.where(is_long, _bit_lengths(np.maximum(rest, 0) + 1) - 1, 0)
    prefix = (length + (length < most_long)) * is_long
    counts = np.empty((voxels, channels + 1), dtype=np.int64)
    context, asked, copy_bits = copies
    counts[:, 0] = asked.sum(axis=1)
    counts[:, 1:] = coded + nonzero * (1 + unary) + prefix + length
    ends = np.cumsum(counts)
    start = (ends - counts.reshape(-1)).reshape(counts.shape)
    models = np.empty(int(ends[-1]) if len(ends) else 0, dtype=np.int16)
    bits = np.empty(len(models), dtype=np.uint8)

    voxel, neighbour = np.nonzero(asked)
    at = start[voxel, 0] + (np.cumsum(asked, axis=1) - 1)[voxel, neighbour]
    models[at], bits[at] = context[voxel] + 128 * neighbour, copy_bits[voxel, neighbour]

    begin = start[:, 1:]
    at = begin[coded]
    models[at], bits[at] = (bases + zero + classes)[coded], nonzero[coded]
    at = begin[nonzero] + 1
    models[at], bits[at] = (bases + sign + classes)[nonzero], (residual < 0)[nonzero]
    count = unary[nonzero]
    step = _steps(count)
    at = concat_ranges(begin[nonzero] + 2, count)
    models[at] = np.repeat((bases + magnitude + 16 * classes)[nonzero], count) + step
    bits[at] = step < np.repeat(more[nonzero], count)
    count, exponent = prefix[is_long], length[is_long]
    step = _steps(count)
    begin = begin[is_long] + 2 + most_unary
    at = concat_ranges(begin, count)
    models[at] = np.repeat(bases[is_long] + long, count) + step
    bits[at] = step < np.repeat(exponent, count)
    at = concat_ranges(begin + count, exponent)
    value = np.repeat(rest[is_long] + 1 - (1 << exponent), exponent)
    models[at] = plain
    bits[at] = value >> (np.repeat(exponent, exponent) - 1 - _steps(exponent)) & 1
    return models, bits, ends.reshape(counts.shape)[:, -1]

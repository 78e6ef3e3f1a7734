"""Compiled kernels of the coding of pixel values in slabs: twins of the functions of their names.

Constants of other modules are arguments: see `voxdisplay.compute.kernel_backend.jit`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.kernel_backend import jit

_CELL = 4  # voxels along the side of a cell: as the shape of the contexts, no parameter
_MOST_BITS = 34  # decisions of a channel, at most


@jit
def predicted(
    pixels: NDArray[np.int16],
    lit: NDArray[np.bool_],
    place: tuple[int, int, int, int],
    before: int,
    switches: NDArray[np.int64],
    top: int,
) -> tuple[int, int, int]:
    """Return the prediction of a channel, its neighbours' spread, and how many of them are lit."""
    z, y, x, channel = place
    count = 0
    total = 0
    low, high = 1 << 16, 0
    mean, weighted = 32, 32
    for n in range(7 if switches[1] else 3):
        # West, north, below, north-west, west below, north below, north-west below.
        dx, dy, dz = 0b1011001 >> n & 1, 0b1101010 >> n & 1, 0b1110100 >> n & 1
        level = before
        if x >= dx and y >= dy and lit[z - dz, y - dy, x - dx]:
            level = int(pixels[z - dz, y - dy, x - dx, channel])
            if n < 3:
                count += 1
                total += level
                low, high = min(low, level), max(high, level)
                mean += (22 if n == 2 else 21) * level
        weighted += switches[2 + n] * level
    spread = high - low if count >= 2 else 8
    if count == 0:
        value = before
    elif count < 3:
        value = (total + count // 2) // count
    elif switches[1]:
        value = weighted >> 6
    elif spread <= 8:
        value = mean >> 6
    else:
        middle = total - low - high
        value = (high + middle + 1) >> 1
        if high - middle > middle - low:
            value = (low + middle + 1) >> 1
    return min(max(value, 0), top), spread, count


@jit
def copy_context(
    pixels: NDArray[np.int16], lit: NDArray[np.bool_], place: tuple[int, int, int], missed: int
) -> tuple[int, int]:
    """Return the context of copies, and which neighbours are asked for, as bits."""
    z, y, x = place
    context = missed << 6
    for n in range(3):
        dx, dy, dz = n == 0, n == 1, n == 2
        if x >= dx and y >= dy and lit[z - dz, y - dy, x - dx]:
            context |= 1 << n
    asked = context & 7
    pair = 0
    for a in range(2):
        for b in range(a + 1, 3):
            if context >> a & context >> b & 1:
                alike = True
                for channel in range(pixels.shape[3]):
                    one = pixels[z - (a == 2), y - (a == 1), x - (a == 0), channel]
                    other = pixels[z - (b == 2), y - (b == 1), x - (b == 0), channel]
                    alike &= one == other
                if alike:
                    context |= 8 << pair
                    asked &= ~(1 << b)
            pair += 1
    return context, asked


@jit
def value_class(spread: int, error: int, count: int, most: int) -> int:
    """Return the class of a residual."""
    number = 0
    rest = spread + error
    while rest and number < most:
        rest >>= 1
        number += 1
    return max(number, 1) if count < 3 else number


@jit
def value_decisions(
    pixels: NDArray[np.int16],
    lit: NDArray[np.bool_],
    carry: NDArray[np.int64],
    switches: NDArray[np.int64],
    top: NDArray[np.int64],
    literals: tuple[int, int, int, int, int, int, int, int, int, int, int],
) -> tuple[NDArray[np.int16], NDArray[np.uint8], NDArray[np.int64], NDArray[np.int64]]:
    """See `voxdisplay.wire.slab_values.value_decisions`."""
    copy, first, zero, sign, magnitude = literals[:5]
    long, per_set, most_unary, most_long, most_class, plain = literals[5:]
    channels = len(top)
    state = carry.copy()
    depth, height, width = lit.shape
    count = 0
    for z in range(_CELL, depth):
        for y in range(height):
            for x in range(width):
                count += lit[z, y, x]
    models = np.empty((3 + _MOST_BITS * channels) * count, dtype=np.int16)
    bits = np.empty(len(models), dtype=np.uint8)
    ends = np.empty(depth // _CELL - 1, dtype=np.int64)
    n = 0
    for z in range(_CELL, depth):
        for y in range(height):
            for x in range(width):
                if not lit[z, y, x]:
                    continue
                copied = False
                if switches[0]:
                    context, asked = copy_context(pixels, lit, (z, y, x), state[2 * channels])
                    for neighbour in range(3):
                        if copied or not asked >> neighbour & 1:
                            continue
                        copied = True
                        for channel in range(channels):
                            other = pixels[
                                z - (neighbour == 2), y - (neighbour == 1), x - (neighbour == 0),
                                channel,
                            ]  # fmt: skip
                            copied &= other == pixels[z, y, x, channel]
                        models[n] = copy + 128 * neighbour + context
                        bits[n] = copied
                        n += 1
                larger = 0
                for channel in range(channels):
                    own = int(pixels[z, y, x, channel])
                    before = state[channel]
                    state[channel] = own
                    if copied:
                        state[channels + channel] = 0
                        continue
                    guess, spread, known = predicted(
                        pixels, lit, (z, y, x, channel), before, switches, top[channel]
                    )
                    error = state[channels + channel]
                    kind = value_class(spread, error, known, most_class)
                    base = first + per_set * (3 * larger + channel)
                    residual = own - guess
                    amount = abs(residual)
                    state[channels + channel] = amount
                    larger = max(larger, min(amount, 2))
                    models[n], bits[n] = base + zero + kind, residual != 0
                    n += 1
                    if residual == 0:
                        continue
                    models[n], bits[n] = base + sign + kind, residual < 0
                    n += 1
                    step = 0
                    while step < most_unary:
                        more = amount - 1 > step
                        models[n], bits[n] = base + magnitude + 16 * kind + step, more
                        n += 1
                        if not more:
                            break
                        step += 1
                    if step < most_unary:
                        continue
                    rest = amount - most_unary  # one more than what is left
                    length = 0
                    while length < most_long:
                        more = rest >> (length + 1) > 0
                        models[n], bits[n] = base + long + length, more
                        n += 1
                        if not more:
                            break
                        length += 1
                    for place in range(length - 1, -1, -1):
                        models[n], bits[n] = plain, rest >> place & 1
                        n += 1
                state[2 * channels] = not copied
        if z % _CELL == _CELL - 1:
            ends[z // _CELL - 1] = n
    return models[:n].copy(), bits[:n].copy(), ends, state


@jit
def next_bit(
    state: NDArray[np.int64], data: NDArray[np.uint8], model: int, table: NDArray[np.int32]
) -> int:
    """Return a bit; behind the data zeros are read, and counted."""
    models = len(state) - 3
    code, span, at = state[models], state[models + 1], state[models + 2]
    now = state[model]
    bound = (span >> 13) * table[0, now]
    bit = 1 if code >= bound else 0
    if bit:
        code -= bound
        span -= bound
    else:
        span = bound
    state[model] = table[1 + bit, now]
    while span < 1 << 24:
        span <<= 8
        code = code << 8 | (data[at] if at < len(data) else 0)
        at += 1
    state[models], state[models + 1], state[models + 2] = code, span, at
    return bit


@jit
def decode_residual(
    state: NDArray[np.int64],
    data: NDArray[np.uint8],
    base: int,
    kind: int,
    table: NDArray[np.int32],
    literals: tuple[int, int, int, int, int, int, int, int, int, int, int],
) -> int:
    """Return the residual of a channel."""
    _, _, zero, sign, magnitude, long, _, most_unary, most_long, _, plain = literals
    if not next_bit(state, data, base + zero + kind, table):
        return 0
    negative = next_bit(state, data, base + sign + kind, table)
    step = 0
    while step < most_unary and next_bit(state, data, base + magnitude + 16 * kind + step, table):
        step += 1
    rest = 1
    if step == most_unary:
        length = 0
        while length < most_long and next_bit(state, data, base + long + length, table):
            length += 1
        for _ in range(length):
            rest = rest << 1 | next_bit(state, data, plain, table)
    return -(step + rest) if negative else step + rest


@jit
def decode_values(
    state: NDArray[np.int64],
    data: NDArray[np.uint8],
    pixels: NDArray[np.int16],
    lit: NDArray[np.bool_],
    carry: NDArray[np.int64],
    switches: NDArray[np.int64],
    top: NDArray[np.int64],
    table: NDArray[np.int32],
    literals: tuple[int, int, int, int, int, int, int, int, int, int, int],
) -> int:
    """See `voxdisplay.wire.slab_value_decoder.decode_values`."""
    copy, first = literals[:2]
    per_set, most_class = literals[6], literals[9]
    channels = len(top)
    for z in range(1, _CELL + 1):
        for y in range(lit.shape[1]):
            for x in range(lit.shape[2]):
                if not lit[z, y, x]:
                    continue
                copied = False
                if switches[0]:
                    context, asked = copy_context(pixels, lit, (z, y, x), carry[2 * channels])
                    for neighbour in range(3):
                        if copied or not asked >> neighbour & 1:
                            continue
                        model = copy + 128 * neighbour + context
                        copied = next_bit(state, data, model, table) > 0
                        if not copied:
                            continue
                        for channel in range(channels):
                            level = pixels[
                                z - (neighbour == 2), y - (neighbour == 1), x - (neighbour == 0),
                                channel,
                            ]  # fmt: skip
                            pixels[z, y, x, channel] = level
                            carry[channel], carry[channels + channel] = level, 0
                carry[2 * channels] = not copied
                larger, bright = 0, 0
                for channel in range(0 if copied else channels):
                    guess, spread, known = predicted(
                        pixels, lit, (z, y, x, channel), carry[channel], switches, top[channel]
                    )
                    kind = value_class(spread, carry[channels + channel], known, most_class)
                    base = first + per_set * (3 * larger + channel)
                    residual = decode_residual(state, data, base, kind, table, literals)
                    level = guess + residual
                    if level < 0 or level > top[channel]:
                        return 1 if state[-1] > len(data) else 2
                    pixels[z, y, x, channel] = level
                    carry[channel] = level
                    carry[channels + channel] = abs(residual)
                    larger = max(larger, min(abs(residual), 2))
                    bright |= level
                if state[-1] > len(data):
                    return 1
                if not (copied or bright):
                    return 2
    return 0

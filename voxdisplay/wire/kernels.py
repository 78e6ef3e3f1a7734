"""Compiled kernels of the coding of slabs: twins of the functions of their names.

Constants of other modules are arguments: see `voxdisplay.compute.kernel_backend.jit`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.kernel_backend import jit
from voxdisplay.wire.value_kernels import decode_values, value_decisions

__all__ = ["code_bits", "decode_slab", "decode_values", "slab_decisions", "value_decisions"]

_CELL = 4  # voxels along the side of a cell: as the shape of the contexts, no parameter


@jit
def slab_decisions(
    voxels: NDArray[np.bool_], bases: tuple[int, int, int, int]
) -> tuple[NDArray[np.int16], NDArray[np.uint8], NDArray[np.int64]]:
    """See `voxdisplay.wire.slab_contexts.slab_decisions`."""
    flag, full_flag, group, shape = bases
    depth, height, width = (
        voxels.shape[0] // _CELL - 1,
        voxels.shape[1] // _CELL,
        voxels.shape[2] // _CELL,
    )
    models = np.empty(82 * depth * height * width, dtype=np.int16)
    bits = np.empty(len(models), dtype=np.uint8)
    ends = np.empty(depth, dtype=np.int64)
    n = 0
    # Voxels and states of cells with a dark rim, so that no neighbour needs a test.
    tall, wide = voxels.shape[1] + 2, voxels.shape[2] + 2
    now, below = np.zeros((tall, wide), dtype=np.int64), np.zeros((tall, wide), dtype=np.int64)
    state = np.zeros((height + 2, width + 2), dtype=np.int64)
    state_before = np.zeros((height + 2, width + 2), dtype=np.int64)
    under = np.zeros((height + 2, width + 2), dtype=np.int64)
    for slab in range(depth + 1):
        state_before, state = state, state_before
        state[:] = 0
        for cell_y in range(height):
            for cell_x in range(width):
                count = 0
                last = 0
                for a in range(_CELL):
                    last = 0
                    for y in range(_CELL * cell_y, _CELL * cell_y + _CELL):
                        for x in range(_CELL * cell_x, _CELL * cell_x + _CELL):
                            last += voxels[_CELL * slab + a, y, x]
                    count += last
                state[cell_y + 1, cell_x + 1] = 0 if count == 0 else 2 if count == 64 else 1
                if slab:
                    continue
                under[cell_y + 1, cell_x + 1] = 0 if last == 0 else 2 if last == 16 else 1
        if slab == 0:
            below[1:-1, 1:-1] = voxels[_CELL - 1]
            continue
        for cell_y in range(1, height + 1):
            for cell_x in range(1, width + 1):
                w, north = state[cell_y, cell_x - 1], state[cell_y - 1, cell_x]
                nw, ne = state[cell_y - 1, cell_x - 1], state[cell_y - 1, cell_x + 1]
                u, e = under[cell_y, cell_x], under[cell_y, cell_x + 1]
                s = under[cell_y + 1, cell_x]
                context = (w > 0) | (north > 0) << 1 | (nw > 0) << 2 | (ne > 0) << 3
                context |= (u > 0) << 4 | (e > 0) << 5 | (s > 0) << 6
                context |= (state_before[cell_y, cell_x] > 0) << 7
                own = state[cell_y, cell_x]
                models[n] = flag + context
                bits[n] = own > 0
                n += 1
                if own:
                    context = (w == 2) | (north == 2) << 1 | (u == 2) << 2
                    context |= (e == 2) << 3 | (s == 2) << 4 | (ne == 2) << 5
                    models[n] = full_flag + context
                    bits[n] = own == 2
                    n += 1
        for a in range(_CELL):
            now[1:-1, 1:-1] = voxels[_CELL * slab + a]
            for y in range(1, tall - 1):
                cell_y = (y - 1) // _CELL + 1
                for cell_x in range(1, width + 1):
                    if state[cell_y, cell_x] != 1:
                        continue
                    first = _CELL * (cell_x - 1) + 1
                    some = now[y, first - 1]
                    every = some
                    for x in range(first - 1, first + _CELL + 1):
                        p, q, r, s = now[y - 1, x], below[y - 1, x], below[y, x], below[y + 1, x]
                        some |= p | q | r | s
                        every &= p & q & r & s
                    if every or not some:
                        differs = False
                        for x in range(first, first + _CELL):
                            differs |= now[y, x] != every
                        context = (y - 1) % _CELL + _CELL * a + 16 * every
                        models[n] = group + context + 32 * (state[cell_y, cell_x + 1] > 0)
                        bits[n] = differs
                        n += 1
                        if not differs:
                            continue
                    for x in range(first, first + _CELL):
                        context = now[y - 1, x - 1] | now[y - 1, x] << 1 | now[y - 1, x + 1] << 2
                        context |= below[y, x - 1] << 3 | below[y, x] << 4 | below[y, x + 1] << 5
                        context |= below[y + 1, x - 1] << 6 | below[y + 1, x] << 7
                        context |= below[y + 1, x + 1] << 8 | below[y - 1, x] << 9
                        context |= now[y, x - 1] << 10
                        models[n] = shape + context
                        bits[n] = now[y, x]
                        n += 1
            below, now = now, below
        for cell_y in range(height):
            for cell_x in range(width):
                last = 0
                for y in range(_CELL * cell_y + 1, _CELL * cell_y + _CELL + 1):
                    for x in range(_CELL * cell_x + 1, _CELL * cell_x + _CELL + 1):
                        last += below[y, x]
                under[cell_y + 1, cell_x + 1] = 0 if last == 0 else 2 if last == 16 else 1
        ends[slab - 1] = n
    return models[:n].copy(), bits[:n].copy(), ends


@jit
def code_bits(
    state: NDArray[np.int64],
    models: NDArray[np.int16],
    bits: NDArray[np.uint8],
    out: NDArray[np.int64],
    table: NDArray[np.int32],
    limit: int,
) -> bool:
    """See `voxdisplay.wire.slab_coder.code_bits`."""
    count = len(state)
    low, span, size = state[count - 3], state[count - 2], state[count - 1]
    for i in range(len(models)):
        now = state[models[i]]
        bound = (span >> 13) * table[0, now]
        if bits[i]:
            low += bound
            span -= bound
            state[models[i]] = table[2, now]
        else:
            span = bound
            state[models[i]] = table[1, now]
        while span < 1 << 24:
            if size >= limit:
                return False
            out[size] = low >> 24
            size += 1
            low = (low & 0xFFFFFF) << 8
            span <<= 8
    state[count - 3], state[count - 2], state[count - 1] = low, span, size
    return True


@jit
def decode_slab(
    state: NDArray[np.int64],
    data: NDArray[np.uint8],
    states: NDArray[np.int64],
    below: NDArray[np.int64],
    lit: NDArray[np.bool_],
    table: NDArray[np.int32],
    bases: tuple[int, int, int, int],
) -> bool:
    """See `voxdisplay.wire.slab_decoder.decode_slab`."""
    flag, full_flag, group, shape = bases
    tall, wide = below.shape
    height, width = states.shape[0] - 2, states.shape[1] - 2
    models = len(state) - 3
    code, span, at = state[models], state[models + 1], state[models + 2]
    under = np.zeros_like(states)
    for y in range(height):
        for x in range(width):
            count = 0
            for row in range(_CELL * y + 1, _CELL * y + _CELL + 1):
                for column in range(_CELL * x + 1, _CELL * x + _CELL + 1):
                    count += below[row, column]
            under[y + 1, x + 1] = 0 if count == 0 else 2 if count == 16 else 1
    now_states = np.zeros_like(states)
    # First the states of all cells, then the four slices; in both, one bit after another.
    for y in range(1, height + 1):
        for x in range(1, width + 1):
            w, n = now_states[y, x - 1], now_states[y - 1, x]
            nw, ne = now_states[y - 1, x - 1], now_states[y - 1, x + 1]
            u, e, s = under[y, x], under[y, x + 1], under[y + 1, x]
            context = (w > 0) | (n > 0) << 1 | (nw > 0) << 2 | (ne > 0) << 3
            context |= (u > 0) << 4 | (e > 0) << 5 | (s > 0) << 6 | (states[y, x] > 0) << 7
            model = flag + context
            for decision in range(2):
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
                    if at == len(data):
                        return False
                    span <<= 8
                    code = code << 8 | data[at]
                    at += 1
                if decision:
                    now_states[y, x] = 1 + bit
                if not bit:
                    break
                context = (w == 2) | (n == 2) << 1 | (u == 2) << 2
                context |= (e == 2) << 3 | (s == 2) << 4 | (ne == 2) << 5
                model = full_flag + context
    states[:] = now_states
    now_slice = np.zeros((tall, wide), dtype=np.int64)
    for a in range(_CELL):
        now_slice[:] = 0
        for y in range(1, tall - 1):
            cell_y = (y - 1) // _CELL + 1
            for cell_x in range(1, width + 1):
                cell = states[cell_y, cell_x]
                if cell == 0:
                    continue
                first = _CELL * (cell_x - 1) + 1
                if cell == 2:
                    for x in range(first, first + _CELL):
                        now_slice[y, x] = 1
                    continue
                some = now_slice[y, first - 1]
                every = some
                for x in range(first - 1, first + _CELL + 1):
                    p, q = now_slice[y - 1, x], below[y - 1, x]
                    r, s = below[y, x], below[y + 1, x]
                    some |= p | q | r | s
                    every &= p & q & r & s
                uniform = every == 1 or some == 0
                for decision in range(0 if uniform else 1, _CELL + 1):
                    x = first + decision - 1
                    if decision == 0:
                        model = group + (y - 1) % _CELL + _CELL * a + 16 * every
                        model += 32 * (states[cell_y, cell_x + 1] > 0)
                    else:
                        model = shape + now_slice[y - 1, x - 1] + 2 * now_slice[y - 1, x]
                        model += 4 * now_slice[y - 1, x + 1] + 8 * below[y, x - 1]
                        model += 16 * below[y, x] + 32 * below[y, x + 1] + 64 * below[y + 1, x - 1]
                        model += 128 * below[y + 1, x] + 256 * below[y + 1, x + 1]
                        model += 512 * below[y - 1, x] + 1024 * now_slice[y, x - 1]
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
                        if at == len(data):
                            return False
                        span <<= 8
                        code = code << 8 | data[at]
                        at += 1
                    if decision:
                        now_slice[y, x] = bit
                    elif not bit:
                        for column in range(first, first + _CELL):
                            now_slice[y, column] = every
                        break
        for y in range(tall - 2):
            for x in range(wide - 2):
                lit[a, y, x] = now_slice[y + 1, x + 1] > 0
        below[:] = now_slice
    state[models], state[models + 1], state[models + 2] = code, span, at
    return True

"""Adaptive binary range coder of slabs, one model a bit (protocol.md, sections 7.7, 7.11, 7.13).

Must not know what the bits mean.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.kernel_backend import with_kernel
from voxdisplay.wire import spec
from voxdisplay.wire.op_encoding import Bytes, Ints
from voxdisplay.wire.slab_contexts import Models

# Model of the bits that have none: its state never changes.
PLAIN = spec.VALUES_MODELS
_ONE = 4096
_LEAST_RANGE = 1 << 24
_FIXED = _ONE << 3
_FIRST_OF_VALUES = _FIXED + 1  # states of the models of pixel values follow those of the others
_LOW, _RANGE, _SIZE = PLAIN + 1, PLAIN + 2, PLAIN + 3


@cache
def state_table() -> NDArray[np.int32]:
    """Return twice the chance of a 0 in each state of a model, and the states after a 0 and a 1.

    A state is 8 times the chance, in parts of 4096, plus the bits seen, up to SLABS_ENOUGH; those
    of models of pixel values, which adapt at another pace, are _FIRST_OF_VALUES higher.
    """
    slabs = _adaptive_states(spec.SLABS_PACE)
    values = _adaptive_states(spec.VALUES_PACE)
    values[1:] += _FIRST_OF_VALUES
    table = np.concatenate((slabs, [[_ONE], [_FIXED], [_FIXED]], values), axis=1)
    return table.astype(np.int32)


def _adaptive_states(pace: int) -> Ints:
    """Return the table of models that adapt at a pace, (3, 4096 * 8)."""
    state = np.arange(_ONE << 3)
    p, seen = state >> 3, state & 7
    shift = 1 + seen // pace
    more = np.minimum(seen + 1, spec.SLABS_ENOUGH)
    return np.stack(
        (2 * p, (p + ((_ONE - p) >> shift)) << 3 | more, (p - (p >> shift)) << 3 | more)
    )


@cache
def table_lists() -> list[list[int]]:
    """Return the rows of `state_table` as lists."""
    lists: list[list[int]] = state_table().tolist()
    return lists


def initial_state() -> Ints:
    """Return the state of a coder that has coded nothing."""
    state = np.full(_SIZE + 1, spec.ARC_HALF << 3, dtype=np.int64)
    state[spec.SLABS_MODELS : PLAIN] += _FIRST_OF_VALUES
    state[PLAIN:] = _FIXED, 0, _LEAST_RANGE, 0
    return state


def coded_bytes(state: Ints) -> int:
    """Return the bytes coded so far."""
    return int(state[_SIZE])


def finish(state: Ints, out: Ints) -> bytes:
    """Return the bytes; the last three that a decoder reads are 0 and are not sent."""
    size = coded_bytes(state)
    parts = np.append(out[:size], (int(state[_LOW]) + _LEAST_RANGE - 1) >> 24)
    data = parts.astype(np.uint8).tobytes()
    carries = (parts >> 8).astype(np.uint8).tobytes()
    total = int.from_bytes(data, "big") + (int.from_bytes(carries, "big") << 8)
    return total.to_bytes(len(parts) - 1, "big")


@with_kernel
def code_bits(
    state: Ints, models: Models, bits: Bytes, out: Ints, table: NDArray[np.int32], limit: int
) -> bool:
    """Encode bits; return False once they take more bytes than the limit.

    Parameters
    ----------
    state : (models + 4,) int64 array
        State of each model, then low, range and bytes so far; changed in place.
    models, bits : (n,) arrays
        Model and value of each bit.
    out : int64 array
        Bytes with their carry into the byte before; changed in place.
    table : (3, states) int32 array
        Of `state_table`.
    limit : int
        Bytes, below the size of ``out``.

    """
    del table  # as lists, which are faster here
    chance, *after = table_lists()
    states = state[: PLAIN + 1].tolist()
    low, span, size = state[_LOW:].tolist()
    coded: list[int] = []
    room = limit - size
    fits = True
    for model, bit in zip(models.tolist(), bits.tolist(), strict=True):
        now = states[model]
        bound = (span >> 13) * chance[now]
        if bit:
            low += bound
            span -= bound
        else:
            span = bound
        states[model] = after[bit][now]
        while span < _LEAST_RANGE:
            coded.append(low >> 24)
            low = (low & 0xFFFFFF) << 8
            span <<= 8
        if len(coded) > room:
            fits = False
            break
    if fits:
        out[size : size + len(coded)] = coded
        state[: PLAIN + 1] = states
        state[_LOW:] = low, span, size + len(coded)
    return fits

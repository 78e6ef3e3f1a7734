"""Optimal parse of pixel runs into SKIP, RUN, LIT and DIFF: a shortest path (Viterbi).

One state for each op that may continue: an open LIT or DIFF costs no new op byte, and a DIFF needs
the pen left by the run before. The recurrence is vectorised over many stretches of the page. Must
not encode: it counts bits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import spec
from voxdisplay.wire.incremental_work import Incremental
from voxdisplay.wire.op_encoding import Bools, EncoderConfig, Ints, counted_op_bytes

# States: the op that drew the previous run.
_LIT, _DIFF, _RUN, _SKIP = range(4)
# Choices for a run: the op for its first pixel or all of it, and the op for the rest, or 0.
LIT, DIFF, RUN, SKIP = spec.OP_LIT, spec.OP_DIFF, spec.OP_RUN, spec.OP_SKIP
OP_PAIRS = np.array(
    [(LIT, 0), (DIFF, 0), (LIT, RUN), (DIFF, RUN), (RUN, 0), (RUN, 0), (SKIP, 0), (LIT, DIFF)]
)
_ALL_LIT, _ALL_DIFF, _LIT_RUN, _DIFF_RUN, _PEN_RUN, _SAME_RUN, _SKIPPED, _LIT_DIFF = range(8)

# Costs are bits; an impossible choice costs more than any path. The low bits of a cost hold its
# back pointer: the previous state in two bits, the row of `OP_PAIRS` in three, so that one minimum
# finds both.
_NEVER = 1 << 23
_FROM_BITS, _CODE_BITS = 2, 5
_CODE = (1 << _CODE_BITS) - 1
_OP_BITS = 8
# On average, a DIFF wastes a quarter of a byte: half a byte if its number of pixels is odd.
_DIFF_BITS = _OP_BITS + 2
# Longer runs are never LIT or DIFF.
_LONG = 1 << 12
# Runs of a stretch, at most and at least; the first of a stretch cannot be a DIFF.
_STRETCH, _LEAST_STRETCH = 96, 24
# Rows of all stretches per step of the incremental work.
_STEP = 16

Costs = NDArray[np.int32]


@dataclass(frozen=True)
class Runs:
    """Maximal runs of equal pixels in scan order.

    Attributes
    ----------
    start, length, value : (n,) int64 arrays
    may_skip : (n,) bool array
        True if the page has these pixels already; no two such runs are adjacent.
    may_write : (n,) bool array
        True if the pixels are one value; otherwise they must be skipped.

    """

    start: Ints
    length: Ints
    value: Ints
    skippable: Bools
    writable: Bools


def cheapest_ops(runs: Runs, config: EncoderConfig) -> Incremental[Ints]:
    """Return the row of `OP_PAIRS` for each run that gives the fewest bytes, incrementally."""
    n = len(runs.start)
    if n == 0:
        return np.empty(0, dtype=np.int64)
    height = max(_LEAST_STRETCH, min(_STRETCH, n // 64), int((n / 16) ** 0.5))
    height = min(n, height)
    width = -(-n // height)
    yield
    of = {name: _to_columns(cost, height, width) for name, cost in _costs(runs, config).items()}
    # At the start of a stretch the pen is unknown, except for the first, which begins a packet.
    for name in ("no_diff", "no_diff_behind_skip", "same_run"):
        of[name][0, 1:] = _NEVER << _CODE_BITS

    back = np.empty((height, 4, width), dtype=np.uint8)
    states = np.arange(4, dtype=np.int32)[:, None]
    cost = np.full((4, width), _NEVER << _CODE_BITS, dtype=np.int32) + states
    cost[_RUN] = _RUN
    cost[_SKIP, 0] = _SKIP
    new = np.empty_like(cost)
    into_lit, into_diff = _OP_BITS << _CODE_BITS, _DIFF_BITS << _CODE_BITS
    for row in range(height):
        if row % _STEP == 0:
            yield
        lit, diff, run, skip = cost
        drawn = np.minimum(np.minimum(lit, diff), run)
        any_ = np.minimum(drawn, skip)
        by_lit = np.minimum(lit, any_ + into_lit)
        by_diff = np.minimum(diff, np.minimum(lit, run) + into_diff) + of["no_diff"][row]
        by_diff = np.minimum(by_diff, skip + into_diff + of["no_diff_behind_skip"][row])
        np.add(by_lit, of["lit"][row], out=new[_LIT])
        np.minimum(by_diff + of["diff"][row], by_lit + of["lit_diff"][row], out=new[_DIFF])
        run = np.minimum(by_lit + of["lit_run"][row], by_diff + of["diff_run"][row])
        run = np.minimum(run, any_ + of["pen_run"][row])
        np.minimum(run, skip + of["same_run"][row], out=new[_RUN])
        np.add(drawn, of["skip"][row], out=new[_SKIP])
        back[row] = np.bitwise_and(new, _CODE, dtype=np.int32)
        cost = (new & ~_CODE) + states
    yield
    return _trace_back(back, cost.argmin(axis=0)).T.reshape(-1)[:n]


def _costs(runs: Runs, config: EncoderConfig) -> dict[str, Costs]:
    """Return the bits of each choice for each run, without the op byte of an open LIT or DIFF."""
    value = runs.value.astype(np.int32)
    length = np.minimum(runs.length, _LONG).astype(np.int32)
    pixel = 1 if config.format is PixelFormat.MONO1 else 8 * config.format.bytes
    run = 8 * counted_op_bytes(runs.length).astype(np.int32)
    tail = 8 * counted_op_bytes(np.maximum(runs.length - 1, 1)).astype(np.int32)
    before, before_skip = np.full((2, len(value)), 1 << 30, dtype=np.int32)
    before[1:] = value[:-1]
    before_skip[:1] = config.format.full
    before_skip[2:] = np.where(runs.skippable[1:-1], value[:-2], 1 << 30)
    may_diff = config.has(spec.FEATURE_DIFF)
    writes, several = runs.writable, runs.writable & (length > 1)

    def cost(row: int, bits: Costs | int, when: Bools) -> Costs:
        costs = np.where(when, np.int32(bits), np.int32(_NEVER))
        costs <<= _CODE_BITS
        costs |= row << _FROM_BITS
        return costs

    return {
        "lit": cost(_ALL_LIT, pixel * length, writes),
        "diff": cost(_ALL_DIFF, 4 * length, writes),
        "lit_run": cost(_LIT_RUN, pixel + tail, several),
        "diff_run": cost(_DIFF_RUN, 4 + tail, several),
        "pen_run": cost(_PEN_RUN, 8 * config.pen_bytes + run, writes),
        "same_run": cost(_SAME_RUN, run, value == before_skip),
        "skip": cost(_SKIPPED, run, runs.skippable),
        "lit_diff": cost(_LIT_DIFF, pixel + _DIFF_BITS + 4 * (length - 1), several & may_diff),
        "no_diff": cost(0, 0, fits_nibble(value - before) & may_diff),
        "no_diff_behind_skip": cost(0, 0, fits_nibble(value - before_skip) & may_diff),
    }


def fits_nibble(difference: Ints | Costs) -> Bools:
    """Return which differences of 8-bit pixels fit a nibble: -8 to 7, modulo 256."""
    return np.asarray((((difference + 8) & 255) < 16) & (np.abs(difference) < 256))


def _to_columns(cost: Costs, height: int, width: int) -> Costs:
    """Return costs in columns, one for each stretch, padded with zeros."""
    padded = np.zeros(height * width, dtype=np.int32)
    padded[: len(cost)] = cost
    return np.ascontiguousarray(padded.reshape(width, height).T)


def _trace_back(back: NDArray[np.uint8], state: Ints) -> Ints:
    """Return the choices along the best path of each stretch, from its end backwards."""
    ways = np.empty((len(back), len(state)), dtype=np.int64)
    column = np.arange(len(state))
    for row in range(len(back) - 1, -1, -1):
        code = back[row, state, column]
        ways[row] = code >> _FROM_BITS
        state = code & 3
    return ways

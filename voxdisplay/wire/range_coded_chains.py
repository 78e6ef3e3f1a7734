"""Encoder of range-coded chains: ARC (protocol.md, section 7.7).

The models (contexts) of a bit depend on the voxels alone, so that numpy finds them for many steps
at once; the adaptive binary range coder itself is a loop of table look-ups and additions. Must not
know curves, nor which voxels are covered by later ones.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.display_list import Spread
from voxdisplay.wire import spec
from voxdisplay.wire.fades import FADED, runs_of_pens
from voxdisplay.wire.op_encoding import EncoderConfig, Ints

# Probabilities are parts of 4096.
_ONE = 4096
_LEAST_RANGE = 1 << 24
LONGEST_PIECE = (2 << spec.ARC_MAX_K) - 2

# Bits without a model use one more, whose state never changes.
_PLAIN = spec.ARC2_MODELS  # the models of ARC are the first of those of ARC2
_FIXED = _ONE << 3
_FRESH = spec.ARC_HALF << 3

# Most bytes by which the last MORE bit lengthens a payload.
_TAIL_BYTES = 2
# Steps kept in reserve, since another count may take more bits than the one it replaces.
_SPARE_STEPS = 8
# Voxels per byte of payload that are prepared for the first payload.
_FIRST_WINDOW = 5


def encode_range_coded(
    voxels: NDArray[np.integer],
    pens: NDArray[np.integer],
    config: EncoderConfig,
    make: Callable[..., Window] | None = None,
) -> list[bytes]:
    """Return the payloads that draw voxels in their order; each is one op.

    Parameters
    ----------
    voxels : (n, 3) integer array
        Columns x, y, z, all on the grid. Those that are 26-neighbours of the one before are
        reached by a step, others by a jump.
    pens : (n,) integer array
        Pixel value of each.
    config : EncoderConfig
    make : callable, optional
        As `Window.of`, which is for ARC.

    Returns
    -------
    list of bytes
        At most ``config.max_payload`` bytes each.

    """
    make = make or Window.of
    payloads = []
    at = 0
    window = _FIRST_WINDOW * config.max_payload
    while at < len(voxels):
        part = make(voxels[at : at + window], pens[at : at + window], config)
        payload, drawn = _encode_payload(part, config)
        if drawn == window and at + drawn < len(voxels):
            window *= 2  # there is room for more
            continue
        payloads.append(payload)
        at += drawn
        # The next is likely to hold about as many.
        window = drawn + drawn // 8 + 16
    return payloads


def least_bytes(
    voxels: NDArray[np.integer],
    pens: NDArray[np.integer],
    step_bits: float,
    config: EncoderConfig,
) -> float:
    """Return about the fewest bytes that range coding can take: cheap to find.

    Starts of chains are plain bits.

    Parameters
    ----------
    voxels, pens, config
        As of `encode_range_coded`, n >= 1.
    step_bits : float
        Bits of a step.

    """
    far = int(np.count_nonzero(np.abs(np.diff(voxels, axis=0)).max(axis=1, initial=0) != 1))
    place = sum((side - 1).bit_length() for side in config.grid)
    pens_set = int(np.count_nonzero(pens[1:] != pens[:-1]))
    bits = (far + 1) * place + pens_set * config.format.full.bit_length()
    return (bits + step_bits * (len(voxels) - 1 - far)) / 8


def _encode_payload(part: Window, config: EncoderConfig) -> tuple[bytes, int]:
    """Return one payload, and the number of voxels of the window that it draws."""
    coder = _RangeCoder(config.max_payload - 1 - _TAIL_BYTES)
    pen, drawn = config.format.full, 0
    for begin, end in part.pieces:
        head = part.head(begin, pen)
        fits = _encode_piece(coder, part, head, begin, end)
        if fits == 0:
            break
        drawn, pen = begin + fits, pen_after(part.pens[begin], fits)
        if drawn < end:
            break
    coder.code([spec.ARC_MORE], [spec.ARC_MORE], [0], force=True)
    return bytes((part.op,)) + coder.finish(), drawn


def pen_after(pen: int, voxels: int) -> int:
    """Return the pen after a piece that begins with a pen: that of the next place of a fade."""
    return pen + voxels if pen >= FADED else pen


def _encode_piece(
    coder: _RangeCoder, part: Window, head: list[tuple[int, int]], begin: int, end: int
) -> int:
    """Encode as many voxels of a piece as fit; return their number."""
    jumps = begin == 0 or not part.joined[begin - 1]
    want = end - begin
    while want > 0:
        before = coder.state()
        models, bits = zip(*head, *number_bits(want - jumps), strict=True)
        # The step to voxel i is the (i - 1)th of the part.
        first, last = begin if jumps else begin - 1, begin + want - 1
        low, high = part.offset[first], part.offset[last]
        if coder.code(models, models, bits) == len(bits):
            coded = coder.code(part.ones[low:high], part.others[low:high], part.bits[low:high])
            if coded == high - low:
                return want
            reached = int(np.searchsorted(part.offset, low + coded, side="right")) - 1
            # Another count of steps may take more bits: keep a reserve.
            want = min(want - 1, max(reached - first + jumps - _SPARE_STEPS, 1))
        else:
            want = 0
        coder.restore(before)
    return 0


def number_bits(value: int) -> list[tuple[int, int]]:
    """Return models and bits of a count from 0 to LONGEST_PIECE (Elias gamma code)."""
    k = (value + 1).bit_length() - 1
    length = [(spec.ARC_COUNT + i, 1) for i in range(k)]
    if k < spec.ARC_MAX_K:
        length.append((spec.ARC_COUNT + k, 0))
    return length + plain_bits(value + 1 - (1 << k), k)


def plain_bits(value: int, count: int) -> list[tuple[int, int]]:
    """Return bits without a model, most significant first."""
    return [(_PLAIN, value >> i & 1) for i in reversed(range(count))]


# ------------------------------------------------------------------------------ the range coder


@cache
def _tables() -> tuple[list[int], tuple[list[int], list[int]]]:
    """Return the probability of a 0 in each state of a model, and the states after a 0 and a 1.

    A state is 8 times the probability, in parts of 4096, plus the bits seen, up to ARC_ENOUGH.
    """
    state = np.arange(_FIXED + 1)
    p, seen = state >> 3, state & 7
    shift = 1 + (seen >> 1)
    more = np.minimum(seen + 1, spec.ARC_ENOUGH)
    zero, one = (p + ((_ONE - p) >> shift)) << 3 | more, (p - (p >> shift)) << 3 | more
    p[_FIXED], zero[_FIXED], one[_FIXED] = spec.ARC_HALF, _FIXED, _FIXED
    return p.tolist(), (zero.tolist(), one.tolist())


class _RangeCoder:
    """Adaptive binary range coder with a limit of bytes."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._states = [_FRESH] * spec.ARC2_MODELS + [_FIXED]
        self._low = 0
        self._range = _LEAST_RANGE
        # Bytes with their carry into the previous one, so below 512; the first is not sent.
        self._out: list[int] = []

    def state(self) -> tuple[list[int], int, int, int]:
        """Return a snapshot for `restore`."""
        return self._states.copy(), self._low, self._range, len(self._out)

    def restore(self, state: tuple[list[int], int, int, int]) -> None:
        """Return to a snapshot."""
        self._states, self._low, self._range, size = state
        del self._out[size:]

    def code(
        self,
        ones: Iterable[int],
        others: Iterable[int],
        bits: Iterable[int],
        *,
        force: bool = False,
    ) -> int:
        """Encode bits, each with two models or one twice; return how many fitted."""
        chance, after = _tables()
        states, out, low, span = self._states, self._out, self._low, self._range
        limit = 1 << 62 if force else self._limit
        count = 0
        for one, other, bit in zip(ones, others, bits, strict=True):
            a, b = states[one], states[other]
            bound = (span >> 13) * (chance[a] + chance[b])
            if bit:
                low += bound
                span -= bound
            else:
                span = bound
            turn = after[bit]
            states[one] = turn[a]
            states[other] = turn[b]
            while span < _LEAST_RANGE:
                if len(out) >= limit:
                    return count
                out.append(low >> 24)
                low = (low & 0xFFFFFF) << 8
                span <<= 8
            count += 1
        self._low, self._range = low, span
        return count

    def finish(self) -> bytes:
        """Return the bytes; the last three that a decoder reads are 0 and are not sent."""
        tail = (self._low + _LEAST_RANGE - 1) >> 24
        parts = [*self._out, tail]
        total = int.from_bytes(bytes(p & 0xFF for p in parts), "big")
        total += int.from_bytes(bytes(p >> 8 for p in parts), "big") << 8
        return total.to_bytes(len(parts) - 1, "big")


# ----------------------------------------------------------------------------------- the models


@dataclass(frozen=True)
class Window:
    """Window of voxels that may fill a payload, with the models of the steps between them.

    Attributes
    ----------
    pieces : list of (int, int)
        The voxels [begin, end) of each piece: one pen, consecutive voxels are neighbours.
    joined : list of bool
        True if the voxel after it is a neighbour.
    offset : (steps + 1,) int64 array
        First bit of each step; a jump has no bits.
    ones, others, bits : lists of int
        Both models (one twice if there is only one), and the bit.

    """

    voxels: list[list[int]]
    pens: list[int]
    pieces: list[tuple[int, int]]
    joined: list[bool]
    offset: Ints
    ones: list[int]
    others: list[int]
    bits: list[int]
    config: EncoderConfig
    spreads: tuple[Spread, ...] = ()

    op: ClassVar[int] = spec.OP_ARC

    @classmethod
    def of(
        cls,
        voxels: NDArray[np.integer],
        pens: NDArray[np.integer],
        config: EncoderConfig,
        spreads: tuple[Spread, ...] = (),
    ) -> Self:
        """Return a window of voxels; the first begins a payload."""
        places = voxels.astype(np.int64)
        steps = np.diff(places, axis=0)
        joined = np.abs(steps).max(axis=1, initial=0) == 1
        cuts = np.flatnonzero(~joined | (np.diff(runs_of_pens(pens.astype(np.int64))) != 0)) + 1
        bounds = [0, *cuts.tolist(), len(voxels)]
        pieces = [
            (begin, min(begin + LONGEST_PIECE, end))
            for low, end in pairwise(bounds)
            for begin in range(low, end, LONGEST_PIECE)
        ]
        ones, others, bits, used = _step_contexts(steps[joined], _first_steps(joined))
        count = np.zeros(len(steps), dtype=np.int64)
        count[joined] = used.sum(axis=1)
        return cls(
            voxels=places.tolist(),
            pens=pens.tolist(),
            pieces=pieces,
            joined=joined.tolist(),
            offset=np.concatenate(([0], np.cumsum(count))),
            ones=ones[used].tolist(),
            others=others[used].tolist(),
            bits=bits[used].tolist(),
            config=config,
            spreads=spreads,
        )

    def head(self, begin: int, pen: int) -> list[tuple[int, int]]:
        """Return models and bits that precede the count of a piece, given the current pen."""
        jumps = begin == 0 or not self.joined[begin - 1]
        bits = [(spec.ARC_MORE, 1)]
        if begin:
            bits.append((spec.ARC_JUMP, int(jumps)))
        new = self.pens[begin]
        bits.append((spec.ARC_INK, int(new != pen)))
        if new != pen:
            bits += self.ink(new)
        if jumps:
            bits += self.start(begin)
        return bits

    def ink(self, pen: int) -> list[tuple[int, int]]:
        """Return models and bits of a pen."""
        return plain_bits(pen, self.config.format.full.bit_length())

    def start(self, begin: int) -> list[tuple[int, int]]:
        """Return models and bits of the voxel at which a piece begins anywhere."""
        bits = []
        for place, size in zip(self.voxels[begin], self.config.grid, strict=True):
            bits += plain_bits(place, (size - 1).bit_length())
        return bits


def _first_steps(joined: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which of the steps between neighbours are the first of a curve."""
    return np.append(True, ~joined)[: len(joined)][joined]


def _step_contexts(
    steps: Ints, first: NDArray[np.bool_]
) -> tuple[Ints, Ints, Ints, NDArray[np.bool_]]:
    """Return both models, bit, and whether it is sent, of the six bits of each step: (n, 6)."""
    n = len(steps)
    moved = (steps != 0).astype(np.int64)
    axes = [_AxisContext.of(moved[:, axis], steps[:, axis] < 0, first) for axis in range(3)]

    def stacked(name: str) -> Ints:
        return np.stack([getattr(axis, name) for axis in axes], axis=1)

    streak = stacked("last") * stacked("run")
    order = (streak.argmax(axis=1)[:, None] + np.arange(3)) % 3

    def ordered(values: Ints) -> Ints:
        return np.take_along_axis(values, order, axis=1)

    moves, streak, last = ordered(moved), ordered(streak), ordered(stacked("last"))
    with_main = moves[:, :1].astype(bool)
    ones = np.empty((n, 3, 2), dtype=np.int64)
    others, bits, used = np.empty_like(ones), np.empty_like(ones), np.ones((n, 3, 2), dtype=bool)

    rival = np.minimum(streak[:, 1:].max(axis=1, initial=0), 7)
    lone = spec.ARC_LONE + np.minimum(streak[:, 1:], 7)
    ones[:, 0, 0] = others[:, 0, 0] = spec.ARC_MAIN + 8 * np.minimum(streak[:, 0], 3) + rival
    ones[:, 1:, 0] = np.where(
        with_main, spec.ARC_HISTORY + ordered(stacked("history"))[:, 1:], lone
    )
    others[:, 1:, 0] = np.where(with_main, spec.ARC_RUNS + ordered(stacked("runs"))[:, 1:], lone)
    bits[:, :, 0] = moves
    bits[:, 1:, 0] ^= last[:, 1:] & with_main
    used[:, 2, 0] = moves[:, :2].any(axis=1)

    ones[:, :, 1] = others[:, :, 1] = ordered(stacked("turn"))
    bits[:, :, 1] = ordered(stacked("turns"))
    used[:, :, 1] = moves.astype(bool)
    return ones.reshape(n, 6), others.reshape(n, 6), bits.reshape(n, 6), used.reshape(n, 6)


@dataclass(frozen=True)
class _AxisContext:
    """Context of an axis before each step, as a decoder knows it: (n,) arrays."""

    last: Ints
    run: Ints
    history: Ints
    runs: Ints
    turn: Ints
    turns: Ints

    @classmethod
    def of(cls, moved: Ints, falls: NDArray[np.bool_], first: NDArray[np.bool_]) -> _AxisContext:
        """Return the context of an axis over the steps of curves."""
        index = np.arange(len(moved))
        curve = np.maximum.accumulate(np.where(first, index, 0))

        def before(values: Ints, steps: int = 1) -> Ints:
            shifted = np.concatenate((np.zeros(steps, dtype=np.int64), values))[: len(values)]
            return np.where(index - steps >= curve, shifted, 0)

        begins = first | (before(moved) != moved)
        starts = np.flatnonzero(begins)
        nth = np.cumsum(begins) - 1
        length = np.diff(np.append(starts, len(moved)))

        def earlier(back: int) -> Ints:
            """Return the length of an earlier run of the same curve; 0 if there is none."""
            at = np.maximum(nth - back, 0)
            return np.where((nth >= back) & (starts[at] >= curve), length[at], 0)

        run = before(np.minimum(index - starts[nth] + 1, spec.ARC_MAX_RUN))
        prev, prev2 = (before(np.minimum(earlier(back), spec.ARC_MAX_RUN)) for back in (1, 2))
        last = before(moved)
        history = sum(
            ((before(moved, back) ^ last) << (back - 2) for back in range(2, 8)),
            start=np.zeros_like(last),
        )
        runs = (
            64 * last + 16 * (np.clip(run - prev2, -2, 1) + 2) + 8 * (prev > 1) + np.minimum(run, 7)
        )
        latest = np.maximum.accumulate(np.where(moved, index, -1))
        latest = np.concatenate(([-1], latest))[: len(moved)]
        known = latest >= curve
        turn = np.where(known, spec.ARC_TURN + np.where(last, 0, np.minimum(run, 15)), _PLAIN)
        turns = falls ^ (known & falls[latest])
        return cls(last, run, history, runs, turn, turns.astype(np.int64))

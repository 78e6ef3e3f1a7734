"""Chain coding of ordered voxels: STEP and LINE (protocol.md, sections 7.1 and 7.3), vectorised.

Voxels are cut into *segments* whose steps all fit one octant; each costs two bits a step, or
nothing if it is exactly the line that LINE draws between its ends. Must not know curves, nor which
voxels are covered by later ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.display_list import Spread
from voxdisplay.wire import spec
from voxdisplay.wire.fades import FADED, FadedRows, runs_of_pens
from voxdisplay.wire.op_encoding import (
    Bools,
    Bytes,
    EncoderConfig,
    Ints,
    concat_ranges,
    encode_positions,
)
from voxdisplay.wire.payload_splitting import OpBlocks, PayloadLayout

Offsets = NDArray[np.int32]
_STEPS_PER_BYTE = 4
# Crumb by main axis and a bit for each axis that moves.
_CRUMB_OF = np.array(
    [
        axes >> (main + 1) % 3 & 1 | (axes >> (main + 2) % 3 & 1) << 1
        for main in range(3)
        for axes in range(8)
    ],
    dtype=np.uint8,
)


@dataclass(frozen=True)
class Chains:
    """Op blocks, one for each segment, and the voxels that they draw.

    Attributes
    ----------
    blocks : OpBlocks
    begin, count : (n,) int64 arrays
        Row of the first voxel of each segment, and number of steps. A segment that continues
        another begins with the other's last voxel.

    """

    blocks: OpBlocks
    begin: Ints
    count: Ints


def encode_chains(
    voxels: NDArray[np.integer], pens: NDArray[np.integer], config: EncoderConfig
) -> list[bytes]:
    """Return the payloads that draw voxels in their order.

    Parameters
    ----------
    voxels : (n, 3) integer array
        Columns x, y, z, all on the grid.
    pens : (n,) integer array
        Pixel value of each.
    config : EncoderConfig

    Returns
    -------
    list of bytes
        At most ``config.max_payload`` bytes each.

    """
    return PayloadLayout(build_chains(voxels, pens, config).blocks, config).payloads


def build_chains(
    voxels: NDArray[np.integer],
    pens: NDArray[np.integer],
    config: EncoderConfig,
    corners: Bools | None = None,
    index: Ints | None = None,
    fades: FadedRows | None = None,
) -> Chains:
    """Return the chains of voxels: runs of 26-neighbours with the same pen, cut into segments.

    Parameters
    ----------
    voxels, pens, config
        As of `encode_chains`.
    corners : (n,) bool array, optional
        True where a straight line may end and another begin.
    index : (n,) int64 array, optional
        Scan-order indices of the voxels, if known.
    fades : FadedRows, optional
        Which voxels are drawn under a fade.

    """
    n = len(voxels)
    spots = np.ascontiguousarray(voxels.T, dtype=np.int32)  # axis first: long rows are faster
    steps = spots[:, 1:] - spots[:, :-1]
    jump = np.abs(steps).max(axis=0, initial=0) != 1
    runs = pens if fades is None else runs_of_pens(fades.pens)
    jump |= runs[1:] != runs[:-1]
    ends, mains, falls = _longest_octant_runs(steps, jump)
    if corners is not None and config.has(spec.FEATURE_LINE) and corners.any():
        ends = _break_at_corners(ends, np.flatnonzero(corners))
    begin, count = _segments(ends, jump, n)
    lines = _find_lines(spots, begin, count, config)
    room = config.max_block_bytes - 2
    if fades is not None:
        room -= max(0, fades.op_bytes - config.pen_bytes)
    longest = min(spec.LIMIT_MAX_STEPS, _STEPS_PER_BYTE * room)
    begin, count, lines = _split_long(begin, count, lines, longest)

    at = np.minimum(begin, max(0, n - 2))  # a lone last voxel has no step and no octant
    octant = np.zeros(n, dtype=np.int64)
    if n > 1:
        octant = 8 * mains[at].astype(np.int64) + falls[at]
    body, size = _encode_ops(spots, steps, begin, count, octant, lines, config)
    index = config.grid.index_of(voxels) if index is None else index
    lone = count == 0
    pen = after = pens[begin].astype(np.int64)
    spreads: tuple[Spread, ...] = ()
    if fades is not None:
        spreads = fades.spreads
        faded = ~lone & (fades.pens[begin] >= FADED)
        pen = np.where(faded, fades.pens[begin], pen)
        after = np.where(faded, fades.pens[begin + count] + 1, after)
    blocks = OpBlocks(
        body, size, pen, index[begin], after, index[begin + count] + lone, ~lone & ~lines, spreads
    )
    return Chains(blocks, begin, count)


def _longest_octant_runs(
    steps: Offsets, jump: Bools
) -> tuple[Ints, NDArray[np.int8], NDArray[np.int8]]:
    """Return for each step the end of the longest segment from there, its main axis and signs.

    A run of steps fits an octant if some axis moves in all of them and no axis moves both ways.
    Both hold for every part of such a run, so the greedy choice of the longest gives the fewest
    segments.
    """
    m = steps.shape[-1]
    index = np.arange(m, dtype=np.int32)

    def next_where(condition: Bools) -> Offsets:
        found = np.maximum(index, ~condition * np.int32(m))
        return np.minimum.accumulate(found[..., ::-1], axis=-1)[..., ::-1]

    still = next_where(steps == 0)
    rise, fall = next_where(steps > 0), next_where(steps < 0)
    ends = np.minimum(np.maximum(rise, fall).min(axis=0), next_where(jump))
    longest = np.maximum(np.maximum(still[0], still[1]), still[2])
    ends = np.minimum(ends, longest)
    main = np.full(m, 2, dtype=np.int8)
    for axis in (1, 0):
        main[still[axis] == longest] = axis
    falls = np.zeros(m, dtype=np.int8)
    for axis in range(3):
        falls |= (fall[axis] < ends).astype(np.int8) << np.int8(axis)
    return ends, main, falls


def _break_at_corners(ends: Ints, corners: Ints) -> Ints:
    """Return ends of segments that are also cut at the next corner after their first voxel."""
    behind = np.append(corners, len(ends))[np.searchsorted(corners, np.arange(len(ends)), "right")]
    return np.asarray(np.minimum(ends, behind))


def _segments(ends: Ints, jump: Bools, n: int) -> tuple[Ints, Ints]:
    """Return first voxel and number of steps of each segment; a lone voxel has no steps."""
    m = len(jump)
    ends = _trim_partial_bytes(ends, jump)
    following = (ends + jump).data  # few entries are read: a list of all would be slower
    path = []
    at = 0
    while at < m:
        path.append(at)
        at = following[at]
    begin = np.array(path, dtype=np.int64)
    jumps = jump[begin]
    new = np.concatenate(([True], jumps))  # no step leads there
    begin = np.append(begin, m)
    kept = np.append(~jumps, False) | new
    kept[-1] &= n > 0
    count = np.append(ends, m)[begin] - begin
    return begin[kept], count[kept]


def _trim_partial_bytes(ends: Ints, jump: Bools) -> Ints:
    """Return ends of runs, moved back where the next run can take a partly filled crumb byte."""
    m = len(ends)
    at = np.arange(m, dtype=np.int32)
    left = (ends - at) & _STEPS_PER_BYTE - 1
    inner = np.minimum(ends, m - 1)
    behind = ends[inner]
    rest = (behind - ends) & _STEPS_PER_BYTE - 1
    fits = (left > 0) & (rest > 0) & (rest + left <= _STEPS_PER_BYTE)
    fits &= (ends < m) & ~jump[inner] & (ends - left > at)
    fits &= ends[np.minimum(ends - left, m - 1)] == behind
    return np.asarray(ends - left * fits)


def _find_lines(spots: Offsets, begin: Ints, count: Ints, config: EncoderConfig) -> Bools:
    """Return which segments LINE draws in fewer bytes: those that are exactly its voxels."""
    found = np.zeros(len(begin), dtype=np.bool_)
    if not config.has(spec.FEATURE_LINE):
        return found
    line_bytes = 1 + config.position_bytes
    maybe = np.flatnonzero(2 + -(-count // _STEPS_PER_BYTE) > line_bytes)
    # Cheap rejection: most segments of a curve leave the line in their middle.
    for part in (2, 4):
        k = count[maybe] // part
        maybe = maybe[~_off_line(spots, begin, count, maybe, k)]
    if len(maybe):
        owner = np.repeat(maybe, count[maybe])
        k = concat_ranges(np.zeros(len(maybe), dtype=np.int64), count[maybe])
        off = _off_line(spots, begin, count, owner, k)
        starts = np.cumsum(count[maybe]) - count[maybe]
        found[maybe[~np.logical_or.reduceat(off, starts)]] = True
    return found


def _off_line(spots: Offsets, begin: Ints, count: Ints, which: Ints, k: Ints) -> Bools:
    """Return whether voxel k of a segment differs from that of the LINE between its ends."""
    first, length = begin[which], count[which]
    off = np.zeros(len(which), dtype=np.bool_)
    for axis in spots:
        start = axis[first]
        distance = axis[first + length] - start
        off |= axis[first + k] != start + (2 * k * distance + length) // (2 * length)
    return off


def _split_long(begin: Ints, count: Ints, lines: Bools, longest: int) -> tuple[Ints, Ints, Bools]:
    """Split segments with more steps than one op holds."""
    parts = np.where(lines, 1, np.maximum(1, -(-count // longest)))
    if parts.max(initial=0) <= 1:
        return begin, count, lines
    owner = np.repeat(np.arange(len(begin)), parts)
    done = concat_ranges(np.zeros(len(begin), dtype=np.int64), parts) * longest
    left = count[owner] - done
    return (
        begin[owner] + done,
        np.where(lines[owner], left, np.minimum(left, longest)),
        lines[owner],
    )


def _encode_ops(
    spots: Offsets,
    steps: Offsets,
    begin: Ints,
    count: Ints,
    octant: Ints,
    lines: Bools,
    config: EncoderConfig,
) -> tuple[Bytes, Ints]:
    """Return the ops of all segments, concatenated, and the bytes of each."""
    lone = count == 0
    stepped = np.flatnonzero(~lone & ~lines)
    crumbs, crumb_bytes = _crumbs(steps, begin[stepped], count[stepped], octant[stepped] // 8)
    size = np.where(lone, 1, 1 + config.position_bytes)
    size[stepped] = 2 + crumb_bytes
    at = np.cumsum(size) - size
    body = np.empty(int(size.sum()), dtype=np.uint8)
    body[at] = np.where(lone, spec.OP_RUN, np.where(lines, spec.OP_LINE, spec.OP_STEP + octant))
    body[at[stepped] + 1] = count[stepped] - 1
    body[concat_ranges(at[stepped] + 2, crumb_bytes)] = crumbs
    ends = encode_positions(spots[:, (begin + count)[lines]].T, config)
    body[at[lines, None] + 1 + np.arange(config.position_bytes)] = ends
    return body, size


def _crumbs(steps: Offsets, begin: Ints, count: Ints, main: Ints) -> tuple[Bytes, Ints]:
    """Return the crumb bytes of segments, concatenated, and the bytes of each."""
    sizes = -(-count // _STEPS_PER_BYTE)
    moved = (steps != 0).view(np.uint8)
    axes = moved[0] | moved[1] << 1 | moved[2] << 2
    crumb = _CRUMB_OF[
        np.repeat(main.astype(np.uint8) << 3, count) | axes[concat_ranges(begin, count)]
    ]
    padded = np.zeros(_STEPS_PER_BYTE * int(sizes.sum()), dtype=np.uint8)
    padded[concat_ranges(_STEPS_PER_BYTE * (np.cumsum(sizes) - sizes), count)] = crumb
    four = padded.reshape(-1, _STEPS_PER_BYTE).view("<u4")[:, 0]
    return (four | four >> 6 | four >> 12 | four >> 18).astype(np.uint8), sizes

"""Ordered voxels -> FROM, STEP, PEN and MOVE + RUN (protocol.md, section 7.1), vectorised.

A sequence is cut into *segments* whose steps all fit one octant; each costs two bits a step. What
the voxels mean, and whether they are hidden by others, was settled before.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.wire import spec
from voxdisplay.wire.ops import Bytes, Coding, Ints, fill, little_endian

_STEPS_PER_BYTE = 4


def encode_chains(
    voxels: NDArray[np.integer], pens: NDArray[np.integer], coding: Coding
) -> list[bytes]:
    """Give the payloads that draw voxels, in their order.

    Voxels that follow each other as 26-neighbours with the same pen are chained; others cost a
    MOVE. Each payload stands for itself: it sets its own pen and says where it begins.

    Parameters
    ----------
    voxels : (n, 3) integer array
        Columns x, y, z, all on the grid.
    pens : (n,) integer array
        Pixel value of each.
    coding : Coding

    Returns
    -------
    list of bytes
        At most ``coding.max_payload`` bytes each.

    """
    if len(voxels) == 0:
        return []
    places = voxels.astype(np.int64)
    steps = places[1:] - places[:-1]
    jump = (np.abs(steps).max(axis=1) != 1) | (np.diff(pens.astype(np.int64)) != 0)
    ends, mains, falls = _octant_runs(steps, jump)
    # The longest op must fit a payload together with the PEN before it.
    room = coding.max_payload - coding.pen_bytes - coding.move_bytes - 2
    longest = min(spec.LIMIT_MAX_STEPS, _STEPS_PER_BYTE * room)
    begin, count, fresh = _segments(ends, jump, longest)

    at = np.minimum(begin, len(steps) - 1)  # a lone last voxel has no step; its octant is unused
    mains, falls = (mains[at], falls[at]) if len(steps) else (np.zeros(1, int), np.zeros(1, int))
    return _assemble(voxels, pens, steps, begin, count, fresh, 8 * mains + falls, coding)


def _octant_runs(steps: Ints, jump: NDArray[np.bool_]) -> tuple[Ints, Ints, Ints]:
    """For each step: the end of the longest segment that begins there, and its octant.

    A run of steps fits an octant if some axis moves in all of them and no axis moves both ways.
    Both stay true for any shorter run, so taking the longest each time gives the fewest segments.
    """
    m = len(steps)
    none = np.full((m, 3), m)
    index = np.arange(m)[:, None]

    def next_where(condition: NDArray[np.bool_]) -> Ints:
        found = np.where(condition, index[:, : condition.shape[1]], none[:, : condition.shape[1]])
        return np.minimum.accumulate(found[::-1])[::-1]

    still = next_where(steps == 0)
    rise, fall = next_where(steps > 0), next_where(steps < 0)
    ends = np.minimum(np.maximum(rise, fall).min(axis=1), next_where(jump[:, None])[:, 0])
    ends = np.minimum(ends, still.max(axis=1))
    falls = ((fall < ends[:, None]) * np.array([1, 2, 4])).sum(axis=1)
    return ends, still.argmax(axis=1), falls


def _segments(
    ends: Ints, jump: NDArray[np.bool_], longest: int
) -> tuple[Ints, Ints, NDArray[np.bool_]]:
    """Follow the runs: first voxel, number of steps and "begins a chain" of each segment."""
    begin: list[int] = []
    count: list[int] = []
    fresh: list[bool] = []
    end_of, is_jump, m = ends.tolist(), jump.tolist(), len(jump)
    at, new = 0, True
    while at < m:
        if is_jump[at]:
            if new:  # nothing leads here or away: a lone voxel
                begin.append(at)
                count.append(0)
                fresh.append(True)
            new = True
            at += 1
            continue
        end = end_of[at]
        while at < end:
            piece = min(end - at, longest)
            begin.append(at)
            count.append(piece)
            fresh.append(new)
            at, new = at + piece, False
    if new:
        begin.append(m)
        count.append(0)
        fresh.append(True)
    return np.array(begin), np.array(count), np.array(fresh)


def _crumbs(steps: Ints, begin: Ints, count: Ints, octant: Ints) -> tuple[Bytes, Ints]:
    """Give the crumb bytes of all segments, one after another, and how many each has."""
    sizes = -(-count // _STEPS_PER_BYTE)
    starts = np.cumsum(sizes) - sizes
    owner = np.repeat(np.arange(len(count)), count)
    inner = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    moved = steps[begin[owner] + inner] != 0
    main = octant[owner] // 8
    rows = np.arange(len(owner))
    crumb = moved[rows, (main + 1) % 3] | moved[rows, (main + 2) % 3] << 1
    padded = np.zeros((int(sizes.sum()), _STEPS_PER_BYTE), dtype=np.uint8)
    padded.reshape(-1)[starts[owner] * _STEPS_PER_BYTE + inner] = crumb
    return padded @ np.array([1, 4, 16, 64], dtype=np.uint8), sizes


def _assemble(
    voxels: NDArray[np.integer],
    pens: NDArray[np.integer],
    steps: Ints,
    begin: Ints,
    count: Ints,
    fresh: NDArray[np.bool_],
    octant: Ints,
    coding: Coding,
) -> list[bytes]:
    """Lay the segments out in bytes, and cut them into payloads."""
    crumbs, crumb_size = _crumbs(steps, begin, count, octant)
    pen = pens[begin].astype(np.int64)
    new_pen = np.diff(pen, prepend=coding.format.full) != 0
    lone = count == 0

    def sizes(new_pen: NDArray[np.bool_], fresh: NDArray[np.bool_]) -> Ints:
        # PEN; op byte; xyz; n - 1 of a chain, or RUN of a lone voxel; crumbs
        return new_pen * coding.pen_bytes + 2 + fresh * coding.move_bytes + crumb_size

    not_full = pen != coding.format.full
    first = sizes(not_full, np.ones_like(fresh))
    payloads = fill(first, sizes(new_pen, fresh), coding.max_payload)
    heads = np.array([head for head, _ in payloads])
    new_pen[heads], fresh[heads] = not_full[heads], True

    size = sizes(new_pen, fresh)
    offset = np.cumsum(size) - size
    out = np.zeros(int(size.sum()), dtype=np.uint8)

    at = offset[new_pen]
    out[at] = spec.OP_PEN
    out[at[:, None] + 1 + np.arange(coding.format.bytes)] = little_endian(
        pen[new_pen], coding.format.bytes
    )
    op = offset + new_pen * coding.pen_bytes
    out[op] = np.where(lone, spec.OP_MOVE, np.where(fresh, spec.OP_FROM, spec.OP_STEP) + octant)
    place = little_endian(voxels[begin[fresh]].reshape(-1), coding.coordinate_bytes)
    out[op[fresh][:, None] + 1 + np.arange(coding.move_bytes)] = place.reshape(
        -1, coding.move_bytes
    )
    behind = op + 1 + fresh * coding.move_bytes
    out[behind] = np.where(lone, spec.OP_RUN, count - 1)
    inner = np.arange(len(crumbs)) - np.repeat(np.cumsum(crumb_size) - crumb_size, crumb_size)
    out[np.repeat(behind + 1, crumb_size) + inner] = crumbs

    data = out.tobytes()
    bounds = np.append(offset, len(data))
    return [data[bounds[head] : bounds[end]] for head, end in payloads]

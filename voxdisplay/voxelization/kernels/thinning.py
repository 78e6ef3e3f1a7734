"""From the voxels of crossings to sequences: the twins of `grid_plane`, `thinning` and others.

Several threads may be in them at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Bools, Floats, Ints
from voxdisplay.compute.kernel_backend import jit
from voxdisplay.voxelization.curve_batch import Samples
from voxdisplay.voxelization.index_ranges import Arrays
from voxdisplay.voxelization.kernels.contiguous import Bytes, Pieces, packed
from voxdisplay.voxelization.plane_crossings import Crossings
from voxdisplay.voxelization.thinning import MAX_UNCOVERED, WINDOW
from voxdisplay.voxelization.voxel_events import VoxelEvents, Voxels

NO_HEADING = -1  # `voxel_events.NO_HEADING`
NO_POINTS = np.empty((3, 0))
NO_NUMBERS = np.empty(0)
NO_PIECES = np.empty(0, dtype=np.int64)


@jit
def _adjacent(voxels: Voxels, i: int, j: int) -> bool:
    return bool(  # without a branch between
        (abs(voxels[0, i] - voxels[0, j]) <= 1)
        & (abs(voxels[1, i] - voxels[1, j]) <= 1)
        & (abs(voxels[2, i] - voxels[2, j]) <= 1)
    )


@jit
def find_gaps(piece: Pieces, voxels: Voxels) -> Ints:
    """See `voxel_events.find_gaps`."""
    count = 0
    for k in range(piece.size - 1):
        count += (piece[k] == piece[k + 1]) & (not _adjacent(voxels, k, k + 1))
    found = np.empty(count, dtype=np.int64)
    if count:  # which is rare
        count = 0
        for k in range(piece.size - 1):
            if (piece[k] == piece[k + 1]) & (not _adjacent(voxels, k, k + 1)):
                found[count] = k
                count += 1
    return found


def choose_corners(crossings: Crossings, samples: Samples) -> VoxelEvents:
    """See `grid_plane.choose_corners`."""
    inner = crossings.events
    return VoxelEvents(
        *_choose_corners(
            inner.piece,
            inner.t,
            packed(inner.voxels),
            inner.heading,
            packed(crossings.better),
            crossings.gain,
            samples.t,
            packed(samples.points),
            samples.bounds,
        )
    )


@jit
def _choose_corners(
    inner_piece: Pieces,
    inner_t: Floats,
    inner_voxels: Voxels,
    inner_heading: Bytes,
    inner_better: Voxels,
    inner_gain: Floats,
    sample_t: Floats,
    points: Floats,
    bounds: Ints,
) -> tuple[Pieces, Floats, Voxels, Bytes]:
    pieces = bounds.size - 1
    size = inner_t.size + 2 * pieces
    piece, t = np.empty(size, dtype=np.int32), np.empty(size)
    nearest, voxels = np.empty((3, size), dtype=np.int32), np.empty((3, size), dtype=np.int32)
    heading, gain = np.empty(size, dtype=np.int8), np.empty(size)
    at = begin = 0
    for number in range(pieces):
        end = begin
        while end < inner_t.size and inner_piece[end] == number:
            end += 1
        stop = at + 1 + end - begin
        piece[at : stop + 1] = number
        t[at + 1 : stop], gain[at + 1 : stop] = inner_t[begin:end], inner_gain[begin:end]
        heading[at + 1 : stop] = inner_heading[begin:end]
        for row in range(3):
            nearest[row, at + 1 : stop] = inner_voxels[row, begin:end]
            voxels[row, at + 1 : stop] = inner_better[row, begin:end]
        for tip, knot in ((at, bounds[number]), (stop, bounds[number + 1] - 1)):
            t[tip], heading[tip], gain[tip] = sample_t[knot], NO_HEADING, np.inf
            for row in range(3):
                nearest[row, tip] = voxels[row, tip] = int(np.floor(points[row, knot]))
        at, begin = stop + 1, end

    bridged = np.zeros(size, dtype=np.bool_)
    for k in range(size):
        if k + 1 < size and piece[k] == piece[k + 1] and not _adjacent(nearest, k, k + 1):
            bridged[k] = True
            gain[k] = gain[k + 1] = np.inf
        if not np.isfinite(gain[k]):
            for row in range(3):
                voxels[row, k] = nearest[row, k]
    apart = find_gaps(piece, voxels)
    while apart.size:
        back = np.empty(apart.size, dtype=np.int64)
        count = 0
        for k in apart:
            if not bridged[k]:
                back[count] = k if gain[k] <= gain[k + 1] else k + 1
                count += 1
        for k in back[:count]:
            gain[k] = np.inf
            voxels[:, k] = nearest[:, k]
        look = np.empty(2 * count, dtype=np.int64)
        fresh = 0
        for k in back[:count]:
            for step in (k - 1, k):
                if (
                    0 <= step < size - 1
                    and piece[step] == piece[step + 1]
                    and not bridged[step]
                    and not _adjacent(voxels, step, step + 1)
                ):
                    look[fresh] = step
                    fresh += 1
        apart = look[:fresh]
    return piece, t, voxels, heading


def insert_columns(at: Ints, arrays: Arrays, fresh: Arrays) -> Arrays:
    """See `index_ranges.insert_columns`."""
    merged = []
    for array, other in zip(arrays, fresh, strict=True):
        both = _insert_columns(at, *(packed(np.atleast_2d(each)) for each in (array, other)))
        merged.append(both if array.ndim > 1 else both[0])
    return tuple(merged)


@jit
def _insert_columns(at: Ints, array: NDArray[Any], fresh: NDArray[Any]) -> NDArray[Any]:
    rows, size = array.shape
    both = np.empty((rows, size + at.size), dtype=array.dtype)
    for row in range(rows):
        old, new = array[row], both[row]
        begin = 0
        for nth in range(at.size):
            for k in range(begin, at[nth]):
                new[k + nth] = old[k]
            begin = at[nth]
            new[begin + nth] = fresh[row, nth]
        for k in range(begin, size):
            new[k + at.size] = old[k]
    return both


def thin_events(
    events: VoxelEvents, samples: Samples | None = None, *, keep_tips: bool = False
) -> VoxelEvents:
    """See `thinning.thin_events`."""
    known = (
        (samples.piece, samples.t, packed(samples.points))
        if samples
        else (NO_PIECES, NO_NUMBERS, NO_POINTS)
    )
    full = events.piece, events.t, packed(events.voxels), events.heading
    return VoxelEvents(
        *_thin_events(*full, *known, keep_tips, WINDOW, MAX_UNCOVERED * MAX_UNCOVERED)
    )


@jit
def _near_turns(piece: Pieces, voxels: Voxels, heading: Bytes, window: int) -> Bools:
    """Tell where a turn is within reach: see `thinning.continues_run`."""
    size = piece.size
    reach = np.zeros(size + 1, dtype=np.int32)
    for k in range(size):
        on = k > 0 and piece[k] == piece[k - 1] and heading[k] == heading[k - 1] != NO_HEADING
        if on:
            axis = heading[k] >> 1
            on = voxels[axis, k] - voxels[axis, k - 1] == 1 - 2 * (heading[k] & 1)
        if not on:
            reach[max(k - window, 0)] += 1
            reach[min(k + window, size)] -= 1
    look = np.empty(size, dtype=np.bool_)
    total = 0
    for k in range(size):
        total += reach[k]
        look[k] = total > 0
    return look


@jit
def _furthest_shortcut(
    voxels: Voxels, i: int, begin: int, end: int, connected: bool, window: int
) -> int:
    """Give J(i) - i within a stretch."""
    ahead = 0
    while ahead < window and i + ahead + 1 < end and _adjacent(voxels, i, i + ahead + 1):
        ahead += 1
    w = min(window, end - 1 - i) + 1
    while w > 2:
        w -= 1
        j = i + w
        apart = max(
            abs(voxels[0, i] - voxels[0, j]),
            abs(voxels[1, i] - voxels[1, j]),
            abs(voxels[2, i] - voxels[2, j]),
        )
        if apart > 2 and connected:
            w -= apart - 2  # so many steps back it takes until the next one can be near
        elif apart <= 1:
            behind = 0
            while (
                ahead + behind < w - 1
                and j - behind - 1 >= begin
                and _adjacent(voxels, j - behind - 1, j)
            ):
                behind += 1
            if ahead + behind >= w - 1:
                return w
    return 1


@jit
def _skips_tip(piece: Pieces, voxels: Voxels, i: int, j: int) -> bool:
    before = i > 0 and piece[i - 1] == piece[i] and _adjacent(voxels, i - 1, j)
    after = j + 1 < piece.size and piece[j + 1] == piece[j] and _adjacent(voxels, i, j + 1)
    if not (before or after):
        return False
    for k in range(i + 1, j):
        for row in range(3):
            low = min(voxels[row, i], voxels[row, j])
            high = max(voxels[row, i], voxels[row, j])
            if voxels[row, k] < low or voxels[row, k] > high:
                return True
    return False


@jit
def _square(voxels: Voxels, i: int, points: Floats, p: int) -> float:
    """Give the square of the distance between a voxel and a point."""
    x = points[0, p] - (voxels[0, i] + 0.5)
    y = points[1, p] - (voxels[1, i] + 0.5)
    z = points[2, p] - (voxels[2, i] + 0.5)
    return float(x * x + y * y + z * z)


@jit
def _thin_events(
    full_piece: Pieces,
    full_t: Floats,
    full_voxels: Voxels,
    full_heading: Bytes,
    sample_piece: Ints,
    sample_t: Floats,
    points: Floats,
    keep_tips: bool,
    window: int,
    farthest: float,
) -> tuple[Pieces, Floats, Voxels, Bytes]:
    whole = full_t.size
    number = np.empty(whole, dtype=np.int64)
    size = 0
    for k in range(whole):
        if not (
            k > 0
            and full_piece[k] == full_piece[k - 1]
            and full_voxels[0, k] == full_voxels[0, k - 1]
            and full_voxels[1, k] == full_voxels[1, k - 1]
            and full_voxels[2, k] == full_voxels[2, k - 1]
        ):
            number[size] = k
            size += 1
    number = number[:size]
    piece, t, voxels, heading = full_piece, full_t, full_voxels, full_heading
    if size < whole:
        piece, t, heading = full_piece[number], full_t[number], full_heading[number]
        voxels = np.empty((3, size), dtype=np.int32)
        for row in range(3):
            for k in range(size):
                voxels[row, k] = full_voxels[row, number[k]]
    look = _near_turns(piece, voxels, heading, window)

    kept, kept_t = np.empty(size, dtype=np.int64), np.empty(size)
    count = p = i = 0
    begin = end = 0  # of the stretch that is looked at
    connected = True
    while i < size:
        last = kept[count - 1] if count else -1
        if not (
            count
            and full_piece[last] == piece[i]
            and full_voxels[0, last] == voxels[0, i]
            and full_voxels[1, last] == voxels[1, i]
            and full_voxels[2, last] == voxels[2, i]
        ):
            kept[count], kept_t[count] = number[i], t[i]
            count += 1
        leap = 1
        if look[i]:
            if i >= end:
                begin = end = i
                connected = True
                while end < size and look[end] and piece[end] == piece[i]:
                    end += 1
                    connected &= end == i + 1 or _adjacent(voxels, end - 2, end - 1)
            leap = _furthest_shortcut(voxels, i, begin, end, connected, window)
        if leap > 1 and keep_tips and _skips_tip(piece, voxels, i, i + leap):
            leap = 1
        if leap > 1 and sample_t.size:
            j = i + leap
            while p < sample_t.size and (
                sample_piece[p] < piece[i] or (sample_piece[p] == piece[i] and sample_t[p] < t[i])
            ):
                p += 1
            q = p
            while q < sample_t.size and sample_piece[q] == piece[i] and sample_t[q] < t[j]:
                nearest = min(_square(voxels, i, points, q), _square(voxels, j, points, q))
                if nearest > farthest:
                    leap = 1
                    break
                q += 1
        i += leap

    at = 0
    for k in range(whole):  # a piece ends where it ends, even if its last voxel was reached before
        if k + 1 == whole or full_piece[k + 1] != full_piece[k]:
            while at + 1 < count and full_piece[kept[at + 1]] == full_piece[k]:
                at += 1
            kept_t[at] = full_t[k]
            at += 1
    kept = kept[:count]
    thin = np.empty((3, count), dtype=np.int32)
    for row in range(3):
        one, other = full_voxels[row], thin[row]
        for k in range(count):
            other[k] = one[kept[k]]
    return full_piece[kept], kept_t[:count], thin, full_heading[kept]

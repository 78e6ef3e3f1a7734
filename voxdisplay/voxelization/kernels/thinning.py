"""Kernel of `thinning`: shortcuts between events, and the cheapest path over them.

It holds no state: several threads may run it at once.
"""

from __future__ import annotations

import numpy as np

from voxdisplay.compute.array_types import Bools, Floats, Ints
from voxdisplay.compute.kernel_backend import jit
from voxdisplay.voxelization.curve_batch import Samples
from voxdisplay.voxelization.kernels.contiguous import Bytes, Pieces, packed
from voxdisplay.voxelization.thinning import COST_UNITS, FAR, MAX_UNCOVERED, VOXEL_COST, WINDOW
from voxdisplay.voxelization.voxel_events import VoxelEvents, Voxels

NO_HEADING = -1  # `voxel_events.NO_HEADING`
NO_POINTS = np.empty((3, 0))
NO_NUMBERS = np.empty(0)
NO_BOUNDS = np.empty(0, dtype=np.int64)
TINY = float(np.finfo(float).tiny)

# Samples along the curve: indices of the first of each piece, parameters, points. A plain tuple:
# numba's cache of a function names the classes of its arguments, and would outlive them.
CurvePoints = tuple[Ints, Floats, Floats]
# Those of `thinning`: VOXEL_COST, COST_UNITS, FAR, MAX_UNCOVERED squared.
CostConstants = tuple[float, float, float, float]


# As in `grid_plane`: the cache of a kernel would not notice a change of another file.
@jit
def _adjacent(voxels: Voxels, i: int, j: int) -> bool:
    return bool(  # without a branch between
        (abs(voxels[0, i] - voxels[0, j]) <= 1)
        & (abs(voxels[1, i] - voxels[1, j]) <= 1)
        & (abs(voxels[2, i] - voxels[2, j]) <= 1)
    )


def thin_events(
    events: VoxelEvents, samples: Samples | None = None, *, keep_tips: bool = False
) -> VoxelEvents:
    """See `thinning.thin_events`."""
    curve: CurvePoints = NO_BOUNDS, NO_NUMBERS, NO_POINTS
    if samples:
        curve = samples.bounds, samples.t, packed(samples.points)
    full = events.piece, events.t, packed(events.voxels), events.heading
    constants = VOXEL_COST, COST_UNITS, FAR, MAX_UNCOVERED * MAX_UNCOVERED
    return VoxelEvents(*_thin_events(*full, curve, constants, keep_tips, WINDOW))


@jit
def _near_turns(piece: Pieces, voxels: Voxels, heading: Bytes, window: int) -> Bools:
    """Return for each event whether a turn is within the window: see `thinning.continues_run`."""
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
def _is_shortcut(voxels: Voxels, i: int, j: int, ahead: int) -> bool:
    """Return whether i leads to j; ``ahead`` events after i are adjacent to it."""
    if not _adjacent(voxels, i, j):
        return False
    for k in range(i + 1 + ahead, j):  # noqa: SIM110 - no generators in kernels
        if not _adjacent(voxels, k, j):
            return False
    return True


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
    """Return the squared distance between a voxel's centre and a point."""
    x = points[0, p] - (voxels[0, i] + 0.5)
    y = points[1, p] - (voxels[1, i] + 0.5)
    z = points[2, p] - (voxels[2, i] + 0.5)
    return float(x * x + y * y + z * z)


@jit
def _uncovers(
    curve: CurvePoints, end: float, voxels: Voxels, i: int, j: int, p: int, farthest: float
) -> bool:
    """Return whether a point of the curve, from ``p`` on, is far from both ends."""
    _, sample_t, points = curve
    while p < sample_t.size and sample_t[p] < end:
        if min(_square(voxels, i, points, p), _square(voxels, j, points, p)) > farthest:
            return True
        p += 1
    return False


@jit
def _squared_distance(curve: CurvePoints, piece: int, t: float, voxels: Voxels, k: int) -> float:
    """See `thinning._squared_distances`."""
    bounds, sample_t, points = curve
    first, last = bounds[piece], bounds[piece + 1] - 1
    low, high = first, last + 1
    while low < high:
        middle = (low + high) // 2
        if sample_t[middle] < t:
            low = middle + 1
        else:
            high = middle
    high = low
    while high <= last and sample_t[high] <= t:
        high += 1
    least = np.inf
    x, y, z = voxels[0, k] + 0.5, voxels[1, k] + 0.5, voxels[2, k] + 0.5
    for shift in range(4):
        begin = min(max(low - 2 + shift, first), last)
        end = min(begin + 1, high + 1, last)
        from_x, from_y, from_z = points[0, begin], points[1, begin], points[2, begin]
        along_x = points[0, end] - from_x
        along_y = points[1, end] - from_y
        along_z = points[2, end] - from_z
        off_x, off_y, off_z = x - from_x, y - from_y, z - from_z
        length = max(along_x * along_x + along_y * along_y + along_z * along_z, TINY)
        share = (off_x * along_x + off_y * along_y + off_z * along_z) / length
        share = min(max(share, 0.0), 1.0)
        off_x, off_y, off_z = (
            off_x - share * along_x,
            off_y - share * along_y,
            off_z - share * along_z,
        )
        least = min(least, off_x * off_x + off_y * off_y + off_z * off_z)
    return least


@jit
def _cost(
    curve: CurvePoints,
    constants: CostConstants,
    piece: Pieces,
    t: Floats,
    until: Floats,
    voxels: Voxels,
    k: int,
) -> int:
    """See `thinning._costs`."""
    voxel_cost, units, far, _ = constants
    least = 0.0
    if curve[1].size:
        least = _squared_distance(curve, piece[k], t[k], voxels, k)
        if until[k] != t[k]:
            least = min(least, _squared_distance(curve, piece[k], until[k], voxels, k))
    scaled = (min(least, far) + voxel_cost) * units
    return int(np.floor(scaled + 0.5))


@jit
def _same(voxels: Voxels, i: int, j: int) -> bool:
    return bool(
        voxels[0, i] == voxels[0, j]
        and voxels[1, i] == voxels[1, j]
        and voxels[2, i] == voxels[2, j]
    )


@jit
def _lesser_backwards(voxels: Voxels, low: int, high: int) -> bool:
    """Return whether voxels from ``high`` to ``low`` come before those from ``low`` to ``high``."""
    for k in range((high - low + 1) // 2):
        for row in range(3):
            back, there = voxels[row, high - k], voxels[row, low + k]
            if back != there:
                return bool(back < there)
    return False


@jit
def _take_cheapest(voxels: Voxels, costs: Ints, low: int, links: Ints, skipped: Bools) -> None:
    """Mark the events that the cheapest path skips: see `thinning._cheapest_path`.

    ``links``, (2, n), are the starts and stops of shortcuts, ascending; ``costs`` those of the
    events from ``low`` on.
    """
    size, count = costs.size, links.shape[1]
    total, other = np.full(size, -1, dtype=np.int64), np.zeros(size, dtype=np.int64)
    if _lesser_backwards(voxels, low, low + size - 1):
        total[size - 1] = 0
        nth = count - 1
        for i in range(size - 2, -1, -1):
            while nth >= 0 and links[0, nth] == low + i:
                j = links[1, nth] - low
                step = 0 if _same(voxels, low + i, low + j) else costs[i] + costs[j]
                if total[i] < 0 or total[j] + step <= total[i]:
                    total[i], other[i] = total[j] + step, j
                nth -= 1
            j = i + 1
            step = 0 if _same(voxels, low + i, low + j) else costs[i] + costs[j]
            if total[i] < 0 or total[j] + step <= total[i]:
                total[i], other[i] = total[j] + step, j
        i = 0
        while i < size - 1:
            skipped[low + i + 1 : low + other[i]] = True
            i = other[i]
        return
    total[0] = 0
    nth = 0
    for i in range(size - 1):
        j = i + 1
        step = 0 if _same(voxels, low + i, low + j) else costs[i] + costs[j]
        if total[j] < 0 or total[i] + step <= total[j]:
            total[j], other[j] = total[i] + step, i
        while nth < count and links[0, nth] == low + i:
            j = links[1, nth] - low
            step = 0 if _same(voxels, low + i, low + j) else costs[i] + costs[j]
            if total[j] < 0 or total[i] + step <= total[j]:
                total[j], other[j] = total[i] + step, i
            nth += 1
    j = size - 1
    while j:
        skipped[low + other[j] + 1 : low + j] = True
        j = other[j]


@jit
def _thin_group(
    voxels: Voxels,
    piece: Pieces,
    t: Floats,
    until: Floats,
    curve: CurvePoints,
    constants: CostConstants,
    low: int,
    high: int,
    links: Ints,
    skipped: Bools,
) -> None:
    """Mark the events that a group of overlapping shortcuts, ``low`` to ``high``, skips."""
    if links.shape[1] == 1:
        skipped[links[0, 0] + 1 : links[1, 0]] = True
    elif links.shape[1]:
        costs = np.empty(high - low + 1, dtype=np.int64)
        for k in range(low, high + 1):
            costs[k - low] = _cost(curve, constants, piece, t, until, voxels, k)
        _take_cheapest(voxels, costs, low, links, skipped)


@jit
def _thin_events(
    full_piece: Pieces,
    full_t: Floats,
    full_voxels: Voxels,
    full_heading: Bytes,
    curve: CurvePoints,
    constants: CostConstants,
    keep_tips: bool,
    window: int,
) -> tuple[Pieces, Floats, Voxels, Bytes]:
    bounds, sample_t, _ = curve
    farthest = constants[3]
    whole = full_t.size
    number, until = np.empty(whole, dtype=np.int64), np.empty(whole)
    size = 0
    for k in range(whole):
        if not (k and full_piece[k] == full_piece[k - 1] and _same(full_voxels, k, k - 1)):
            number[size] = k
            size += 1
        until[size - 1] = full_t[k]
    number = number[:size]
    piece, t, voxels, heading = full_piece, full_t, full_voxels, full_heading
    if size < whole:
        piece, t, heading = full_piece[number], full_t[number], full_heading[number]
        voxels = np.empty((3, size), dtype=np.int32)
        for row in range(3):
            for k in range(size):
                voxels[row, k] = full_voxels[row, number[k]]
    near_turns = _near_turns(piece, voxels, heading, window)

    skipped = np.zeros(size, dtype=np.bool_)
    links = np.empty((2, 4 * window), dtype=np.int64)
    count = low = high = end = p = 0
    for i in range(size):
        if not near_turns[i]:
            continue
        if i >= end:  # of the stretch within which shortcuts are looked for
            end = i
            while end < size and near_turns[end] and piece[end] == piece[i]:
                end += 1
        ahead = 0
        while ahead < window and i + ahead + 1 < end and _adjacent(voxels, i, i + ahead + 1):
            ahead += 1
        for j in range(i + 2, min(i + window + 1, end)):
            if not _is_shortcut(voxels, i, j, ahead):
                continue
            if keep_tips and _skips_tip(piece, voxels, i, j):
                continue
            if sample_t.size:
                p = max(p, bounds[piece[i]])
                while p < bounds[piece[i] + 1] and sample_t[p] < t[i]:
                    p += 1
                if _uncovers(curve, until[j], voxels, i, j, p, farthest):
                    continue
            if i >= high:
                _thin_group(
                    voxels, piece, t, until, curve, constants, low, high, links[:, :count], skipped
                )
                count, low = 0, i
            high = max(high, j)
            if count == links.shape[1]:
                longer = np.empty((2, 2 * count), dtype=np.int64)
                longer[:, :count] = links
                links = longer
            links[0, count], links[1, count] = i, j
            count += 1
    _thin_group(voxels, piece, t, until, curve, constants, low, high, links[:, :count], skipped)

    kept, kept_t = np.empty(size, dtype=np.int64), np.empty(size)
    count = 0
    for i in range(size):
        if skipped[i]:
            continue
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

"""The compiled twins of functions of this package: see `voxdisplay.compiled`.

What is computed, and in what order, is what numpy does in their place, so that all bits agree: the
functions of the same name say what and why. One loop takes the place of many array operations, and
looks at nothing twice.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compiled import jit
from voxdisplay.voxelize.batch import Bools, Floats, Ints, Samples
from voxdisplay.voxelize.crossings import MARGIN, NUDGE, Aims, Corners, Crossings
from voxdisplay.voxelize.events import Events, Voxels
from voxdisplay.voxelize.knots import BEND, CHORD, PARTS
from voxdisplay.voxelize.ranges import Arrays
from voxdisplay.voxelize.reduce import REACH, WINDOW

Bytes = NDArray[np.int8]
Pieces = NDArray[np.int32]

Rows = TypeVar("Rows", bound=NDArray[Any])

TINY = float(np.finfo(float).tiny)
PLAIN = -1  # `events.OTHER`
NO_POINTS = np.empty((3, 0))
NO_NUMBERS = np.empty(0)
NO_PIECES = np.empty(0, dtype=np.int64)


# ------------------------------------------------------------------------------- between knots


def needed_parts(samples: Samples, resolution: Floats) -> tuple[Ints, Floats]:
    """See `knots.needed_parts`."""
    points, limits = _packed(samples.points), (CHORD, BEND, float(PARTS))
    return _needed_parts(samples.piece, samples.t, points, resolution[samples.curve], limits)


@jit
def _most(a: float, b: float) -> float:
    """Give the larger, or the one that is not a number, as numpy does."""
    return a if a >= b or a != a else b  # noqa: PLR0124 - that is how to tell


@jit
def _needed_parts(
    piece: Ints, t: Floats, points: Floats, resolution: Floats, limits: tuple[float, float, float]
) -> tuple[Ints, Floats]:
    size, (most_chord, most_bend, most_parts) = t.size, limits
    short, straight = 0.99 * most_chord, 0.99 * most_bend  # below these nothing is split
    parts, chord = np.ones(size - 1, dtype=np.int64), np.zeros(size - 1)
    room = 64
    velocity, turn = np.empty(room), np.empty(room + 1)
    first = 0
    while first < size:
        last = first
        while last + 1 < size and piece[last + 1] == piece[first]:
            last += 1
        steps, times = last - first, t[first : last + 1]
        if steps > room:
            room = steps
            velocity, turn = np.empty(room), np.empty(room + 1)
        turn[: steps + 1] = 0.0
        longest = chord[first:last]
        for axis in range(3):
            row = points[axis, first : last + 1]
            for k in range(steps):
                velocity[k] = (row[k + 1] - row[k]) / (times[k + 1] - times[k])
                longest[k] = _most(longest[k], abs(row[k + 1] - row[k]))
            for k in range(1, steps):
                turn[k] = _most(turn[k], abs(velocity[k] - velocity[k - 1]))
        for k in range(1, steps):
            turn[k] /= (times[k + 1] - times[k]) + (times[k] - times[k - 1])
        for k in range(steps):
            h = times[k + 1] - times[k]
            bend = h * h * _most(turn[k], turn[k + 1]) / 4
            if (longest[k] <= short) & (bend <= straight):
                continue
            wanted = np.ceil(_most(longest[k] / most_chord, np.sqrt(bend / most_bend)))
            if wanted > 1:
                possible = np.floor(h / resolution[piece[first]])
                parts[first + k] = max(int(min(wanted, possible, most_parts)), 1)
        first = last + 1
    return parts, chord


def slopes_at(knots: Samples) -> Floats:
    """See `crossings.slopes_at`."""
    return _slopes_at(knots.piece, knots.t, _packed(knots.points))


@jit
def _slopes_at(piece: Ints, t: Floats, points: Floats) -> Floats:
    size = t.size
    slopes, velocity = np.zeros_like(points), np.empty(0)
    first = 0
    while first < size:
        last = first
        while last + 1 < size and piece[last + 1] == piece[first]:
            last += 1
        steps, times = last - first, t[first : last + 1]
        if steps > velocity.size:
            velocity = np.empty(steps)
        for axis in range(3):
            row, slope = points[axis, first : last + 1], slopes[axis, first : last + 1]
            for k in range(steps):
                velocity[k] = (row[k + 1] - row[k]) / (times[k + 1] - times[k])
            for k in range(1, steps):
                h, h_next = times[k] - times[k - 1], times[k + 1] - times[k]
                slope[k] = (velocity[k - 1] * h_next + velocity[k] * h) / (h_next + h)
            if steps == 1:
                slope[0] = slope[1] = velocity[0]
            elif steps:
                slope[0] = 2 * velocity[0] - slope[1]
                slope[steps] = 2 * velocity[steps - 1] - slope[steps - 1]
        first = last + 1
    return slopes


def aim(knots: Samples, slopes: Floats, low: int, high: int) -> Aims:
    """See `crossings.aim`."""
    points = _packed(knots.points)
    return Aims(*_aim(knots.piece, knots.t, points, _packed(slopes), low, high, NUDGE))


@jit
def _monotone(slope: float) -> float:
    return slope if 0 < slope < 3 else 1.0


@jit
def _aim(
    piece: Ints, t: Floats, points: Floats, slopes: Floats, low: int, high: int, nudge: float
) -> tuple[Ints, Bytes, Bools, Floats, Floats, Floats]:
    stop = min(high, t.size - 1)
    # The steps that pass planes, of which axis, how many.
    step, dominant = np.empty(stop - low + 1, dtype=np.int64), np.empty(stop - low + 1, np.int8)
    planes = np.empty(stop - low + 1)
    count, total = 0, 0.0
    px, py, pz = points[0, low : stop + 1], points[1, low : stop + 1], points[2, low : stop + 1]
    of = piece[low : stop + 1]
    for k in range(stop - low):
        x, y, z = px[k + 1] - px[k], py[k + 1] - py[k], pz[k + 1] - pz[k]
        x, y, z = abs(x) * (1 + nudge), abs(y), abs(z) * (1 - nudge)
        if (x >= y) & (x >= z):
            axis, begin, end = 0, px[k], px[k + 1]
        elif y >= z:
            axis, begin, end = 1, py[k], py[k + 1]
        else:
            axis, begin, end = 2, pz[k], pz[k + 1]
        passed = np.floor(end - 0.5) - np.floor(begin - 0.5)
        if of[k] != of[k + 1]:
            passed = 0.0
        step[count], dominant[count], planes[count] = low + k, axis, passed
        count += passed != 0
        total += abs(passed)
    size = int(total)
    knot, axes = np.empty(size, dtype=np.int64), np.empty(size, dtype=np.int8)
    descends = np.empty(size, dtype=np.bool_)
    levels, taus, times = np.empty(size), np.empty(size), np.empty(size)
    at = 0
    for nth in range(count):
        k, axis, passed = step[nth], dominant[nth], planes[nth]
        h = t[k + 1] - t[k]
        begin = points[axis, k]
        length = points[axis, k + 1] - begin
        m_left = _monotone(length / (slopes[axis, k] * h))
        m_right = _monotone(length / (slopes[axis, k + 1] * h))
        sense = 1.0 if passed > 0 else -1.0
        first = np.floor(begin - 0.5) + (1.5 if passed > 0 else 0.5)
        for plane in range(int(abs(passed))):
            level = first + sense * plane
            u = (level - begin) / length
            rest = 1.0 - u
            tau = u * (u * (3 - 2 * u) + rest * (m_left * rest - m_right * u))
            knot[at], axes[at], descends[at] = k, axis, passed < 0
            levels[at], taus[at] = level, tau
            times[at] = min(max(t[k] + tau * h, t[k]), t[k + 1])
            at += 1
    return knot, axes, descends, levels, taus, times


def corners(knots: Samples, slopes: Floats, aims: Aims, points: Floats) -> Corners:
    """See `crossings.corners`."""
    aimed = aims.knot, aims.axis, aims.level, aims.tau
    return Corners(*_corners(knots.t, _packed(slopes), *aimed, _packed(points), NUDGE, MARGIN))


@jit
def _corners(
    t: Floats,
    slopes: Floats,
    knot: Ints,
    axes: Bytes,
    level: Floats,
    tau: Floats,
    points: Floats,
    nudge: float,
    margin: float,
) -> tuple[Voxels, Voxels, Floats, Floats]:
    size = knot.size
    nearest, better = np.empty((3, size), dtype=np.int32), np.empty((3, size), dtype=np.int32)
    gain, foot = np.full(size, np.inf), np.full(size, np.inf)
    apart, along, tangent, corner = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    towards, shift, change = np.empty(3), np.empty(3), np.empty(3)
    for k in range(size):
        left, axis = knot[k], axes[k]
        h = t[left + 1] - t[left]
        for row in range(3):
            corner[row] = np.floor(points[row, k] + nudge)
            begin = slopes[row, left] * h
            tangent[row] = begin + tau[k] * (slopes[row, left + 1] * h - begin)
        corner[axis] = level[k] - 0.5
        length = np.sqrt(
            tangent[0] * tangent[0] + tangent[1] * tangent[1] + tangent[2] * tangent[2]
        )
        length = _most(length, TINY)
        for row in range(3):
            apart[row] = corner[row] + 0.5 - points[row, k]
            along[row] = tangent[row] / length
        project = apart[0] * along[0] + apart[1] * along[1] + apart[2] * along[2]
        for row in range(3):
            towards[row] = -1.0 if apart[row] > 0 else 1.0
            shift[row] = towards[row] * along[row]
            change[row] = 1.0 - 2.0 * abs(apart[row]) - (2.0 * project + shift[row]) * shift[row]
        best, one, other = 0.0, -1, -1
        for row in range(3):
            if row != axis and change[row] < best - margin:
                best, one = change[row], row
        # Of the three pairs of axes, in the order of `crossings.corners`, the one on the face.
        first, second = (1, 2) if axis == 0 else ((0, 2) if axis == 1 else (0, 1))
        total = change[first] + change[second] - 2.0 * shift[first] * shift[second]
        if total < best - margin:
            best, one, other = total, first, second
        for row in range(3):
            nearest[row, k] = better[row, k] = int(corner[row])
        if best < 0:
            gain[k] = -best
            for row in range(3):
                if row in (one, other):
                    better[row, k] = int(corner[row] + towards[row])
                    apart[row] += towards[row]
            square = apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2]
            if square > 0.5:
                reach = apart[0] * along[0] + apart[1] * along[1] + apart[2] * along[2]
                foot[k] = reach / length
    return nearest, better, gain, foot


# ----------------------------------------------------------------------------- between events


@jit
def _near(voxels: Voxels, i: int, j: int) -> bool:
    return bool(  # without a branch between
        (abs(voxels[0, i] - voxels[0, j]) <= 1)
        & (abs(voxels[1, i] - voxels[1, j]) <= 1)
        & (abs(voxels[2, i] - voxels[2, j]) <= 1)
    )


@jit
def torn(piece: Pieces, voxels: Voxels) -> Ints:
    """See `events.torn`."""
    found = np.empty(piece.size, dtype=np.int64)
    count = 0
    for k in range(piece.size - 1):
        if (piece[k] == piece[k + 1]) & ~_near(voxels, k, k + 1):
            found[count] = k
            count += 1
    return found[:count].copy()


def choose_corners(crossings: Crossings, knots: Samples) -> Events:
    """See `grid_plane.choose_corners`."""
    inner = crossings.events
    return Events(
        *_choose_corners(
            inner.piece,
            inner.t,
            _packed(inner.voxels),
            inner.heading,
            _packed(crossings.better),
            crossings.gain,
            knots.t,
            _packed(knots.points),
            knots.bounds,
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
    knots_t: Floats,
    points: Floats,
    bounds: Ints,
) -> tuple[Pieces, Floats, Voxels, Bytes]:
    pieces = bounds.size - 1
    size = inner_t.size + 2 * pieces
    piece, t = np.empty(size, dtype=np.int32), np.empty(size)
    nearest, voxels = np.empty((3, size), dtype=np.int32), np.empty((3, size), dtype=np.int32)
    heading, gain = np.full(size, PLAIN, dtype=np.int8), np.full(size, np.inf)
    at = k = 0
    for number in range(pieces):
        for end in range(2):
            knot = bounds[number] if end == 0 else bounds[number + 1] - 1
            piece[at], t[at] = number, knots_t[knot]
            for row in range(3):
                nearest[row, at] = voxels[row, at] = int(np.floor(points[row, knot]))
            at += 1
            while end == 0 and k < inner_t.size and inner_piece[k] == number:
                piece[at], t[at] = number, inner_t[k]
                heading[at], gain[at] = inner_heading[k], inner_gain[k]
                for row in range(3):
                    nearest[row, at] = inner_voxels[row, k]
                    voxels[row, at] = inner_better[row, k]
                at, k = at + 1, k + 1

    bridged = np.zeros(size, dtype=np.bool_)
    for k in range(size - 1):
        if piece[k] == piece[k + 1] and not _near(nearest, k, k + 1):
            bridged[k] = True
            gain[k] = gain[k + 1] = np.inf
    for k in range(size):
        if not np.isfinite(gain[k]):
            voxels[:, k] = nearest[:, k]
    apart = torn(piece, voxels)
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
                    and not _near(voxels, step, step + 1)
                ):
                    look[fresh] = step
                    fresh += 1
        apart = look[:fresh]
    return piece, t, voxels, heading


def insert(at: Ints, arrays: Arrays, fresh: Arrays) -> Arrays:
    """See `ranges.insert`."""
    merged = []
    for array, other in zip(arrays, fresh, strict=True):
        both = _insert(at, *(_packed(np.atleast_2d(each)) for each in (array, other)))
        merged.append(both if array.ndim > 1 else both[0])
    return tuple(merged)


@jit
def _insert(at: Ints, array: NDArray[Any], fresh: NDArray[Any]) -> NDArray[Any]:
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


def reduce(events: Events, way: Samples | None = None, *, tips: bool = False) -> Events:
    """See `reduce.reduce`."""
    known = (way.piece, way.t, _packed(way.points)) if way else (NO_PIECES, NO_NUMBERS, NO_POINTS)
    full = events.piece, events.t, _packed(events.voxels), events.heading
    return Events(*_reduce(*full, *known, tips, WINDOW, REACH * REACH))


@jit
def _look(piece: Pieces, voxels: Voxels, heading: Bytes, window: int) -> Bools:
    """Tell where a turn is within reach: see `reduce.runs_on`."""
    size = piece.size
    reach = np.zeros(size + 1, dtype=np.int32)
    for k in range(size):
        on = k > 0 and piece[k] == piece[k - 1] and heading[k] == heading[k - 1] != PLAIN
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
def _leap(voxels: Voxels, i: int, begin: int, end: int, connected: bool, window: int) -> int:
    """Give J(i) - i within a stretch."""
    ahead = 0
    while ahead < window and i + ahead + 1 < end and _near(voxels, i, i + ahead + 1):
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
                and _near(voxels, j - behind - 1, j)
            ):
                behind += 1
            if ahead + behind >= w - 1:
                return w
    return 1


@jit
def _over_tip(voxels: Voxels, i: int, j: int) -> bool:
    size = voxels.shape[1]
    touches = (i > 0 and _near(voxels, i - 1, j)) or (j + 1 < size and _near(voxels, i, j + 1))
    if not touches:
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
def _reduce(
    full_piece: Pieces,
    full_t: Floats,
    full_voxels: Voxels,
    full_heading: Bytes,
    way_piece: Ints,
    way_t: Floats,
    points: Floats,
    tips: bool,
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
    piece, t, heading = full_piece[number], full_t[number], full_heading[number]
    voxels = np.empty((3, size), dtype=np.int32)
    for row in range(3):
        for k in range(size):
            voxels[row, k] = full_voxels[row, number[k]]
    look = _look(piece, voxels, heading, window)

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
                    connected &= end == i + 1 or _near(voxels, end - 2, end - 1)
            leap = _leap(voxels, i, begin, end, connected, window)
        if leap > 1 and tips and _over_tip(voxels, i, i + leap):
            leap = 1
        if leap > 1 and way_t.size:
            j = i + leap
            while p < way_t.size and (
                way_piece[p] < piece[i] or (way_piece[p] == piece[i] and way_t[p] < t[i])
            ):
                p += 1
            q = p
            while q < way_t.size and way_piece[q] == piece[i] and way_t[q] < t[j]:
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


def _packed(rows: Rows) -> Rows:
    """Give rows that lie one after the other, so that there is one kernel to compile."""
    packed: Rows = np.ascontiguousarray(rows)  # type: ignore[assignment]
    return packed

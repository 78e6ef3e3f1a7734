"""Kernels of `adaptive_sampling` and `plane_crossings`: samples, slopes, crossings, corners.

They hold no state: several threads may run them at once.
"""

from __future__ import annotations

import numpy as np

from voxdisplay.compute.array_types import Bools, Floats, Ints
from voxdisplay.compute.kernel_backend import jit
from voxdisplay.voxelization.adaptive_sampling import MAX_CHORD, MAX_PARTS, MAX_SAG, OVERSPLIT
from voxdisplay.voxelization.curve_batch import Samples
from voxdisplay.voxelization.kernels.contiguous import Bytes, packed
from voxdisplay.voxelization.plane_crossings import (
    MAX_PROJECTION,
    MAX_SQUARE,
    MIN_GAIN,
    TIE_TOLERANCE,
    CornerChoices,
    CrossingGuesses,
    Slopes,
)
from voxdisplay.voxelization.voxel_events import Voxels

Limits = tuple[float, float, float, float]

TINY = float(np.finfo(float).tiny)


def subdivision_counts(samples: Samples, resolution: Floats) -> tuple[Ints, Floats]:
    """See `adaptive_sampling.subdivision_counts`."""
    points, limits = packed(samples.points), (MAX_CHORD, MAX_SAG, OVERSPLIT, float(MAX_PARTS))
    return _subdivision_counts(samples.piece, samples.t, points, resolution[samples.curve], limits)


@jit
def _larger(a: float, b: float) -> float:
    """Return the larger, or the one that is not a number, as numpy does."""
    return a if a >= b or a != a else b  # noqa: PLR0124 - that is how to tell


@jit
def _parts(h: float, chord: float, second: float, resolution: float, limits: Limits) -> int:
    most_chord, most_bend, amply, most_parts = limits
    bend = h * h * second / 4
    if (chord <= 0.99 * most_chord) & (bend <= 0.99 * most_bend):
        return 1
    wanted = _larger(chord / most_chord, np.sqrt(bend / most_bend))
    if not wanted > 1:  # or not a number
        return 1
    return max(int(min(np.ceil(amply * wanted), np.floor(h / resolution), most_parts)), 1)


@jit
def _subdivision_counts(
    piece: Ints, t: Floats, points: Floats, resolution: Floats, limits: Limits
) -> tuple[Ints, Floats]:
    size = t.size
    parts, chord = np.ones(size - 1, dtype=np.int64), np.zeros(size - 1)
    # Of the step before: its turn into this one is known only now.
    before_x = before_y = before_z = before_h = before_turn = 0.0
    inside = False
    for k in range(size - 1):
        joined = piece[k] == piece[k + 1]
        h = x = y = z = turn = 0.0
        if joined:
            h = t[k + 1] - t[k]
            x = points[0, k + 1] - points[0, k]
            y = points[1, k + 1] - points[1, k]
            z = points[2, k + 1] - points[2, k]
            chord[k] = _larger(_larger(abs(x), abs(y)), abs(z))
            x, y, z = x / h, y / h, z / h
            if inside:
                turn = _larger(_larger(abs(x - before_x), abs(y - before_y)), abs(z - before_z))
                turn /= h + before_h
        if inside:
            second = _larger(before_turn, turn)
            parts[k - 1] = _parts(before_h, chord[k - 1], second, resolution[piece[k]], limits)
        inside, before_h, before_turn = joined, h, turn
        before_x, before_y, before_z = x, y, z
    if inside:
        at = size - 2
        parts[at] = _parts(before_h, chord[at], before_turn, resolution[piece[at]], limits)
    return parts, chord


def slopes_at(samples: Samples) -> Floats:
    """See `plane_crossings.slopes_at`."""
    return _slopes_at(samples.piece, samples.t, packed(samples.points))


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


def guess_crossings(samples: Samples, slopes: Slopes, low: int, high: int) -> CrossingGuesses:
    """See `plane_crossings.guess_crossings`."""
    known = samples.piece, samples.t, packed(samples.points)
    tangents = packed(slopes.arriving), packed(slopes.leaving)
    return CrossingGuesses(*_guess_crossings(*known, *tangents, low, high, TIE_TOLERANCE))


@jit
def _monotone(slope: float) -> float:
    return slope if 0 < slope < 3 else 1.0


@jit
def _guess_crossings(
    piece: Ints,
    t: Floats,
    points: Floats,
    arriving: Floats,
    leaving: Floats,
    low: int,
    high: int,
    nudge: float,
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
    sample, axes = np.empty(size, dtype=np.int64), np.empty(size, dtype=np.int8)
    descends = np.empty(size, dtype=np.bool_)
    levels, taus, times = np.empty(size), np.empty(size), np.empty(size)
    at = 0
    for nth in range(count):
        k, axis, passed = step[nth], dominant[nth], planes[nth]
        h = t[k + 1] - t[k]
        begin = points[axis, k]
        length = points[axis, k + 1] - begin
        m_left = _monotone(length / (leaving[axis, k] * h))
        m_right = _monotone(length / (arriving[axis, k + 1] * h))
        sense = 1.0 if passed > 0 else -1.0
        first = np.floor(begin - 0.5) + (1.5 if passed > 0 else 0.5)
        for plane in range(int(abs(passed))):
            level = first + sense * plane
            u = (level - begin) / length
            rest = 1.0 - u
            tau = u * (u * (3 - 2 * u) + rest * (m_left * rest - m_right * u))
            sample[at], axes[at], descends[at] = k, axis, passed < 0
            levels[at], taus[at] = level, tau
            times[at] = min(max(t[k] + tau * h, t[k]), t[k + 1])
            at += 1
    return sample, axes, descends, levels, taus, times


def rank_corners(
    samples: Samples, slopes: Slopes, guesses: CrossingGuesses, points: Floats
) -> CornerChoices:
    """See `plane_crossings.rank_corners`."""
    tangents = packed(slopes.arriving), packed(slopes.leaving)
    guessed = guesses.sample, guesses.axis, guesses.level, guesses.tau
    limits = TIE_TOLERANCE, MIN_GAIN, MAX_PROJECTION, MAX_SQUARE
    known = (*tangents, *guessed, packed(points), *limits)
    return CornerChoices(*_rank_corners(samples.t, *known))


@jit
def _between(begin: float, end: float, share: float) -> float:
    return begin + share * (end - begin)


@jit
def _dot(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> float:
    return ax * bx + ay * by + az * bz


@jit
def _rank_corners(
    t: Floats,
    arriving: Floats,
    leaving: Floats,
    sample: Ints,
    axes: Bytes,
    level: Floats,
    tau: Floats,
    points: Floats,
    nudge: float,
    margin: float,
    most_projection: float,
    most_square: float,
) -> tuple[Voxels, Voxels, Floats, Floats]:
    size = sample.size
    nearest, better = np.empty((3, size), dtype=np.int32), np.empty((3, size), dtype=np.int32)
    gain, foot = np.full(size, np.inf), np.full(size, np.inf)
    for k in range(size):
        left, axis, share, plane = sample[k], axes[k], tau[k], level[k] - 0.5
        h = t[left + 1] - t[left]
        x, y, z = points[0, k], points[1, k], points[2, k]
        along_x = _between(leaving[0, left] * h, arriving[0, left + 1] * h, share)
        along_y = _between(leaving[1, left] * h, arriving[1, left + 1] * h, share)
        along_z = _between(leaving[2, left] * h, arriving[2, left + 1] * h, share)
        length = _larger(np.sqrt(_dot(along_x, along_y, along_z, along_x, along_y, along_z)), TINY)
        along_x, along_y, along_z = along_x / length, along_y / length, along_z / length
        off = x if axis == 0 else (y if axis == 1 else z)
        off = (off - level[k]) / (along_x if axis == 0 else (along_y if axis == 1 else along_z))
        if not abs(off) < most_projection:
            off = 0.0
            if not (np.isfinite(along_x) and np.isfinite(along_y) and np.isfinite(along_z)):
                along_x = along_y = along_z = 0.0
        on_x, on_y, on_z = x - off * along_x, y - off * along_y, z - off * along_z
        corner_x = plane if axis == 0 else np.floor(on_x + nudge)
        corner_y = plane if axis == 1 else np.floor(on_y + nudge)
        corner_z = plane if axis == 2 else np.floor(on_z + nudge)
        apart_x, apart_y, apart_z = (
            corner_x + 0.5 - on_x,
            corner_y + 0.5 - on_y,
            corner_z + 0.5 - on_z,
        )
        project = _dot(apart_x, apart_y, apart_z, along_x, along_y, along_z)
        square = _dot(apart_x, apart_y, apart_z, apart_x, apart_y, apart_z)
        if square + off * (off - 2.0 * project) > most_square:
            corner_x = plane if axis == 0 else np.floor(x + nudge)
            corner_y = plane if axis == 1 else np.floor(y + nudge)
            corner_z = plane if axis == 2 else np.floor(z + nudge)
            apart_x, apart_y, apart_z = corner_x + 0.5 - x, corner_y + 0.5 - y, corner_z + 0.5 - z
            project = _dot(apart_x, apart_y, apart_z, along_x, along_y, along_z)
        # The two axes of the face.
        first, second = (1 if axis == 0 else 0), (1 if axis == 2 else 2)
        apart_1, apart_2 = (apart_y if axis == 0 else apart_x), (apart_y if axis == 2 else apart_z)
        along_1, along_2 = (along_y if axis == 0 else along_x), (along_y if axis == 2 else along_z)
        shift_1 = -along_1 if apart_1 > 0 else along_1
        shift_2 = -along_2 if apart_2 > 0 else along_2
        change_1 = 1.0 - 2.0 * abs(apart_1) - (2.0 * project + shift_1) * shift_1
        change_2 = 1.0 - 2.0 * abs(apart_2) - (2.0 * project + shift_2) * shift_2
        both = change_1 + change_2 - 2.0 * shift_1 * shift_2
        best, move_1, move_2 = 0.0, False, False
        if change_1 < best - margin:
            best, move_1 = change_1, True
        if change_2 < best - margin:
            best, move_1, move_2 = change_2, False, True
        if both < best - margin:
            best, move_1, move_2 = both, True, True
        nearest[0, k] = better[0, k] = int(corner_x)
        nearest[1, k] = better[1, k] = int(corner_y)
        nearest[2, k] = better[2, k] = int(corner_z)
        if best < 0:
            gain[k] = -best
            step_1 = (-1 if apart_1 > 0 else 1) if move_1 else 0
            step_2 = (-1 if apart_2 > 0 else 1) if move_2 else 0
            better[first, k] += step_1
            better[second, k] += step_2
            apart_x = better[0, k] + 0.5 - x
            apart_y = better[1, k] + 0.5 - y
            apart_z = better[2, k] + 0.5 - z
            if _dot(apart_x, apart_y, apart_z, apart_x, apart_y, apart_z) > 0.5:
                reach = _dot(apart_x, apart_y, apart_z, along_x, along_y, along_z)
                foot[k] = reach / length
    return nearest, better, gain, foot

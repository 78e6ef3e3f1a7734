"""Thinning of connected voxel lists to chordless ones, by cheapest paths.

A *chord* is a pair of neighbouring voxels that are not consecutive in the sequence; each one
gives some voxel a third neighbour. This module knows events, and the curve as points: a hairpin,
which turns back within two voxels, must not lose its far end.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Floats
from voxdisplay.compute.kernel_backend import with_kernel
from voxdisplay.voxelization.curve_batch import Samples
from voxdisplay.voxelization.index_ranges import expand_ranges
from voxdisplay.voxelization.voxel_events import NO_HEADING, VoxelEvents, adjacent

# Events ahead that a shortcut may lead. Longer chords belong to the curve: it comes back.
WINDOW = 12
# Voxels compared with those after them at once.
BLOCK = 1 << 12
# How far from the voxels at both ends of a shortcut samples of the curve may be between them, in
# voxels. The curve itself is to be within 2.5: the rest is for how far it may be from its samples,
# which is much more than `adaptive_sampling.MAX_SAG` at cusps.
MAX_UNCOVERED = 2.0
# Paths cost the squared distances of their voxels from the curve and this for each, in square
# voxels: fewer voxels are better, but not at the price of a corner or a peak.
VOXEL_COST = 0.05
# Costs are whole numbers of units of 1 / COST_UNITS square voxels. Of distances that differ by
# rounding only, hardly any are rounded to different units.
COST_UNITS = 1.1 * 2.0**36
# What is further away, in square voxels, does not cost more.
FAR = 4.0
TINY = float(np.finfo(float).tiny)


def drop_repeats(events: VoxelEvents) -> VoxelEvents:
    """Remove consecutive events of a piece that share a voxel."""
    return _without_repeats(events)[0]


def _without_repeats(events: VoxelEvents) -> tuple[VoxelEvents, Floats]:
    """Return events as `drop_repeats`, and the parameters of the last of those that share each."""
    same = events.joined & (events.voxels[:, 1:] == events.voxels[:, :-1]).all(axis=0)
    if not same.any():
        return events, events.t
    new = ~same
    return events.take(np.append(True, new)), events.t[np.append(new, True)]


@with_kernel
def thin_events(
    events: VoxelEvents, samples: Samples | None = None, *, keep_tips: bool = False
) -> VoxelEvents:
    """Return the subsequence of events without chords that lies nearest to the curve.

    A shortcut leads from event i to a later event j, at most ``WINDOW`` on, whose voxel is equal
    or adjacent to that of i, with every event between them adjacent to i (a prefix) or to j (the
    rest). Of all paths of steps and shortcuts from the first to the last event of a piece, the
    one with the least sum of squared distances from the curve, plus ``VOXEL_COST`` for each
    voxel, is taken. On it no two voxels are neighbours but consecutive ones, unless the curve
    leaves their surroundings between them: a shortcut from one to the other would cost less.

    The sum knows no direction: a curve and its reverse, or its mirror image, have the same path.
    Where two paths cost the same, the one found from the lesser end of the shortcuts is taken.

    Parameters
    ----------
    events : VoxelEvents
        Consecutive ones 26-adjacent or equal within a piece.
    samples : Samples, optional
        Points along the same pieces, to measure distances from. Shortcuts that leave one of them
        further than ``MAX_UNCOVERED`` from both ends are not taken: the chords that remain are
        the curve's own.
    keep_tips : bool
        Take no shortcut over a tip: a voxel that sticks out of the box around both ends, where
        the sequence comes back so near to itself that it would still be touching without the tip.

    Returns
    -------
    VoxelEvents
        No two consecutive ones of a piece are equal. The first and the last stay.

    """
    if not events.t.size:
        return events
    full, (thin, until) = events, _without_repeats(events)
    starts, stops = _shortcuts(thin, until, samples, keep_tips=keep_tips)
    if starts.size:
        starts, stops = _cheapest(thin, until, samples, starts, stops)
        change = np.zeros(thin.t.size, dtype=np.int8)
        change[starts + 1] += 1
        change[stops] -= 1
        thin = drop_repeats(thin.take(np.cumsum(change, dtype=np.int8) == 0))
    # A piece ends where it ends, even if its last voxel was reached before.
    last, thin_last = (np.append(~each.joined, True).nonzero()[0] for each in (full, thin))
    thin.t[thin_last] = full.t[last]
    return thin


def continues_run(events: VoxelEvents) -> NDArray[np.bool_]:
    """Return which events, (M,), are one step further than the last on the axis both head along.

    Events of a run have no chord among them: they are as far apart as their indices are.
    """
    heading, size = events.heading, events.t.size
    on = np.zeros(size, dtype=bool)
    on[1:] = events.joined & (heading[1:] == heading[:-1]) & (heading[1:] != NO_HEADING)
    along = on.nonzero()[0]
    at = (heading[along] >> 1).astype(np.int64) * size + along  # of flat rows
    step = events.voxels.take(at) - events.voxels.take(at - 1)
    on[along] = step == 1 - 2 * (heading[along] & 1)
    return on


def _shortcuts(
    events: VoxelEvents, until: Floats, samples: Samples | None, *, keep_tips: bool
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return all shortcuts, as indices of their ends, in ascending order of these."""
    size = events.t.size
    # Only near turns: between them the step i, i + 1 is all there is.
    turn = (~continues_run(events)).nonzero()[0]
    reach = np.bincount(np.maximum(turn - WINDOW, 0), minlength=size + 1)
    reach -= np.bincount(np.minimum(turn + WINDOW, size), minlength=size + 1)
    near_turns = (np.cumsum(reach[:-1]) > 0).nonzero()[0]
    if near_turns.size < 3:
        return near_turns[:0], near_turns[:0]
    stretch = near_turns - np.arange(near_turns.size) + events.piece[near_turns]
    first, second = find_shortcuts(events.voxels.take(near_turns, axis=1), stretch)
    starts, stops = near_turns[first], near_turns[second]
    if not starts.size:
        return starts, stops
    if keep_tips:
        keep = ~_skips_tip(events, starts, stops)
        starts, stops = starts[keep], stops[keep]
    if samples:
        keep = ~_uncovers_curve(events, until, samples, starts, stops)
        starts, stops = starts[keep], stops[keep]
    return starts, stops


def _cheapest(
    events: VoxelEvents,
    until: Floats,
    samples: Samples | None,
    starts: NDArray[np.intp],
    stops: NDArray[np.intp],
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Select the shortcuts of the cheapest path."""
    # Shortcuts that overlap form a group; what is chosen in one is no concern of another.
    opens = np.append(True, starts[1:] >= np.maximum.accumulate(stops)[:-1])
    first = opens.nonzero()[0]
    last = np.append(first[1:], starts.size)
    alone = last - first == 1
    taken_starts, taken_stops = [starts[first[alone]]], [stops[first[alone]]]
    if not alone.all():
        several = ~alone
        lows = starts[first[several]]
        highs = np.maximum.reduceat(stops, first)[several]
        counts = highs - lows + 1
        nodes = expand_ranges(lows, counts)
        costs = _costs(events, until, samples, nodes).tolist()
        voxels = list(zip(*events.voxels.take(nodes, axis=1).tolist(), strict=True))
        shortcuts = list(zip(starts.tolist(), stops.tolist(), strict=True))
        at = 0
        found: list[tuple[int, int]] = []
        for low, count, a, b in zip(
            lows.tolist(),
            counts.tolist(),
            first[several].tolist(),
            last[several].tolist(),
            strict=True,
        ):
            links = [(i - low, j - low) for i, j in shortcuts[a:b]]
            path = _cheapest_path(costs[at : at + count], voxels[at : at + count], links)
            found += [(low + i, low + j) for i, j in path]
            at += count
        more = np.array(found, dtype=np.intp).reshape(-1, 2)
        taken_starts.append(more[:, 0])
        taken_stops.append(more[:, 1])
    return np.concatenate(taken_starts), np.concatenate(taken_stops)


def _cheapest_path(
    costs: list[int], voxels: list[tuple[int, ...]], links: list[tuple[int, int]]
) -> list[tuple[int, int]]:
    """Return the shortcuts of the cheapest path over n events, from the first to the last."""
    size = len(costs)
    backwards = voxels[::-1] < voxels  # the order of equal costs knows no direction either
    if backwards:
        costs, voxels = costs[::-1], voxels[::-1]
        links = [(size - 1 - j, size - 1 - i) for i, j in links]
    before: list[list[int]] = [[k - 1] for k in range(size)]
    for i, j in links:
        before[j].append(i)
    total, origin = [0] * size, [0] * size
    for j in range(1, size):
        least, best = -1, 0
        for i in sorted(before[j], reverse=True):
            step = 0 if voxels[i] == voxels[j] else costs[i] + costs[j]
            if least < 0 or total[i] + step < least:
                least, best = total[i] + step, i
        total[j], origin[j] = least, best
    path = []
    j = size - 1
    while j:
        i = origin[j]
        if j - i > 1:
            path.append((size - 1 - j, size - 1 - i) if backwards else (i, j))
        j = i
    return path


def _costs(
    events: VoxelEvents, until: Floats, samples: Samples | None, index: NDArray[np.integer]
) -> NDArray[np.int64]:
    """Return the costs of events: squared distances from the samples' polyline, as integers.

    Whole numbers, so that sums do not depend on the order of their terms. Of events that share a
    voxel the first and the last count, so that the direction does not.
    """
    square = np.zeros(index.size)
    if samples:
        square = _squared_distances(events, events.t, samples, index)
        again = (until[index] != events.t[index]).nonzero()[0]
        if again.size:
            other = _squared_distances(events, until, samples, index[again])
            square[again] = np.minimum(square[again], other)
    scaled = (np.minimum(square, FAR) + VOXEL_COST) * COST_UNITS
    return np.floor(scaled + 0.5).astype(np.int64)


@np.errstate(under="ignore")
def _squared_distances(
    events: VoxelEvents, t: Floats, samples: Samples, index: NDArray[np.integer]
) -> Floats:
    """Return squared distances of voxel centres, (n,), from the polyline around parameters t."""
    order = samples.piece + 1j * samples.t
    here = events.piece[index] + 1j * t[index]
    low, high = np.searchsorted(order, here), np.searchsorted(order, here, side="right")
    bounds = samples.bounds
    first, last = bounds[events.piece[index]], bounds[events.piece[index] + 1] - 1
    centres = events.voxels.take(index, axis=1) + 0.5
    least = np.full(index.size, np.inf)
    for shift in range(4):
        begin = np.minimum(np.maximum(low - 2 + shift, first), last)
        end = np.minimum(np.minimum(begin + 1, high + 1), last)
        here_points = samples.points.take(begin, axis=1)
        along = samples.points.take(end, axis=1) - here_points
        offset = centres - here_points
        length = np.maximum((along * along).sum(axis=0), TINY)
        share = np.minimum(np.maximum((offset * along).sum(axis=0) / length, 0.0), 1.0)
        offset = offset - share * along
        least = np.minimum(least, (offset * offset).sum(axis=0))
    return least


def _skips_tip(
    events: VoxelEvents, starts: NDArray[np.intp], stops: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """Return which shortcuts would remove a tip and still leave a chord beside them."""
    voxels, size = events.voxels, events.t.size
    before, after = np.maximum(starts - 1, 0), np.minimum(stops + 1, size - 1)
    piece = events.piece
    apart = (before == starts) | (piece[before] != piece[starts])
    touches = adjacent(voxels[:, before], voxels[:, stops]) & ~apart
    apart = (after == stops) | (piece[after] != piece[stops])
    touches |= adjacent(voxels[:, starts], voxels[:, after]) & ~apart
    low = np.minimum(voxels[:, starts], voxels[:, stops])
    high = np.maximum(voxels[:, starts], voxels[:, stops])
    out = np.zeros(starts.size, dtype=bool)
    for skipped in range(1, int((stops - starts).max(initial=0))):
        voxel = voxels[:, np.minimum(starts + skipped, stops)]
        out |= ((voxel < low) | (voxel > high)).any(axis=0)
    return np.asarray(touches & out)


@np.errstate(under="ignore")
def _uncovers_curve(
    events: VoxelEvents,
    until: Floats,
    samples: Samples,
    starts: NDArray[np.intp],
    stops: NDArray[np.intp],
) -> NDArray[np.bool_]:
    """Return which shortcuts leave a point of the curve further than ``MAX_UNCOVERED``."""
    # Complex numbers are ordered by their real parts, then by their imaginary ones.
    order = samples.piece + 1j * samples.t
    ends = np.stack((starts, stops))
    between = np.stack((events.t[starts], until[stops]))
    low, high = np.searchsorted(order, events.piece[starts] + 1j * between)
    count = high - low
    of = np.arange(starts.size).repeat(count)
    points = samples.points.take(expand_ranges(low, count), axis=1)
    apart = points[:, None] - (events.voxels.take(ends[:, of], axis=1) + 0.5)
    far = ((apart * apart).sum(axis=0) > MAX_UNCOVERED * MAX_UNCOVERED).all(axis=0)
    behind = np.zeros(starts.size, dtype=bool)
    behind[of[far]] = True
    return behind


def find_shortcuts(
    voxels: NDArray[np.int32], stretch: NDArray[np.integer]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return all shortcuts between n voxels, (3, n), within stretches, (n,): starts, stops."""
    touch = _adjacency_in_window(np.concatenate((voxels, 2 * stretch[None].astype(np.int32))))
    w, start = touch[1:].nonzero()
    if start.size:
        order = np.argsort(start, kind="stable")  # by start, then by stop
        w, start = w[order] + 2, start[order]
        stop, steps = start + w, np.arange(WINDOW)[:, None]
        before = touch[steps, np.maximum(stop - 1 - steps, 0)]  # it is enough to look until start
        ahead, behind = (
            np.logical_and.accumulate(each).sum(axis=0) for each in (touch[:, start], before)
        )
        valid = ahead + behind >= w - 1
        start, w = start[valid], w[valid]
    return start, start + w


def furthest_shortcuts(voxels: NDArray[np.int32], stretch: NDArray[np.integer]) -> NDArray[np.int8]:
    """Return how many events each of n voxels, (3, n), can skip at most, plus 1: (n,)."""
    leap = np.ones(stretch.size, dtype=np.int8)
    start, stop = find_shortcuts(voxels, stretch)
    leap[start] = stop - start  # of several for one voxel, the last: the furthest
    return leap


def _adjacency_in_window(rows: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return which of n voxels touch the ones after them: [w - 1, i] for voxels i and i + w.

    A fourth row, twice the stretch, keeps those of different stretches apart.
    """
    size = rows.shape[1]
    beyond = np.full((4, WINDOW), -2, dtype=np.int32)
    padded = np.concatenate((rows, beyond), axis=1)
    touch = np.empty((WINDOW, size), dtype=bool)
    for low in range(0, size, BLOCK):
        here = rows[:, None, low : low + BLOCK]
        after = padded[:, low + 1 : low + here.shape[2] + WINDOW]
        row, column = after.strides
        windows = as_strided(after, (4, WINDOW, here.shape[2]), (row, column, column))
        apart = np.abs(windows - here)
        # Only 0 and 1 give 0 or 1.
        touch[:, low : low + BLOCK] = np.bitwise_or.reduce(apart) <= 1
    return touch

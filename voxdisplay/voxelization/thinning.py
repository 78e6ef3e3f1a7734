"""Thinning: from a connected list of voxels to one without short cuts.

A *chord* is a pair of neighbouring voxels that are not consecutive in the sequence; each one
gives some voxel a third neighbour. Integer work on events, but for one look at where the curve
is, as points: what turns back within two voxels, as a hairpin does, may not lose its far end.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from voxdisplay.compute.kernel_backend import with_kernel
from voxdisplay.voxelization.curve_batch import Samples
from voxdisplay.voxelization.index_ranges import expand_ranges
from voxdisplay.voxelization.voxel_events import NO_HEADING, VoxelEvents, adjacent

# How many events ahead a chord is looked for. Longer ones belong to the curve: it comes back.
WINDOW = 12
# Voxels compared with those after them at once.
BLOCK = 1 << 12
# How far from the voxels at both ends of a short cut samples of the curve may be between them, in
# voxels. The curve itself is to be within 2.5: the rest is for how far it may be from its samples,
# which is much more than `adaptive_sampling.MAX_SAG` at cusps.
MAX_UNCOVERED = 2.0


def drop_repeats(events: VoxelEvents) -> VoxelEvents:
    """Drop events whose voxel is that of the event before them in the piece."""
    same = events.joined & (events.voxels[:, 1:] == events.voxels[:, :-1]).all(axis=0)
    return events.take(np.concatenate(([True], ~same))) if same.any() else events


@with_kernel
def thin_events(
    events: VoxelEvents, samples: Samples | None = None, *, keep_tips: bool = False
) -> VoxelEvents:
    """Take short cuts, event i to event J(i), from the first to the last event of every piece.

    J(i) is the furthest j at most ``WINDOW`` on whose voxel is equal or adjacent to that of i,
    with every event between them adjacent to i (a prefix) or to j (the rest). On the path so found
    no two voxels are neighbours but consecutive ones, unless the curve leaves their surroundings
    between them: a chord from a to c across b would have made c, not b, the J(a).

    Parameters
    ----------
    events : Events
        Consecutive ones 26-adjacent or equal within a piece.
    samples : Samples, optional
        Points along the same pieces. Short cuts that leave one of them further than
        ``MAX_UNCOVERED`` from both ends are not taken: the chords that remain are the curve's.
    keep_tips : bool
        Take no short cut over a tip: a voxel that sticks out of the box around both ends, where
        the sequence comes back so near to itself that it would still be touching without the tip.

    Returns
    -------
    Events
        Of which no two consecutive ones of a piece are equal. First and last stay.

    """
    if not events.t.size:
        return events
    full, thin = events, drop_repeats(events)
    start, stop = _shortcuts(thin, samples, keep_tips=keep_tips)
    if start.size:
        change = np.zeros(thin.t.size, dtype=np.int8)
        change[start + 1] += 1
        change[stop] -= 1
        thin = drop_repeats(thin.take(np.cumsum(change, dtype=np.int8) == 0))
    # A piece ends where it ends, even if its last voxel was reached before.
    last, thin_last = (np.append(~each.joined, True).nonzero()[0] for each in (full, thin))
    thin.t[thin_last] = full.t[last]
    return thin


def continues_run(events: VoxelEvents) -> NDArray[np.bool_]:
    """Tell which events, (M,), are one step further than the last on the axis both head along.

    Events that run on have no chord among them: they are as far apart as their indices are.
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
    events: VoxelEvents, samples: Samples | None, *, keep_tips: bool
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Find the short cuts i, J(i) with J(i) > i + 1 on the path from the start of each piece."""
    size = events.t.size
    # Look only where a turn is within reach: between turns the step i, i + 1 is all there is.
    turn = (~continues_run(events)).nonzero()[0]
    reach = np.bincount(np.maximum(turn - WINDOW, 0), minlength=size + 1)
    reach -= np.bincount(np.minimum(turn + WINDOW, size), minlength=size + 1)
    look = (np.cumsum(reach[:-1]) > 0).nonzero()[0]
    if look.size < 3:
        return look[:0], look[:0]
    stretch = look - np.arange(look.size) + events.piece[look]
    leap = furthest_shortcuts(events.voxels.take(look, axis=1), stretch)
    short = (leap > 1).nonzero()[0]
    if not short.size:
        return short, short
    starts, stops = look[short], look[short] + leap[short]
    if keep_tips:
        keep = ~_skips_tip(events, starts, stops)
        starts, stops = starts[keep], stops[keep]
    if samples:
        keep = ~_uncovers_curve(events, samples, starts, stops)
        starts, stops = starts[keep], stops[keep]
    taken = []
    end = -1
    for nth, (start, stop) in enumerate(zip(starts.tolist(), stops.tolist(), strict=True)):
        if start >= end:
            taken.append(nth)
            end = stop
    return starts[taken], stops[taken]


def _skips_tip(
    events: VoxelEvents, starts: NDArray[np.intp], stops: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """Tell which short cuts would take a tip and still leave a chord beside them."""
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


def _uncovers_curve(
    events: VoxelEvents, samples: Samples, starts: NDArray[np.intp], stops: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """Tell which short cuts leave a point of the curve out of ``MAX_UNCOVERED``."""
    # Complex numbers are ordered by their real parts, then by their imaginary ones.
    order = samples.piece + 1j * samples.t
    ends = np.stack((starts, stops))
    low, high = np.searchsorted(order, events.piece[starts] + 1j * events.t[ends])
    count = high - low
    of = np.arange(starts.size).repeat(count)
    points = samples.points.take(expand_ranges(low, count), axis=1)
    apart = points[:, None] - (events.voxels.take(ends[:, of], axis=1) + 0.5)
    far = ((apart * apart).sum(axis=0) > MAX_UNCOVERED * MAX_UNCOVERED).all(axis=0)
    behind = np.zeros(starts.size, dtype=bool)
    behind[of[far]] = True
    return behind


def furthest_shortcuts(voxels: NDArray[np.int32], stretch: NDArray[np.integer]) -> NDArray[np.int8]:
    """Give J(i) - i for each of n voxels, (3, n), which are looked at within stretches (n,)."""
    leap = np.ones(stretch.size, dtype=np.int8)
    touch = _adjacency_in_window(np.concatenate((voxels, 2 * stretch[None].astype(np.int32))))
    w, start = touch[1:].nonzero()
    if start.size:
        w += 2
        stop, steps = start + w, np.arange(WINDOW)[:, None]
        before = touch[steps, np.maximum(stop - 1 - steps, 0)]  # it is enough to look until start
        ahead, behind = (
            np.logical_and.accumulate(each).sum(axis=0) for each in (touch[:, start], before)
        )
        short = ahead + behind >= w - 1
        leap[start[short]] = w[short]  # of several for one voxel, the last: the furthest
    return leap


def _adjacency_in_window(rows: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Tell which of n voxels touch the ones after them: [w - 1, i] for voxels i and i + w.

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

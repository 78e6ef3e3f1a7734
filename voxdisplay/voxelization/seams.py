"""Seams of closed curves: where they are cut open to be traced and thinned.

A closed curve begins where its formula does, and that should not show: cut open there, it would
be thinned otherwise than from another beginning. So it is cut in the middle of a long straight
run instead, where there is no choice between voxels, and put together again at its first voxel.
This module must not know how corners are chosen or events thinned.
"""

from __future__ import annotations

import numpy as np

from voxdisplay.compute.array_types import Ints
from voxdisplay.curves.curve import Curve
from voxdisplay.voxelization.curve_batch import CurveBatch, Samples
from voxdisplay.voxelization.index_ranges import expand_ranges
from voxdisplay.voxelization.plane_crossings import Crossings
from voxdisplay.voxelization.thinning import continues_run
from voxdisplay.voxelization.voxel_events import VoxelEvents

# A run must be this long, in voxels, for no shortcut to lead over its middle, and the seam this
# far from its ends at least.
MIN_RUN = 9
MARGIN = 3
# How many voxels before and after the beginning may hold the curve's first point.
NEAR_START = 3


def move_seams(
    batch: CurveBatch, crossings: Crossings, samples: Samples, closed: list[bool]
) -> tuple[Crossings, Samples, list[bool]]:
    """Return crossings and samples of which closed curves begin amid their longest runs.

    Parameters
    ----------
    batch : CurveBatch
        Parameters of the curves that are moved go on past the ends of their ranges from now on.
    crossings : Crossings
        Of all pieces.
    samples : Samples
        Along them.
    closed : list of bool
        For each curve.

    Returns
    -------
    crossings, samples
        With the pieces of these curves beginning and ending at a crossing, which is among the
        samples, twice, and no more among the crossings.
    moved : list of bool
        For each curve. Those that jump, or have no long run, stay as they are.

    """
    events = crossings.events
    moved = np.array(closed) & (np.bincount(samples.curve, minlength=len(closed)) == 1)
    curve = moved.nonzero()[0]
    piece = samples.curve.searchsorted(curve)
    at = _seams(crossings, piece)
    found = at >= 0
    curve, piece, at = curve[found], piece[found], at[found]
    points = batch.evaluate(curve, events.t[at])
    plain = (np.floor(points) == events.voxels.take(at, axis=1)).all(axis=0)
    curve, piece, at, points = curve[plain], piece[plain], at[plain], points[:, plain]
    moved[:] = False
    moved[curve] = True
    if not curve.size:
        return crossings, samples, moved.tolist()

    batch.extend(moved)
    seam, period = events.t[at], (batch.last - batch.first)[curve]
    later = np.zeros(events.t.size)
    begin = events.piece.searchsorted(piece)
    before = expand_ranges(begin, at - begin)
    later[before] = period.repeat(at - begin)
    t = events.t + later
    order = np.lexsort((later > 0, events.piece))  # stable: in the same order otherwise
    order = order[~np.isin(order, at)]
    rotated = events.take(order)
    crossings = Crossings(
        VoxelEvents(rotated.piece, t[order], rotated.voxels, rotated.heading),
        crossings.better.take(order, axis=1),
        crossings.gain[order],
    )

    # The first sample is the last one, too.
    first = samples.bounds[piece]
    count = np.searchsorted(samples.piece + 1j * samples.t, piece + 1j * seam) - first
    t = samples.t.copy()
    t[expand_ranges(first, count)] += period.repeat(count)
    pieces = np.concatenate((np.delete(samples.piece, first), piece, piece))
    t = np.concatenate((np.delete(t, first), seam, seam + period))
    inner = np.delete(samples.points, first, axis=1)
    order = np.lexsort((t, pieces))
    points = np.concatenate((inner, points, points), axis=1).take(order, axis=1)
    return crossings, Samples(pieces[order], t[order], points, samples.curve), moved.tolist()


def _seams(crossings: Crossings, piece: Ints) -> Ints:
    """Return a crossing in the middle of the longest run of each piece; -1 if none is long.

    Of those near the middle, one that has no better corner than the nearest: both of its copies
    will have the same voxel.
    """
    events = crossings.events
    goes_on = continues_run(events)
    bounds = events.piece.searchsorted(np.stack((piece, piece + 1)))
    found = np.full(piece.size, -1, dtype=np.int64)
    for nth, (low, high) in enumerate(bounds.T.tolist()):
        starts = np.append((~goes_on[low:high]).nonzero()[0], high - low)
        length = np.diff(starts)
        if not length.size or length.max() < MIN_RUN:
            continue
        longest = int(np.argmax(length))
        begin, end = low + starts[longest] + MARGIN, low + starts[longest + 1] - MARGIN
        plain = begin + np.isinf(crossings.gain[begin:end]).nonzero()[0]
        if plain.size:
            found[nth] = plain[np.argmin(np.abs(2 * plain - (begin + end - 1)))]
    return found


def begin_at_start(loop: VoxelEvents, curve: Curve) -> VoxelEvents:
    """Return a closed sequence that was cut elsewhere, beginning where its curve does.

    Parameters
    ----------
    loop : VoxelEvents
        Its last voxel is its first; parameters go on past the end of the range.
    curve : Curve
        The curve.

    Returns
    -------
    VoxelEvents
        Each voxel once, with parameters in the range, ascending. The first holds the curve's
        first point, if any near there does; else it is the nearest to it.

    """
    size = loop.t.size - 1
    first, last = curve.t_range
    start = curve.position(np.array([first]))
    after = int(np.searchsorted(loop.t[:size], last))  # the first voxel past the end of the range
    around = np.arange(after - NEAR_START, after + NEAR_START)
    offset = np.abs(loop.voxels[:, around % size] + 0.5 - start)
    holds = (loop.voxels[:, around % size] == np.floor(start)).all(axis=0)
    begin = int(around[np.argmin((offset * offset).sum(axis=0) - 3.0 * holds)])
    rolled = loop.take(np.arange(begin, begin + size) % size)
    t = np.where(rolled.t >= last, rolled.t - (last - first), rolled.t)
    t[: max(after - begin, 0)] = first
    t = np.clip(np.maximum.accumulate(t), first, last)
    return VoxelEvents(rolled.piece, t, rolled.voxels, rolled.heading)


def within_range(events: VoxelEvents, curve: Curve) -> VoxelEvents:
    """Return the events of a curve, with parameters that do not go on past its range, in order."""
    first, last = curve.t_range
    past = events.t > last
    if not past.any():
        return events
    t = np.where(past, events.t - (last - first), events.t)
    order = np.argsort(t, kind="stable")
    rolled = events.take(order)
    return VoxelEvents(rolled.piece, t[order], rolled.voxels, rolled.heading)

"""Grid-plane intersection digitisation of curves.

The method of Klette and Rosenfeld, *Digital Geometry* (2004), sections 2.3.5 and 11.1.1: a curve
is drawn with the voxel centres nearest to where it crosses the mid-planes x_a = i + 1/2, the
planes through the voxel centres. Why this holds for any continuous curve:

Mid-planes cut space into dual cells, unit cubes with a voxel centre at each of the 8 corners. A
crossing lies on a face of such a cell and is given the nearest of the face's corners, at most
sqrt(1/2) away. Between two consecutive crossings the curve stays in one closed cell, so that
their voxels are two of its corners: equal or 26-adjacent.

Crossings of all planes yield more voxels than needed. Where one axis dominates, its planes alone
will do, and of a face's corners the one nearest to the *tangent* at the crossing is better than the
one nearest to the point. Where either tears the sequence, it is reverted.

The result are connected events; `thinning` removes those that are not needed.
"""

from __future__ import annotations

import numpy as np

from voxdisplay.compute.array_types import Floats, Ints
from voxdisplay.compute.kernel_backend import with_kernel
from voxdisplay.voxelization.adaptive_sampling import limit_chords
from voxdisplay.voxelization.curve_batch import CurveBatch, Samples
from voxdisplay.voxelization.index_ranges import distinct, insert_columns
from voxdisplay.voxelization.plane_crossings import TIE_TOLERANCE, Crossings
from voxdisplay.voxelization.root_finding import find_roots
from voxdisplay.voxelization.voxel_events import NO_HEADING, VoxelEvents, Voxels, adjacent

# Longest steps, in voxels, between which all crossings are searched for where the sequence has a
# gap. Below 1 a step passes at most one plane of an axis; each further try is finer.
STEP_LIMITS = (0.7, 0.35, 0.17, 0.08)
# Gains this near to each other, in square voxels, are the same: which crossing comes first does not
# count.
SAME_GAIN = 1e-9
# Where curves are sampled at first between two such events: so closely that hardly a crossing
# needs a second guess.
EIGHTHS = np.linspace(0.0, 1.0, 9)


@np.errstate(under="ignore")
def trace_curves(batch: CurveBatch, crossings: Crossings, samples: Samples) -> VoxelEvents:
    """Return the connected voxel events of curves.

    Parameters
    ----------
    batch : CurveBatch
        The curves.
    crossings : Crossings
        Those of dominant planes.
    samples : Samples
        Points along the curves, in connected pieces.

    Returns
    -------
    Events
        For every piece: the voxel of its first point, voxels of crossings, the voxel of its last
        point. Consecutive ones are 26-adjacent or equal. All but the ends of a piece are within
        0.7072 of the curve, those within 0.8661.

    """
    events = choose_corners(crossings, samples)
    return _bridge_gaps(batch, events, samples.curve)


@np.errstate(under="ignore")
def trace_all_planes(batch: CurveBatch, samples: Samples) -> VoxelEvents:
    """Return the events of all mid-planes that curves cross: as `trace_curves`, but slower.

    Where a curve oscillates across its own direction, the dominant axis hides the others.
    """
    samples = limit_chords(batch, samples, STEP_LIMITS[0])
    piece, t, voxels = _all_crossings(batch, samples)
    inner = VoxelEvents(piece.astype(np.int32), t, voxels, np.full(t.size, NO_HEADING))
    crossings = Crossings(inner, voxels, np.full(t.size, np.inf))
    return _bridge_gaps(batch, _with_ends(crossings, samples).events, samples.curve)


def _with_ends(crossings: Crossings, samples: Samples) -> Crossings:
    """Return crossings with the voxels of each piece's first and last point around them."""
    inner, bounds = crossings.events, samples.bounds
    ends = bounds.repeat(2)[1:-1]
    ends[1::2] -= 1
    piece = samples.piece[ends].astype(np.int32)
    around = inner.piece.searchsorted(np.arange(bounds.size))
    at = around.repeat(2)[1:-1]

    voxels = np.floor(samples.points.take(ends, axis=1)).astype(np.int32)
    heading, gain = np.full(ends.size, NO_HEADING), np.full(ends.size, np.inf)
    *events, better, gain = insert_columns(
        at,
        (inner.piece, inner.t, inner.voxels, inner.heading, crossings.better, crossings.gain),
        (piece, samples.t[ends], voxels, heading, voxels, gain),
    )
    return Crossings(VoxelEvents(*events), better, gain)


@with_kernel
def choose_corners(crossings: Crossings, samples: Samples) -> VoxelEvents:
    """Return events at the better corners where they stay adjacent, with the ends of pieces."""
    crossings = _with_ends(crossings, samples)
    events, better, gain = crossings.events, crossings.better, crossings.gain
    nearest = events.voxels
    gaps = events.gaps()
    gain[gaps] = gain[gaps + 1] = np.inf  # what bridges a gap counts on the nearest corners
    voxels = np.where(np.isfinite(gain), better, nearest)
    bridged = np.zeros(events.t.size + 1, dtype=bool)
    bridged[gaps] = True
    torn = events.with_voxels(voxels).gaps()
    while (torn := torn[~bridged[torn]]).size:
        # Of two that fall apart, the one that gains less goes back: at least one has moved.
        one, other = gain[torn], gain[torn + 1]
        back = np.concatenate((torn[one <= other + SAME_GAIN], torn[other <= one + SAME_GAIN] + 1))
        back = distinct(back)
        gain[back] = np.inf
        voxels[:, back] = nearest[:, back]
        recheck = distinct(np.concatenate((back - 1, back)))
        recheck = recheck[(recheck >= 0) & (recheck < events.t.size - 1)]
        recheck = recheck[events.piece[recheck] == events.piece[recheck + 1]]
        torn = recheck[~adjacent(voxels[:, recheck], voxels[:, recheck + 1])]
    return events.with_voxels(voxels)


def _bridge_gaps(batch: CurveBatch, events: VoxelEvents, curve: Ints) -> VoxelEvents:
    """Insert the crossings of all planes where consecutive voxels are not adjacent."""
    for longest in STEP_LIMITS:
        gaps = events.gaps()
        if not gaps.size:
            return events
        samples = _samples_between(batch, events, gaps, curve, longest)
        gap, t, voxels = _all_crossings(batch, samples)
        events = _insert_voxels(events, gaps, gap, t, voxels)
    gaps = events.gaps()
    if gaps.size:
        # Rough down to the resolution of t: draw with the voxels that hold the samples.
        samples = _samples_between(batch, events, gaps, curve, STEP_LIMITS[-1])
        voxels = np.floor(samples.points).astype(np.int32)
        events = _insert_voxels(events, gaps, samples.piece, samples.t, voxels)
    return events


def _samples_between(
    batch: CurveBatch, events: VoxelEvents, gaps: Ints, curve: Ints, longest: float
) -> Samples:
    """Return samples from event k to k + 1 for each k in ``gaps``; a piece is one gap."""
    begin, end = events.t[gaps, None], events.t[gaps + 1, None]
    t = ((1 - EIGHTHS) * begin + EIGHTHS * end).ravel()
    gap = np.arange(gaps.size).repeat(EIGHTHS.size)
    of_gap = curve[events.piece[gaps]]
    points = batch.evaluate(of_gap[gap], t)
    return limit_chords(batch, Samples(gap, t, points, of_gap), longest)


def _all_crossings(batch: CurveBatch, samples: Samples) -> tuple[Ints, Floats, Voxels]:
    """Return the crossings of all mid-planes, in order: piece, t and nearest voxel."""
    cells = np.floor(samples.points - 0.5)
    passed = np.abs(cells[:, 1:] - cells[:, :-1]) == 1
    step, axis = (passed & samples.joined).T.nonzero()
    at = axis * samples.t.size + step  # of flat rows
    level = np.maximum(cells.take(at), cells.take(at + 1)) + 0.5
    piece = samples.piece[step]
    bracket = samples.t[step], samples.t[step + 1]
    ends = samples.points.take(at) - level, samples.points.take(at + 1) - level
    t, points, found = find_roots(batch, samples.curve[piece], axis, level, bracket, ends)
    voxels = np.floor(points + TIE_TOLERANCE)
    voxels[axis, np.arange(axis.size)] = level - 0.5
    order = np.lexsort((t, piece))
    order = order[found[order]]
    return piece[order], t[order], voxels.take(order, axis=1).astype(np.int32)


def _insert_voxels(
    events: VoxelEvents, gaps: Ints, gap: Ints, t: Floats, voxels: Voxels
) -> VoxelEvents:
    """Insert voxels into gaps; ``gap`` is the index of the gap of each."""
    at = gaps[gap]
    other = VoxelEvents(events.piece[at], t, voxels, np.full(t.size, NO_HEADING))
    return events.insert(at + 1, other)

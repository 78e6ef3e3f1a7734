"""Corners of closed curves, whose voxels stay whatever thinning would save.

A closed curve is traced and thinned from its first point to its last, so that its first voxel holds
its first point. A polygon begins at one of its corners. If thinning cut the others, it would have
other voxels from each of them; so all corners are treated alike: a closed curve is split there
before it is traced, and joined again when it is thinned. This module must not know how voxels
are chosen or thinned.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Bools, Ints
from voxdisplay.voxelization.curve_batch import CurveBatch, Samples
from voxdisplay.voxelization.plane_crossings import Crossings
from voxdisplay.voxelization.thinning import TINY
from voxdisplay.voxelization.voxel_events import VoxelEvents

# Cosines of the angles by which a curve turns at least at a corner, 10 degrees, and at a sharp one,
# 40 degrees.
MAX_COSINE, SHARP_COSINE = 0.985, 0.77
# Corners and sharp ones are this far from the next ones, in voxels along the curve: the vertices of
# a polyline with many short segments are none.
MIN_SPACING, MIN_SHARP_SPACING = 8.0, 2.0


def split_at_corners(
    batch: CurveBatch, crossings: Crossings, samples: Samples, closed: Bools
) -> tuple[Crossings, Samples, NDArray[np.int32]]:
    """Return crossings and samples with closed curves split at their corners.

    Parameters
    ----------
    batch : CurveBatch
        The curves.
    crossings, samples
        Of all pieces.
    closed : (curves,) bool array
        Which are closed.

    Returns
    -------
    crossings, samples
        A corner's sample ends one piece and begins the next.
    whole : (pieces,) int32 array
        The piece that each is a part of.

    """
    corners = batch.corners(samples)
    if corners.size:
        corners = corners[_stays(samples, corners, closed)]
    if not corners.size:
        return crossings, samples, np.arange(samples.curve.size, dtype=np.int32)
    count = np.ones(samples.t.size, dtype=np.int64)
    count[corners] = 2
    twice = np.arange(count.size).repeat(count)
    later = np.zeros(twice.size, dtype=np.int64)  # corners of all curves up to each sample
    later[corners + np.arange(1, corners.size + 1)] = 1
    later = np.cumsum(later)
    whole = np.sort(np.concatenate((np.arange(samples.curve.size), samples.piece[corners])))
    split = Samples(
        samples.piece[twice] + later,
        samples.t[twice],
        samples.points.take(twice, axis=1),
        samples.curve[whole],
    )
    events = crossings.events
    order = samples.piece[corners] + 1j * samples.t[corners]
    here = events.piece + 1j * events.t
    after = np.searchsorted(order, here, side="right")
    apart = after == np.searchsorted(order, here)  # else the crossing is at the corner itself
    piece = (events.piece + after).astype(np.int32)
    crossings = Crossings(
        replace(events, piece=piece).take(apart),
        crossings.better[:, apart],
        crossings.gain[apart],
    )
    return crossings, split, whole.astype(np.int32)


def _stays(samples: Samples, corners: Ints, closed: Bools) -> Bools:
    """Return which corners of closed curves have a voxel that must stay."""
    piece = samples.piece[corners]
    curve = samples.curve[piece]
    stays = closed[curve] & (np.bincount(samples.curve, minlength=closed.size)[curve] == 1)
    here = samples.points.take(corners, axis=1)
    sides = [samples.points.take(corners + step, axis=1) - here for step in (-1, 1)]
    back, on = sides
    lengths = [np.sqrt((side * side).sum(axis=0)) for side in sides]
    cosine = -(back * on).sum(axis=0) / np.maximum(lengths[0] * lengths[1], TINY)
    stays &= cosine < MAX_COSINE

    turns = stays.nonzero()[0]
    bounds = samples.bounds
    first, last = bounds[piece[turns]], bounds[piece[turns] + 1] - 1
    at = corners[turns]
    step = np.abs(samples.points[:, 1:] - samples.points[:, :-1]).max(axis=0)
    along = np.zeros(samples.t.size)
    for low, high in dict.fromkeys(zip(first.tolist(), last.tolist(), strict=True)):
        # Piece by piece: a sum over all of them would round otherwise for each neighbour.
        np.cumsum(step[low:high], out=along[low + 1 : high + 1])
    before = np.maximum(np.append(-1, at[:-1]), first)
    after = np.minimum(np.append(at[1:], samples.t.size), last)
    near = np.minimum(along[at] - along[before], along[after] - along[at])
    near = near < np.where(cosine[turns] < SHARP_COSINE, MIN_SHARP_SPACING, MIN_SPACING)
    stays[turns[near]] = False
    return np.asarray(stays)


def join_at_corners(events: VoxelEvents, whole: NDArray[np.int32]) -> tuple[VoxelEvents, Ints]:
    """Return events of split pieces joined again.

    Parameters
    ----------
    events : VoxelEvents
        A part begins with the voxel that the part before it ends with.
    whole : (pieces,) int32 array
        The piece that each is a part of.

    Returns
    -------
    events : VoxelEvents
        Of whole pieces.
    corners : (k,) int64 array
        Indices of the events at which they were split.

    """
    piece = whole[events.piece]
    again = (events.piece[1:] != events.piece[:-1]) & (piece[1:] == piece[:-1])
    second = again.nonzero()[0] + 1
    if not second.size:
        return replace(events, piece=piece), second
    kept = np.ones(piece.size, dtype=bool)
    kept[second] = False
    corners = second - 1 - np.arange(second.size)
    return replace(events, piece=piece).take(kept), corners

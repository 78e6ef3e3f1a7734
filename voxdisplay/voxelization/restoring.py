"""Restoration of voxels that thinning removed but the proof needs.

Several shortcuts in a row, or one across the seam of a closed curve, may cut off a part of the
curve to which no remaining voxel is near. There the voxels before thinning are put back; they have
chords, but cover the curve. This module knows events and boxes; `certify` checks the result.
"""

from __future__ import annotations

import numpy as np

from voxdisplay.compute.array_types import Floats
from voxdisplay.voxelization.certify import COVERAGE, ROUNDING, box_distances
from voxdisplay.voxelization.thinning import drop_repeats
from voxdisplay.voxelization.voxel_events import VoxelEvents


def restore_coverage(
    thin: VoxelEvents,
    full: VoxelEvents,
    box_ends: tuple[Floats, Floats],
    boxes: tuple[Floats, Floats],
    *,
    closed: bool,
) -> VoxelEvents:
    """Return thinned events with voxels put back where boxes are too far from any.

    Parameters
    ----------
    thin, full : Events
        One piece, after thinning and before.
    box_ends, boxes
        As for `certify.certify`.
    closed : bool
        Whether the last voxel is to be followed by the first, which it repeats.

    """
    if thin.t.size < 2:
        return full
    centres = thin.voxels.astype(np.float64) + 0.5
    far = box_distances(box_ends, boxes, centres, thin.t, closed=False)
    bad = far > COVERAGE - ROUNDING
    middle = (box_ends[0][bad] + box_ends[1][bad]) / 2
    at = np.searchsorted(thin.t, middle)
    bare = np.zeros(thin.t.size - 1, dtype=bool)  # the steps of ``thin`` around those boxes
    for shift in (-2, -1, 0):
        bare[np.clip(at + shift, 0, bare.size - 1)] = True
    begin, end = thin.t[:-1][bare], thin.t[1:][bare]
    place = np.searchsorted(begin, full.t, side="right") - 1
    back = place >= 0
    back[back] = full.t[back] < end[place[back]]
    kept = ~np.append(bare, False)
    t = np.concatenate((thin.t[kept], full.t[back]))
    order = np.argsort(t, kind="stable")
    voxels = np.concatenate((thin.voxels[:, kept], full.voxels[:, back]), axis=1)[:, order]
    heading = np.concatenate((thin.heading[kept], full.heading[back]))[order]
    piece = np.full(t.size, thin.piece[0])
    whole = drop_repeats(VoxelEvents(piece, t[order], voxels, heading))
    if closed and whole.t.size > 1 and (whole.voxels[:, 0] == whole.voxels[:, -1]).all():
        return whole.take(np.arange(whole.t.size - 1))
    return whole

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
    uncovered_boxes = far > COVERAGE - ROUNDING
    middle = (box_ends[0][uncovered_boxes] + box_ends[1][uncovered_boxes]) / 2
    at = np.searchsorted(thin.t, middle)
    uncovered = np.zeros(thin.t.size - 1, dtype=bool)  # the steps of ``thin`` around those boxes
    for shift in (-2, -1, 0):
        uncovered[np.clip(at + shift, 0, uncovered.size - 1)] = True
    begin, end = thin.t[:-1][uncovered], thin.t[1:][uncovered]
    interval = np.searchsorted(begin, full.t, side="right") - 1
    restored = interval >= 0
    restored[restored] = full.t[restored] < end[interval[restored]]
    kept = ~np.append(uncovered, False)
    t = np.concatenate((thin.t[kept], full.t[restored]))
    order = np.argsort(t, kind="stable")
    voxels = np.concatenate((thin.voxels[:, kept], full.voxels[:, restored]), axis=1)[:, order]
    heading = np.concatenate((thin.heading[kept], full.heading[restored]))[order]
    piece = np.full(t.size, thin.piece[0])
    merged = drop_repeats(VoxelEvents(piece, t[order], voxels, heading))
    if closed and merged.t.size > 1 and (merged.voxels[:, 0] == merged.voxels[:, -1]).all():
        return merged.take(np.arange(merged.t.size - 1))
    return merged

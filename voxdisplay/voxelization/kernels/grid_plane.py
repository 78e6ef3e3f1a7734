"""Kernels of `grid_plane` and `voxel_events`: corners of grid planes, gaps between events.

They hold no state: several threads may run them at once.
"""

from __future__ import annotations

import numpy as np

from voxdisplay.compute.array_types import Floats, Ints
from voxdisplay.compute.kernel_backend import jit
from voxdisplay.voxelization.curve_batch import Samples
from voxdisplay.voxelization.grid_plane import SAME_GAIN
from voxdisplay.voxelization.kernels.contiguous import Bytes, Pieces, packed
from voxdisplay.voxelization.plane_crossings import Crossings
from voxdisplay.voxelization.voxel_events import VoxelEvents, Voxels

NO_HEADING = -1  # `voxel_events.NO_HEADING`


# As in `thinning`: the cache of a kernel would not notice a change of another file.
@jit
def _adjacent(voxels: Voxels, i: int, j: int) -> bool:
    return bool(  # without a branch between
        (abs(voxels[0, i] - voxels[0, j]) <= 1)
        & (abs(voxels[1, i] - voxels[1, j]) <= 1)
        & (abs(voxels[2, i] - voxels[2, j]) <= 1)
    )


@jit
def find_gaps(piece: Pieces, voxels: Voxels) -> Ints:
    """See `voxel_events.find_gaps`."""
    count = 0
    for k in range(piece.size - 1):
        count += (piece[k] == piece[k + 1]) & (not _adjacent(voxels, k, k + 1))
    found = np.empty(count, dtype=np.int64)
    if count:  # which is rare
        count = 0
        for k in range(piece.size - 1):
            if (piece[k] == piece[k + 1]) & (not _adjacent(voxels, k, k + 1)):
                found[count] = k
                count += 1
    return found


def choose_corners(crossings: Crossings, samples: Samples) -> VoxelEvents:
    """See `grid_plane.choose_corners`."""
    inner = crossings.events
    return VoxelEvents(
        *_choose_corners(
            inner.piece,
            inner.t,
            packed(inner.voxels),
            inner.heading,
            packed(crossings.better),
            crossings.gain,
            samples.t,
            packed(samples.points),
            samples.bounds,
            SAME_GAIN,
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
    sample_t: Floats,
    points: Floats,
    bounds: Ints,
    same_gain: float,
) -> tuple[Pieces, Floats, Voxels, Bytes]:
    pieces = bounds.size - 1
    size = inner_t.size + 2 * pieces
    piece, t = np.empty(size, dtype=np.int32), np.empty(size)
    nearest, voxels = np.empty((3, size), dtype=np.int32), np.empty((3, size), dtype=np.int32)
    heading, gain = np.empty(size, dtype=np.int8), np.empty(size)
    at = begin = 0
    for number in range(pieces):
        end = begin
        while end < inner_t.size and inner_piece[end] == number:
            end += 1
        stop = at + 1 + end - begin
        piece[at : stop + 1] = number
        t[at + 1 : stop], gain[at + 1 : stop] = inner_t[begin:end], inner_gain[begin:end]
        heading[at + 1 : stop] = inner_heading[begin:end]
        for row in range(3):
            nearest[row, at + 1 : stop] = inner_voxels[row, begin:end]
            voxels[row, at + 1 : stop] = inner_better[row, begin:end]
        for tip, knot in ((at, bounds[number]), (stop, bounds[number + 1] - 1)):
            t[tip], heading[tip], gain[tip] = sample_t[knot], NO_HEADING, np.inf
            for row in range(3):
                nearest[row, tip] = voxels[row, tip] = int(np.floor(points[row, knot]))
        at, begin = stop + 1, end

    bridged = np.zeros(size, dtype=np.bool_)
    for k in range(size):
        if k + 1 < size and piece[k] == piece[k + 1] and not _adjacent(nearest, k, k + 1):
            bridged[k] = True
            gain[k] = gain[k + 1] = np.inf
        if not np.isfinite(gain[k]):
            for row in range(3):
                voxels[row, k] = nearest[row, k]
    apart = find_gaps(piece, voxels)
    while apart.size:
        back = np.empty(2 * apart.size, dtype=np.int64)
        count = 0
        for k in apart:
            if not bridged[k]:
                if gain[k] <= gain[k + 1] + same_gain:
                    back[count] = k
                    count += 1
                if gain[k + 1] <= gain[k] + same_gain:
                    back[count] = k + 1
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
                    and not _adjacent(voxels, step, step + 1)
                ):
                    look[fresh] = step
                    fresh += 1
        apart = look[:fresh]
    return piece, t, voxels, heading

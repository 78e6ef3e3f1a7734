"""Independent measurement of voxel lists: gaps, contacts, distances from a curve, coverage.

Any (N, 3) array will do. This module must not know how voxels are chosen and shares no code with
the methods it judges. Here are the figures of the voxels alone, the others in `curve_distance`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Bools, Ints
from voxdisplay.errors import CurveError
from voxdisplay.voxelization.curve_distance import coverage, distances
from voxdisplay.voxelization.index_ranges import expand_ranges
from voxdisplay.voxelization.spatial_hash import COLUMNS, SpatialHash

__all__ = ["contacts", "count_contacts", "coverage", "distances", "gaps", "neighbour_violations"]

Voxels = NDArray[np.integer]

# No more pairs of voxels than this are listed.
MAX_CONTACTS = 20_000_000


def gaps(voxels: Voxels, *, closed: bool = False, starts: Voxels | None = None) -> Ints:
    """Return where consecutive voxels of a sequence are not adjacent.

    Parameters
    ----------
    voxels : (N, 3) integer array
        The sequence.
    closed : bool
        Whether the last voxel is followed by the first.
    starts : (k,) integer array, optional
        Where its pieces begin: nothing is joined there.

    Returns
    -------
    (g,) int64 array
        The i for which voxels i and i + 1 (N - 1 and 0) are neither 26-adjacent nor equal.

    """
    return np.flatnonzero(_joins_next(len(voxels), closed, starts) & ~_adjacent_to_next(voxels))


def contacts(voxels: Voxels, *, closed: bool = False) -> Ints:
    """Return the pairs of voxels at which a sequence touches itself.

    Parameters
    ----------
    voxels : (N, 3) integer array
        The sequence.
    closed : bool
        Whether the last voxel is followed by the first.

    Returns
    -------
    (c, 2) int64 array
        All i < j of 26-adjacent or equal voxels with j - i > 1, cyclically if closed; ascending.

    Raises
    ------
    CurveError
        If they are more than `MAX_CONTACTS`.

    """
    count = count_contacts(voxels, closed=closed)
    if count > MAX_CONTACTS:
        raise CurveError(
            f"the sequence touches itself at {count} pairs of voxels, and {MAX_CONTACTS} is the "
            "most that are listed",
            hint="the report counts them; or list those of a shorter range of t",
        )
    pairs = _adjacent_pairs(voxels)
    distance = pairs[:, 1] - pairs[:, 0]
    far = distance > 1
    if closed:
        far &= distance < len(voxels) - 1
    pairs = pairs[far]
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def count_contacts(voxels: Voxels, *, closed: bool = False) -> int:
    """Return the number of pairs that `contacts` would list."""
    total = 0
    cells = SpatialHash(voxels.T)
    for offset in COLUMNS[:5]:
        low, high = _later(cells, voxels, offset)
        total += int((high - low).sum())
    follow = _adjacent_to_next(voxels)
    if not closed or len(voxels) < 3:
        follow = follow[:-1]
    return total - int(np.count_nonzero(follow))


def neighbour_violations(
    voxels: Voxels, *, closed: bool = False, starts: Voxels | None = None
) -> Ints:
    """Return the voxels that break the two-neighbour rule.

    Parameters
    ----------
    voxels, closed, starts
        As for `gaps`.

    Returns
    -------
    (b,) int64 array
        Indices of the voxels which do not have exactly two 26-neighbours in the sequence (the
        ends of open pieces: one, a piece of one voxel: none). Every visit of a voxel counts.

    """
    size = len(voxels)
    joint = _joins_next(size, closed, starts)
    expected = joint.astype(np.int64) + np.roll(joint, 1)
    if closed and size == 2:
        expected[:] = 1
    pairs = _adjacent_pairs(voxels)
    return np.flatnonzero(np.bincount(pairs.reshape(-1), minlength=size) != expected)


def _joins_next(size: int, closed: bool, starts: Voxels | None) -> Bools:
    """Return after which voxels, (N,), the next one must follow: the first after the last."""
    joint = np.ones(size, dtype=bool)
    if size:
        joint[-1] = closed and size > 1
    if starts is not None:
        inner = np.asarray(starts, dtype=np.int64)
        joint[inner[inner > 0] - 1] = False
    return joint


def _adjacent_to_next(voxels: Voxels) -> Bools:
    """Return which voxels are adjacent to the next one, the last to the first."""
    wide = voxels.astype(np.int64)
    return np.asarray((np.abs(np.roll(wide, -1, axis=0) - wide) <= 1).all(axis=1))


def _adjacent_pairs(voxels: Voxels) -> Ints:
    """Return all pairs i < j of 26-adjacent or equal voxels, (c, 2)."""
    cells = SpatialHash(voxels.T)
    found = []
    for offset in COLUMNS[:5]:
        low, high = _later(cells, voxels, offset)
        count = high - low
        one = np.repeat(cells.order, count)
        found.append(np.stack((one, cells.order[expand_ranges(low, count)]), axis=1))
    return np.sort(np.concatenate(found), axis=1)


def _later(cells: SpatialHash, voxels: Voxels, offset: tuple[int, int]) -> tuple[Ints, Ints]:
    """Return the neighbours in a column; in a voxel's own column those sorted after it."""
    low, high = cells.column_ranges(voxels[cells.order].T, offset)
    if offset == (0, 0):
        low = np.arange(1, len(voxels) + 1)
    return low, high

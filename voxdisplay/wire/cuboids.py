"""Greedy merging of cells to cuboids: to rows, equal rows to layers, equal layers to stacks.

Cells are voxels or bricks. Must not know ops.
"""

from __future__ import annotations

import numpy as np

from voxdisplay.wire.op_encoding import Ints


def merge_cuboids(
    cells: Ints, group: Ints, high: Ints | None = None
) -> tuple[Ints, Ints, Ints, Ints]:
    """Merge cells of the same group to cuboids, greedily along x, then y, then z.

    Parameters
    ----------
    cells : (n, 3) integer array
        Each once in its group.
    group : (n,) integer array
    high : (n, 3) integer array, optional
        For cuboids instead of cells: the last cell of each, `cells` being the first.

    Returns
    -------
    low, high : (m, 3) int64 arrays
        The first and the last cell of each cuboid.
    count : (m,) int64 array
        Number of cells in each cuboid.
    owner : (n,) int64 array
        Cuboid of each cell.

    """
    low = np.asarray(cells, dtype=np.int64)
    high = low.copy() if high is None else np.asarray(high, dtype=np.int64)
    of = np.asarray(group, dtype=np.int64)
    owner = np.arange(len(low))
    for axis in range(3):
        others = [a for a in range(3) if a != axis]
        # Sorted so that cells with equal extent on the other axes follow each other along this.
        keys = [low[:, axis], *(side[:, a] for a in others for side in (low, high)), of]
        order = np.lexsort(keys)
        alike = np.ones(len(order) - 1, dtype=np.bool_)
        for key in keys[1:]:
            alike &= key[order[1:]] == key[order[:-1]]
        touches = low[order[1:], axis] == high[order[:-1], axis] + 1
        new = np.concatenate(([0], np.cumsum(~(alike & touches))))
        first = np.flatnonzero(np.concatenate(([True], ~(alike & touches))))
        last = np.append(first[1:], len(order)) - 1
        moved = np.empty(len(order), dtype=np.int64)
        moved[order] = new
        owner = moved[owner]
        low, high, of = low[order[first]], high[order[last]], of[order[first]]
    return low, high, np.bincount(owner, minlength=len(low)), owner

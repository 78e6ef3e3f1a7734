"""Parts of voxelised items: stretches of their voxels, in drawing order.

Must not know colours or files.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay import voxelization

if TYPE_CHECKING:
    from collections.abc import Iterable

    from voxdisplay.scene.item import PartSpan
    from voxdisplay.voxelization import Sequence, VoxelSet


def shown_stretches(counts: list[int], spans: Iterable[PartSpan]) -> list[tuple[int, int]]:
    """Return which voxels of each item are shown: [begin, end).

    Parameters
    ----------
    counts : list of int
        Numbers of voxels of the items.
    spans : iterable of PartSpan
        Inner ones first: the part of a group is a part of what its objects show.

    """
    stretches = [(0, count) for count in counts]
    for first, end, begin, stop in spans:
        total = sum(high - low for low, high in stretches[first:end])
        low, high = (round(min(max(share, 0.0), 1.0) * total) for share in (begin, stop))
        before = 0
        for i in range(first, end):
            begin_i, end_i = stretches[i]
            count = end_i - begin_i
            here = (min(max(edge - before, 0), count) for edge in (low, max(low, high)))
            from_, to = here
            stretches[i] = begin_i + from_, begin_i + to
            before += count
    return stretches


def stretch_of(voxels: Sequence | VoxelSet, begin: int, end: int) -> Sequence | VoxelSet:
    """Return the voxels [begin, end) of a sequence or set; itself if these are all."""
    if (begin, end) == (0, len(voxels)):
        return voxels
    if isinstance(voxels, voxelization.VoxelSet):
        return replace(
            voxels,
            index=voxels.index[begin:end],
            colors=None if voxels.colors is None else voxels.colors[begin:end],
            parameters={name: each[begin:end] for name, each in voxels.parameters.items()},
        )
    inside = voxels.starts[(voxels.starts > begin) & (voxels.starts < end)] - begin
    return replace(
        voxels,
        voxels=voxels.voxels[begin:end],
        closed=False,
        starts=np.concatenate((np.zeros(1, dtype=np.int64), inside)),
        t=voxels.t[begin:end],
    )

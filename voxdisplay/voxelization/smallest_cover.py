"""Size of the smallest set of voxels that no 6-connected path can avoid.

Lines between the centres of 6-neighbours that a surface crosses each need an end in the set: a
vertex cover. The graph of these lines is bipartite, as voxels alternate like a chessboard's fields,
so that the smallest cover is as large as the largest matching (Koenig 1931), which is found by
shortest augmenting paths (Hopcroft and Karp 1973). Must not know surfaces.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from voxdisplay.compute.array_types import Ints

MAX_LINES = 1 << 18
"""So many lines take about two seconds."""
_NONE = -1


def smallest_cover(even: Ints, odd: Ints) -> int | None:
    """Return the size of the smallest vertex cover of a bipartite graph.

    Parameters
    ----------
    even, odd : (n,) int64 array
        Numbers of the ends of each edge, on either side.

    Returns
    -------
    int or None
        None if there are more than `MAX_LINES` edges.

    """
    if len(even) > MAX_LINES:
        return None
    _, left = np.unique(even, return_inverse=True)
    _, right = np.unique(odd, return_inverse=True)
    order = np.argsort(left, kind="stable")
    bounds = np.searchsorted(left[order], np.arange(int(left.max(initial=-1)) + 2)).tolist()
    ends = right[order].tolist()
    others = [ends[begin:stop] for begin, stop in itertools.pairwise(bounds)]
    partner = [_NONE] * len(others)
    mate = [_NONE] * (int(right.max(initial=-1)) + 1)
    for one, choices in enumerate(others):  # any matching to begin with
        free = next((other for other in choices if mate[other] == _NONE), _NONE)
        if free != _NONE:
            partner[one], mate[free] = free, one
    while _augment(others, partner, mate):
        pass
    return len(others) - partner.count(_NONE)


def _augment(others: list[list[int]], partner: list[int], mate: list[int]) -> bool:
    """Augment a matching along disjoint shortest paths; return whether there was one."""
    depth = [0 if each == _NONE else _NONE for each in partner]
    layer = [one for one, each in enumerate(depth) if each == 0]
    found = False
    while layer and not found:
        following = []
        for one in layer:
            for other in others[one]:
                after = mate[other]
                if after == _NONE:
                    found = True
                elif depth[after] == _NONE:
                    depth[after] = depth[one] + 1
                    following.append(after)
        layer = following
    if found:
        remaining = [iter(choices) for choices in others]
        for one, each in enumerate(partner):
            if each == _NONE:
                _follow(one, remaining, depth, partner, mate)
    return found


def _follow(
    start: int,
    remaining: list[Iterator[int]],
    depth: list[int],
    partner: list[int],
    mate: list[int],
) -> None:
    """Augment a matching along a path through ascending layers, if there is one."""
    path = [start]
    chosen: list[int] = []
    while path:
        other = next(remaining[path[-1]], _NONE)
        if other == _NONE:
            path.pop()
            if chosen:
                chosen.pop()
        elif mate[other] == _NONE:
            for one, end in zip(path, [*chosen, other], strict=True):
                partner[one], mate[end] = end, one
            return
        elif depth[mate[other]] == depth[path[-1]] + 1:
            chosen.append(other)
            path.append(mate[other])

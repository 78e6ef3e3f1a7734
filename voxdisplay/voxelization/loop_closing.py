"""Closing of small loops at their first voxel.

A closed curve without a long straight run (see `seams`) is thinned as if it were open, from the
voxel of its first point S to the same voxel. Often the voxels before and after it are adjacent, a
chord. Then the loop is led through S by a small detour, found by exhaustive search. All of this is
local to S and works on one curve, given as points: this module must not know curves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Floats
from voxdisplay.voxelization.thinning import MAX_UNCOVERED, WINDOW, furthest_shortcuts
from voxdisplay.voxelization.voxel_events import NO_HEADING, VoxelEvents, adjacent

Voxel = tuple[int, int, int]

# How far from the seam voxels may be replaced, and by how many on each side.
MAX_REPLACED = 7
MAX_DETOUR = 3
# Samples per voxel of the sequence, to tell how far voxels are from the curve.
SAMPLES_PER_VOXEL = 16


def close_loop(loop: VoxelEvents, position: Callable[[Floats], Floats], end: float) -> VoxelEvents:
    """Return a closed sequence made of one that returns to its first voxel.

    Parameters
    ----------
    loop : VoxelEvents
        One thinned piece, first and last voxel equal or adjacent.
    position : callable
        (n,) parameters -> (3, n) points of the curve.
    end : float
        The last parameter of the curve.

    Returns
    -------
    Events
        The first voxel is the same; the last is a neighbour of it. No two voxels near the seam
        are neighbours but consecutive ones, unless that is impossible with voxels near the
        curve that cover it.

    """
    size = loop.t.size
    if size > 1 and (loop.voxels[:, 0] == loop.voxels[:, -1]).all():
        size -= 1
        loop = loop.take(np.arange(size))
    if size < 5 or not _touches_at_seam(loop.voxels):
        return loop
    ring = _cut_across(loop)
    return _reroute(ring, loop, position, end) or loop


def _touches_at_seam(voxels: NDArray[np.int32]) -> bool:
    """Return whether a closed sequence, (3, n), has a chord across its seam."""
    size = voxels.shape[1]
    reach = min(WINDOW - 1, size - 1)
    around = np.arange(-reach, reach + 1)
    ring = voxels[:, around % size]
    touch = adjacent(ring[:, :, None], ring[:, None, :])
    before, after = np.meshgrid(around, around, indexing="ij")
    # Cyclic distance from 2 to WINDOW: more than a step, and no chord that the window let be.
    apart = after - before
    across = (before < 0) & (after >= 0) | (before <= 0) & (after > 0)
    across &= (apart > 1) & (apart <= min(WINDOW, size - 2))
    return bool((touch & across).any())


def _cut_across(loop: VoxelEvents) -> VoxelEvents:
    """Take the first shortcut across the seam. It skips the first voxel."""
    size = loop.t.size
    reach = min(WINDOW, (size - 1) // 2)
    around = np.arange(-reach, reach + 1) % size
    leap = furthest_shortcuts(loop.voxels[:, around], np.zeros(around.size, dtype=np.int64))
    over = np.arange(reach) + leap[:reach] > reach
    if not over.any():
        return loop
    start = int(np.argmax(over))
    skipped = around[start + 1 : start + leap[start]]
    return loop.take(np.delete(np.arange(size), skipped))


def _reroute(
    ring: VoxelEvents, loop: VoxelEvents, position: Callable[[Floats], Floats], end: float
) -> VoxelEvents | None:
    """Return a ring led through the first voxel of ``loop`` without chords; None if impossible."""
    size = ring.t.size
    if size == loop.t.size:
        return None  # a chord, but what is between its ends goes its own way
    reach = min(MAX_REPLACED, size // 2 - 1)
    if reach < 1:
        return None
    start = _as_voxels(loop.voxels[:, :1])[0]
    after = _as_voxels(ring.voxels[:, :reach])
    before = _as_voxels(ring.voxels[:, : -reach - 1 : -1])
    t_before = np.linspace(ring.t[-reach], end, SAMPLES_PER_VOXEL * reach)
    t_after = np.linspace(loop.t[0], ring.t[reach - 1], SAMPLES_PER_VOXEL * reach)
    points = position(np.concatenate((t_before, t_after)))
    square = _square_distances(points, {*after, *before})
    detour = _best_detour(start, after, before, points, square)
    if detour is None:
        return None
    out, j, back, i = detour
    kept = ring.take(np.arange(j, size - i))
    lead = np.array([start, *out], dtype=np.int32).T
    tail = np.array(back[::-1], dtype=np.int32).reshape(-1, 3).T
    t = np.concatenate(
        (
            np.linspace(loop.t[0], kept.t[0], len(out) + 1, endpoint=False),
            kept.t,
            np.linspace(end, kept.t[-1], len(back), endpoint=False)[::-1],
        )
    )
    voxels = np.concatenate((lead, kept.voxels, tail), axis=1)
    return VoxelEvents(np.full(t.size, loop.piece[0]), t, voxels, np.full(t.size, NO_HEADING))


def _best_detour(
    start: Voxel,
    after: list[Voxel],
    before: list[Voxel],
    points: Floats,
    square: dict[Voxel, float],
) -> tuple[list[Voxel], int, list[Voxel], int] | None:
    """Return the paths from ``start`` to both sides of a ring that lie nearest to the curve.

    Returns
    -------
    out, j, back, i
        Over the voxels ``out`` to ``after[j]``, over ``back`` to ``before[i]``.

    """
    candidates = [voxel for voxel, far in square.items() if far <= 0.5]
    best, least = None, np.inf
    for (out, j), (back, i) in product(
        list(_chordless_paths(start, after, candidates)),
        list(_chordless_paths(start, before, candidates)),
    ):
        touching = (
            any(_adjacent(a, b) for a in [*out, after[j]] for b in [*back, before[i]])
            or any(_adjacent(a, b) for a in out for b in before[i:])
            or any(_adjacent(a, b) for a in back for b in after[j:])
        )
        voxels = [*out, *back, *after[j:], *before[i:]]
        cost = sum(square[voxel] for voxel in voxels)
        if not touching and cost < least and _covered(points, [start, *voxels]):
            best, least = (out, j, back, i), cost
    return best


def _chordless_paths(
    start: Voxel, side: list[Voxel], candidates: list[Voxel]
) -> Iterator[tuple[list[Voxel], int]]:
    """Yield chordless paths from ``start`` over at most ``MAX_DETOUR`` voxels to a ring's side.

    Yields
    ------
    path : list of voxels
        Those in between, none of them on the rest of the side.
    index : int
        The voxel of ``side`` at which the path arrives.

    """

    def extend(path: list[Voxel]) -> Iterator[tuple[list[Voxel], int]]:
        tip = path[-1]
        touched = [j for j, voxel in enumerate(side) if _adjacent(tip, voxel)]
        if touched:
            # The furthest it touches is where it must join: any other would leave a chord.
            join = touched[-1]
            if not any(
                _adjacent(voxel, side[k]) for voxel in path[:-1] for k in range(join, len(side))
            ):
                yield path[1:], join
        if len(path) > MAX_DETOUR:
            return
        for voxel in candidates:
            free = voxel != tip and not any(_adjacent(other, voxel) for other in path[:-1])
            if free and _adjacent(tip, voxel):
                yield from extend([*path, voxel])

    yield from extend([start])


def _square_distances(points: Floats, known: set[Voxel]) -> dict[Voxel, float]:
    """Return the squared distances of the voxels around points, (3, n), in a fixed order.

    At most a little too large, for the points stand for a curve.
    """
    held = set(_as_voxels(np.floor(points).astype(np.int64)))
    steps = list(product((-1, 0, 1), repeat=3))
    voxels = sorted({(x + i, y + j, z + k) for x, y, z in held for i, j, k in steps} | known)
    centres = np.array(voxels, dtype=float).T + 0.5
    apart = centres[:, :, None] - points[:, None, :]
    return dict(zip(voxels, (apart * apart).sum(axis=0).min(axis=1).tolist(), strict=True))


def _covered(points: Floats, voxels: list[Voxel]) -> bool:
    """Return whether all points, (3, n), are within ``MAX_UNCOVERED`` of a voxel."""
    centres = np.array(voxels, dtype=float).T + 0.5
    apart = centres[:, :, None] - points[:, None, :]
    return bool(((apart * apart).sum(axis=0).min(axis=0) <= MAX_UNCOVERED * MAX_UNCOVERED).all())


def _adjacent(a: Voxel, b: Voxel) -> bool:
    return abs(a[0] - b[0]) <= 1 and abs(a[1] - b[1]) <= 1 and abs(a[2] - b[2]) <= 1


def _as_voxels(rows: NDArray[np.integer]) -> list[Voxel]:
    return [(x, y, z) for x, y, z in rows.T.tolist()]

"""Triangulation of simple polygons by ear clipping, exactly on a lattice."""

from __future__ import annotations

import numpy as np

from voxdisplay.compute.array_types import Ints


def clip_ears(points: Ints) -> Ints | None:
    """Return triangles that make up a polygon, or None if its sides cross each other.

    Parameters
    ----------
    points : (n, 2) int64 array
        The vertices in order, either way round; below 2^30.

    Returns
    -------
    (k, 3) int64 array
        Indices of vertices, in their order around the polygon; k is n - 2 or, where vertices are on
        straight lines, less.

    """
    x, y = points.T
    twice = int(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y, dtype=object))
    if not twice:
        return None
    ring = list(range(len(points)))
    if twice < 0:
        ring.reverse()
    triangles = []
    at, passed = 0, 0
    while len(ring) > 2:
        if passed == len(ring):
            return None
        at %= len(ring)
        a, b, c = ring[at - 1], ring[at], ring[(at + 1) % len(ring)]
        turn = _turn(points, a, b, np.array([c]))[0]
        if turn == 0 or (turn > 0 and _is_ear(points, ring, (a, b, c))):
            if turn:
                triangles.append((a, b, c) if twice > 0 else (c, b, a))
            del ring[at]
            passed = 0
        else:
            at += 1
            passed += 1
    found = np.array(triangles, dtype=np.int64).reshape(-1, 3)
    p, q, r = (points[found[:, k]] for k in range(3))
    covered = (q - p)[:, 0] * (r - p)[:, 1] - (q - p)[:, 1] * (r - p)[:, 0]
    return found if int(np.sum(covered, dtype=object)) == twice else None


def _is_ear(points: Ints, ring: list[int], corners: tuple[int, int, int]) -> bool:
    """Return whether no other vertex is inside of a triangle or on it."""
    others = np.array(ring)
    a, b, c = corners
    inside = np.ones(len(others), dtype=bool)
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= _turn(points, start, end, others) >= 0
    for corner in corners:
        inside &= (points[others] != points[corner]).any(axis=1)
    return not inside.any()


def _turn(points: Ints, a: int, b: int, c: Ints) -> Ints:
    """Return twice the signed areas of triangles a, b and each of c."""
    (ax, ay), (bx, by) = points[a], points[b]
    x, y = points[c].T
    return np.asarray((bx - ax) * (y - ay) - (by - ay) * (x - ax))

"""Triangles of plane regions with outlines of any kind, by horizontal bands.

What has a winding number other than 0 is inside, so that outlines may overlap, as those of variable
fonts do. All vertices of a band's ends are vertices of both neighbours: the triangles conform, and
a prism of them is closed. Must not know what is outlined.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Floats, Ints

_GRID = 64
"""Parts of a unit to which coordinates are rounded."""
_MAX_PAIRS = 1 << 24

Span = tuple[int, int]
Point = tuple[int, int]


class Region(NamedTuple):
    """Triangles of a region, and its boundary.

    Attributes
    ----------
    points : (V, 2) float64 array
    triangles : (T, 3) int64 array
        Counter-clockwise.
    boundary : (B, 2) int64 array
        Start and end of each piece of it; the region is to the left.

    """

    points: Floats
    triangles: Ints
    boundary: Ints


def triangulate(outlines: list[Floats]) -> Region:
    """Return the region within closed outlines.

    Parameters
    ----------
    outlines : list of (n, 2) array
        Without the first point at the end again; coordinates are rounded to 1/64.

    """
    edges = _edges(outlines)
    bands = _Bands()
    levels = _levels(edges)
    for low, high in pairwise(levels.tolist()):
        for left, right in _spans(edges, low, high):
            bands.add(low, high, left, right)
    return bands.region()


def _edges(outlines: list[Floats]) -> Ints:
    """Return the edges that are not horizontal, (n, 5): x, y of both ends, and winding."""
    starts, ends = [], []
    for outline in outlines:
        points = np.rint(np.asarray(outline) * _GRID).astype(np.int64)
        if len(points) > 2:
            starts.append(points)
            ends.append(np.roll(points, -1, axis=0))
    if not starts:
        return np.empty((0, 5), dtype=np.int64)
    start, end = np.concatenate(starts), np.concatenate(ends)
    up = start[:, 1] < end[:, 1]
    low, high = np.where(up[:, None], start, end), np.where(up[:, None], end, start)
    edges = np.column_stack((low, high, np.where(up, 1, -1)))
    slanted: Ints = edges[edges[:, 1] != edges[:, 3]]
    return slanted


def _levels(edges: Ints) -> Ints:
    """Return the heights of all ends and crossings of edges, ascending."""
    found = [edges[:, 1], edges[:, 3]]
    if len(edges) ** 2 <= _MAX_PAIRS:
        found.append(_crossings(edges))
    levels: Ints = np.sort(np.concatenate(found))
    distinct: Ints = levels[np.diff(levels, prepend=-1 << 62) > 0]
    return distinct


def _crossings(edges: Ints) -> Ints:
    """Return the heights, rounded, at which edges cross."""
    x, y, x1, y1 = (edges[:, i].astype(np.float64) for i in range(4))
    dx, dy = x1 - x, y1 - y
    cross = dx[:, None] * dy - dy[:, None] * dx
    with np.errstate(divide="ignore", invalid="ignore"):
        along = ((x - x[:, None]) * dy - (y - y[:, None]) * dx) / cross
        height = y[:, None] + along * dy[:, None]
        inside = (along > 0) & (along < 1) & (height > y) & (height < y1)
    found: Ints = np.rint(height[inside & (cross != 0)]).astype(np.int64)
    return found


def _spans(edges: Ints, low: int, high: int) -> Iterator[tuple[Span, Span]]:
    """Yield the left and right edges of what is inside a band: x at its lower and upper end."""
    active = edges[(edges[:, 1] <= low) & (edges[:, 3] >= high)]
    if not len(active):
        return
    bottom, top = (_x_at(active, level) for level in (low, high))
    order = np.lexsort((top, bottom + top))
    # Crossings are rounded: edges that still cross within the band touch instead.
    bottom[order] = np.maximum.accumulate(bottom[order])
    top[order] = np.maximum.accumulate(top[order])
    winding = 0
    left: Span = (0, 0)
    for row in order:
        before, winding = winding, winding + int(active[row, 4])
        if not before:
            left = int(bottom[row]), int(top[row])
        elif not winding:
            yield left, (int(bottom[row]), int(top[row]))


def _x_at(edges: Ints, level: int) -> Ints:
    x, y, x1, y1 = (edges[:, i] for i in range(4))
    found: Ints = np.rint(x + (x1 - x) * ((level - y) / (y1 - y))).astype(np.int64)
    return found


class _Bands:
    """Trapezoids by their lower level, and what is filled on both sides of each level."""

    def __init__(self) -> None:
        self._trapezoids: list[tuple[int, int, Span, Span]] = []
        self._below: dict[int, list[Span]] = defaultdict(list)
        self._above: dict[int, list[Span]] = defaultdict(list)
        self._numbers: dict[Point, int] = {}

    def add(self, low: int, high: int, left: Span, right: Span) -> None:
        """Add a trapezoid."""
        self._trapezoids.append((low, high, left, right))
        self._above[low].append((left[0], right[0]))
        self._below[high].append((left[1], right[1]))

    def region(self) -> Region:
        """Return the triangles of all trapezoids."""
        xs = {
            level: np.unique(self._below.get(level, []) + self._above.get(level, []))
            for level in {*self._below, *self._above}
        }
        triangles: list[tuple[int, int, int]] = []
        boundary: list[tuple[int, int]] = []
        for low, high, left, right in self._trapezoids:
            bottom = self._row(xs[low], low, left[0], right[0])
            top = self._row(xs[high], high, left[1], right[1])
            triangles += _strip(bottom, top)
            boundary += [(top[0], bottom[0]), (bottom[-1], top[-1])]
        for level, row in xs.items():
            boundary += self._horizontal(level, row)
        points = np.array(list(self._numbers), dtype=np.float64).reshape(-1, 2) / _GRID
        edges = np.array(boundary, dtype=np.int64).reshape(-1, 2)
        faces = np.array(triangles, dtype=np.int64).reshape(-1, 3)
        return Region(points, faces, edges[edges[:, 0] != edges[:, 1]])

    def _row(self, xs: NDArray[np.int64], level: int, left: int, right: int) -> list[int]:
        """Return the numbers of a level's points from one to another."""
        start, end = np.searchsorted(xs, left), np.searchsorted(xs, right, "right")
        return [self._number((x, level)) for x in xs[start:end].tolist()]

    def _number(self, point: Point) -> int:
        return self._numbers.setdefault(point, len(self._numbers))

    def _horizontal(self, level: int, xs: NDArray[np.int64]) -> Iterator[tuple[int, int]]:
        """Yield the pieces of a level that have the region on one side alone."""
        below, above = (_covered(spans.get(level, []), xs) for spans in (self._below, self._above))
        for i in np.flatnonzero(below != above):
            ends = self._number((int(xs[i]), level)), self._number((int(xs[i + 1]), level))
            yield ends if above[i] else ends[::-1]


def _covered(spans: list[Span], xs: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which intervals between neighbours are in a span, (len(xs) - 1,)."""
    count = np.zeros(len(xs), dtype=np.int64)
    for left, right in spans:
        count[np.searchsorted(xs, left)] += 1
        count[np.searchsorted(xs, right)] -= 1
    return np.asarray(np.cumsum(count)[:-1] > 0)


def _strip(bottom: list[int], top: list[int]) -> Iterator[tuple[int, int, int]]:
    """Yield triangles between two rows of points, from left to right."""
    i = j = 0
    while i < len(bottom) - 1 or j < len(top) - 1:
        # By turns, in proportion to the points that each row has.
        if j == len(top) - 1 or (i < len(bottom) - 1 and i * len(top) <= j * len(bottom)):
            yield bottom[i], bottom[i + 1], top[j]
            i += 1
        else:
            yield bottom[i], top[j + 1], top[j]
            j += 1

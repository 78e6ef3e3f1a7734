"""Chains of balls: the geometry of tubes, as the union of balls whose centres lie on polylines.

Between two neighbouring centres the radius changes linearly, so that the part of a chain there is
the convex hull of two balls. Must not know curves or voxelisation.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from voxdisplay.bodies.geometry import Bounds, Geometry
from voxdisplay.compute.array_types import Floats, Ints

_LEAF = 4.0  # side of the smallest cells of points that share candidates, in voxels
_PAIRS = 1 << 19  # of points and parts at a time
_STEEPEST = 1.0 - 1e-12


class Nearest(NamedTuple):
    """The nearest balls of a chain to n points.

    Attributes
    ----------
    distance : (n,) float64 array
        From the ball's surface, negative inside, by the chain's metric.
    part : (n,) int64 array
        Index of the part, -1 if the chain has none.
    share : (n,) float64 array
        Where on the part the ball's centre is, 0 to 1.

    """

    distance: Floats
    part: Ints
    share: Floats


@dataclass(frozen=True, slots=True, eq=False)
class BallChain(Geometry):
    """The union of all balls {p : |metric @ (p - c)| <= r} with centres c on a polyline.

    Attributes
    ----------
    points : (n, 3) float64 array
        Corners of polylines, in voxels.
    radii : (n,) float64 array
        Radii at the corners, not negative.
    first : (m,) int64 array
        Corners that are joined with the next: the parts.
    metric : (3, 3) float64 array
        Invertible; the identity for balls that are round.
    values : mapping of str to (n,) float64 array
        Numbers at corners, such as t.
    wires : tuple of (k, 3) float64 arrays
        Polylines near which there must be voxels, however thin the chain is.

    """

    points: Floats
    radii: Floats
    first: Ints
    metric: Floats
    values: dict[str, Floats]
    wires: tuple[Floats, ...] = ()

    def transformed(self, matrix: Floats, offset: Floats) -> BallChain:
        """Return the chain of the points ``matrix @ p + offset``."""
        return replace(
            self,
            points=self.points @ matrix.T + offset,
            metric=self.metric @ np.linalg.inv(matrix),
            wires=tuple(wire @ matrix.T + offset for wire in self.wires),
        )

    @property
    def reach(self) -> Floats:
        """Half of the extent of a ball of radius 1 along x, y and z, (3,)."""
        return np.asarray(np.sqrt((np.linalg.inv(self.metric) ** 2).sum(axis=1)))

    def bounds(self) -> Bounds:
        """Return the bounding box; empty, low above high, without a part."""
        if not self.first.size:
            return np.full(3, np.inf), np.full(3, -np.inf)
        used = np.concatenate((self.first, self.first + 1))
        half = self.radii[used, None] * self.reach
        return (self.points[used] - half).min(axis=0), (self.points[used] + half).max(axis=0)

    def values_at(self, points: Floats) -> dict[str, Floats]:
        """Return the numbers at the nearest balls to points, (n, 3): (n,) each."""
        near = self.nearest(points)
        begin = self.first[near.part]
        return {
            name: np.asarray(of[begin] + near.share * (of[begin + 1] - of[begin]))
            for name, of in self.values.items()
        }

    def nearest(self, points: Floats) -> Nearest:
        """Return the nearest balls to points, (n, 3).

        Cells of points are halved; of each cell those parts are kept that may be the nearest to
        one of its points, as a distance changes by no more than the point moves.
        """
        n = len(points)
        found = Nearest(np.full(n, np.inf), np.full(n, -1), np.zeros(n))
        if not (n and self.first.size):
            return found
        parts = _Parts(self)
        at = points @ self.metric.T
        side = 2.0 ** np.ceil(np.log2(max(float(np.ptp(at, axis=0).max()), _LEAF)))
        order, starts = np.arange(n), np.zeros(1, dtype=np.int64)
        candidates = np.arange(self.first.size)
        counts = np.array([candidates.size])
        while True:
            ends = np.append(starts[1:], n)
            low = np.minimum.reduceat(at[order], starts, axis=0)
            high = np.maximum.reduceat(at[order], starts, axis=0)
            candidates, counts = _pruned(parts, low, high, candidates, counts)
            if side <= _LEAF:
                break
            side /= 2
            cell = np.repeat(np.arange(starts.size), ends - starts)
            octant = (at[order] >= ((low + high) / 2)[cell]) @ np.array([1, 2, 4])
            key = cell * 8 + octant
            again = np.argsort(key, kind="stable")
            order, key = order[again], key[again]
            starts = np.flatnonzero(np.append(True, key[1:] != key[:-1]))
            parent = key[starts] // 8
            begin = np.cumsum(counts) - counts
            candidates = candidates[_ranges(begin[parent], counts[parent])]
            counts = counts[parent]
        cell = np.repeat(np.arange(starts.size), np.diff(starts, append=n))
        for block in _blocks(counts[cell]):
            rows, own = order[block], cell[block]
            begin = (np.cumsum(counts) - counts)[own]
            part = candidates[_ranges(begin, counts[own])]
            value, share = parts.distance(np.repeat(at[rows], counts[own], axis=0), part)
            first = np.cumsum(counts[own]) - counts[own]
            least = np.minimum.reduceat(value, first)
            hit = np.flatnonzero(value == np.repeat(least, counts[own]))
            hit = hit[np.searchsorted(hit, first)]
            found.distance[rows], found.part[rows] = value[hit], part[hit]
            found.share[rows] = share[hit]
        return found


class _Parts:
    """Hulls of two balls each, in the space where balls are round."""

    def __init__(self, chain: BallChain) -> None:
        first = chain.first
        points = chain.points @ chain.metric.T
        self.begin, self.radius = points[first], chain.radii[first]
        along = points[first + 1] - self.begin
        self.length = np.sqrt((along * along).sum(axis=1))
        safe = np.where(self.length > 0, self.length, 1.0)
        self.axis = along / safe[:, None]
        self.slope = (self.radius - chain.radii[first + 1]) / safe
        slope = np.clip(self.slope, -_STEEPEST, _STEEPEST)
        self.lean = slope / np.sqrt(1 - slope**2)
        # Of two balls one of which holds the other, the larger one is all there is.
        self.begins = np.where(self.slope <= -1, self.length, 0.0)
        self.ends = np.where(self.slope >= 1, 0.0, self.length)

    def distance(self, at: Floats, part: Ints) -> tuple[Floats, Floats]:
        """Return the distances of n points from a part each, and the shares of the balls."""
        total, along = np.zeros(part.size), np.zeros(part.size)
        for k in range(3):
            d = at[:, k] - self.begin[part, k]
            total += d * d
            along += d * self.axis[part, k]
        across = np.sqrt(np.maximum(total - along * along, 0))
        length = self.length[part]
        # The foot of the normal of the hull, which leans by the change of the radius.
        foot = along - across * self.lean[part]
        foot = np.minimum(np.maximum(foot, self.begins[part]), self.ends[part])
        value = np.hypot(across, along - foot) - (self.radius[part] - foot * self.slope[part])
        return value, foot / np.where(length > 0, length, 1.0)


def _pruned(
    parts: _Parts, low: Floats, high: Floats, candidates: Ints, counts: Ints
) -> tuple[Ints, Ints]:
    """Return which candidates may be the nearest to a point of cells, and how many of each."""
    middle, reach = (low + high) / 2, np.sqrt(((high - low) ** 2).sum(axis=1)) / 2
    kept: list[Ints] = []
    left: list[Ints] = []
    begin = np.cumsum(counts) - counts
    for cells in _blocks(counts):
        own = candidates[_ranges(begin[cells], counts[cells])]
        owner = np.repeat(cells, counts[cells])
        value, _ = parts.distance(middle[owner], own)
        first = np.cumsum(counts[cells]) - counts[cells]
        limit = np.minimum.reduceat(value, first) + 2 * reach[cells] + 1e-9
        near = value <= np.repeat(limit, counts[cells])
        kept.append(own[near])
        left.append(np.add.reduceat(near.astype(np.int64), first))
    return np.concatenate(kept), np.concatenate(left)


def _blocks(counts: Ints) -> Iterator[Ints]:
    """Yield indices of counts, block by block, so that the sum of each block is limited."""
    block = np.cumsum(counts) // _PAIRS
    yield from np.split(np.arange(counts.size), np.flatnonzero(np.diff(block)) + 1)


def _ranges(begin: Ints, count: Ints) -> Ints:
    """Return the numbers begin, begin + 1, ..., ``count`` of them, for each, one after another."""
    end = np.cumsum(count)
    return np.asarray(np.repeat(begin - (end - count), count) + np.arange(int(end[-1])))

"""Voxelisation of chains of balls in closed form.

A ball, and the frustum that touches two neighbouring balls all round, are convex: a mid-line (the
line of voxel centres along one axis) meets each in one interval, and their union in intervals
whose ends are the hits with the surface. The voxel that holds a hit is lit. So every lit voxel is
within 1/2 of the surface, parts of the surface inside of others are not shown, and no 6-connected
path passes through. A hit on the face between two voxels belongs to the inner one. Must not know
curves.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from voxdisplay.bodies.implicit import ImplicitFunction
from voxdisplay.expressions.interval import Interval
from voxdisplay.voxelization.index_ranges import expand_ranges
from voxdisplay.voxelization.surfaces.implicit import voxelize_implicit
from voxdisplay.voxelization.surfaces.wire_cover import cover_wires, distinct
from voxdisplay.voxelization.voxel_set import VoxelSet

if TYPE_CHECKING:
    from voxdisplay.bodies.ball_chain import BallChain
    from voxdisplay.bodies.body import Body
    from voxdisplay.compute.array_types import Bools, Floats, Ints
    from voxdisplay.voxelization.voxel_box import VoxelBox

TIE = 1e-9
"""Hits so near to a face between voxels, in voxels, are taken to be on it."""
MAX_PAIRS = 1 << 22
"""Most pairs of balls and mid-lines along one axis; beyond, signs at the centres take less time."""
_BLOCK = 1 << 17  # pairs at a time, so that they stay in a core's cache
_KEPT = 1 << 21  # intervals that are kept before they are joined
_FINE = 1 << 14  # of a voxel: gaps that are narrower are none
_SOLID = 1e-9  # a frustum shorter than this adds nothing to its balls


class _Intervals(NamedTuple):
    """Intervals of mid-lines along one axis.

    Attributes
    ----------
    line : (n,) int64 array
        Number of the mid-line: u + v * number of lines along u, from the box's corner.
    low, high : (n,) float64 arrays
        Ends, in voxels from the box's corner; at most 1 outside of the box.

    """

    line: Ints
    low: Floats
    high: Floats


def voxelize_chain(
    geometry: BallChain,
    box: VoxelBox,
    body: Body,
    *,
    certified: bool = False,
) -> VoxelSet:
    """Return the voxels of a chain of balls inside a box, as a shell or filled.

    Of many large balls most of what they cover is inside of others: then the signs of the distance
    at the centres tell the voxels, as of implicit surfaces (`implicit`).
    """
    notes = ("nothing is proven: balls are about points of the curve",) if certified else ()
    if max(_count_pairs(geometry, axis, box) for axis in range(3)) > MAX_PAIRS:
        by_distance = ImplicitFunction(_Distance(geometry), geometry.bounds(), geometry.wires)
        return replace(voxelize_implicit(by_distance, box, body), notes=notes)
    fill = _solid if body.kind == "solid" else _shell
    if not geometry.wires:
        return VoxelSet(box, fill(geometry, box), body.kind, notes=notes)

    def inside(points: Floats) -> Bools:
        return np.asarray(geometry.nearest(points).distance <= 0)

    # What a wire needs depends on voxels just outside of the box.
    wide = box.expanded(1)
    index = cover_wires(fill(geometry, wide), wide, geometry.wires, inside)
    voxels = wide.voxels_at(index)
    return VoxelSet(box, box.index_of(voxels[box.inside(voxels)]), body.kind, notes=notes)


class _Distance:
    """Distance from a chain's surface, negative inside, by the chain's metric."""

    always_defined = True

    def __init__(self, chain: BallChain) -> None:
        self._chain = chain

    def __call__(self, x: Floats, y: Floats, z: Floats, /) -> Floats:
        at = np.stack(np.broadcast_arrays(x, y, z), axis=-1)
        return self._chain.nearest(at.reshape(-1, 3)).distance.reshape(at.shape[:-1])

    def enclosure(self, x: Interval, y: Interval, z: Interval, /) -> Interval:
        """Return the value in the middle, give or take the distance of the corners from it."""
        half = np.stack([(each.hi - each.lo) / 2 for each in (x, y, z)], axis=-1)
        middle = self(*((each.lo + each.hi) / 2 for each in (x, y, z)))
        reach = np.sqrt(((half @ np.abs(self._chain.metric).T) ** 2).sum(axis=-1))
        reach = reach * (1 + 1e-12) + 1e-6 + 1e-12 * np.abs(middle)
        return Interval(middle - reach, middle + reach)


def _shell(chain: BallChain, box: VoxelBox) -> Ints:
    found = []
    strides = 1, box.sides[0], box.sides[0] * box.sides[1]
    for axis in range(3):
        line, low, high = _union(chain, axis, box)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        u, v = line % box.sides[i], line // box.sides[i]
        base = u * strides[i] + v * strides[j]
        for voxel in (_voxel(low, 0), _voxel(high, 1)):
            inside = (voxel >= 0) & (voxel < box.sides[axis])
            found.append(base[inside] + voxel[inside] * strides[axis])
    return distinct(found)


def _voxel(hit: Floats, below: int) -> Ints:
    """Return the voxels that hold hits; of those on a face the one above, or ``below`` it."""
    face = np.rint(hit)
    return np.where(np.abs(hit - face) < TIE, face - below, np.floor(hit)).astype(np.int64)


def _solid(chain: BallChain, box: VoxelBox) -> Ints:
    """Return the voxels whose centres are inside; one on the surface is of what is above it."""
    line, low, high = _union(chain, 2, box)
    nx, ny, nz = box.sides
    first, end = (np.clip(_first_centre(each), 0, nz).astype(np.int64) for each in (low, high))
    count = np.maximum(end - first, 0)
    index = np.repeat(line, count) + expand_ranges(first, count) * (nx * ny)
    index.sort()
    return index


def _first_centre(at: Floats) -> Floats:
    """Return the first voxel whose centre is not below a coordinate."""
    nearest = np.rint(at - 0.5)
    return np.where(np.abs(at - 0.5 - nearest) < TIE, nearest, np.ceil(at - 0.5))


# ------------------------------------------------------------------------- intervals


def _union(chain: BallChain, axis: int, box: VoxelBox) -> _Intervals:
    """Return the intervals of the mid-lines along an axis that are inside, apart from others."""
    kept: list[_Intervals] = []
    size = 0
    bits = int(np.ceil(np.log2((box.sides[axis] + 2) * _FINE))) + 1
    for each in _pieces(chain, axis, box):
        kept.append(each)
        size += each.line.size
        if size > _KEPT:
            kept = [_joined(kept, bits)]
            size = kept[0].line.size
            if size > _KEPT // 2:
                size = 0  # they are many by themselves
    return _joined(kept, bits)


def _joined(parts: list[_Intervals], bits: int) -> _Intervals:
    """Return the union of intervals."""
    if not parts:
        return _Intervals(np.empty(0, dtype=np.int64), np.empty(0), np.empty(0))
    line, low, high = (np.concatenate([part[k] for part in parts]) for k in range(3))
    # Whole numbers that sort by line, then by place on it.
    key = (line << bits) + ((low + 1) * _FINE).astype(np.int64)
    order = np.argsort(key)
    last = np.maximum.accumulate(((line << bits) + ((high + 1) * _FINE).astype(np.int64))[order])
    starts = np.flatnonzero(np.append(True, key[order][1:] > last[:-1] + 1)[: line.size])
    if not starts.size:
        return _Intervals(line, low, high)
    return _Intervals(
        line[order][starts],
        np.minimum.reduceat(low[order], starts),
        np.maximum.reduceat(high[order], starts),
    )


def _count_pairs(chain: BallChain, axis: int, box: VoxelBox) -> int:
    _, *pairs = _pairs(chain, axis, box)
    return sum(each.size for each in pairs)


def _pairs(chain: BallChain, axis: int, box: VoxelBox) -> tuple[Ints, _Pairs, _Pairs]:
    """Return the corners that have balls, and the mid-lines near balls and near frustums."""
    ball = np.zeros(len(chain.points), dtype=bool)
    ball[chain.first] = ball[chain.first + 1] = True
    half = chain.radii[:, None] * chain.reach
    low, high = chain.points - half, chain.points + half
    which = np.flatnonzero(ball)
    a, b = chain.first, chain.first + 1
    spans = np.minimum(low[a], low[b]), np.maximum(high[a], high[b])
    return which, _Pairs(low[which], high[which], axis, box), _Pairs(*spans, axis, box)


def _pieces(chain: BallChain, axis: int, box: VoxelBox) -> Iterator[_Intervals]:
    """Yield the intervals of balls and frustums, block by block."""
    which, *pairs = _pairs(chain, axis, box)
    shapes_of: list[_Balls | _Frustums] = [_Balls(chain, which, axis), _Frustums(chain, axis)]
    for shapes, each in zip(shapes_of, pairs, strict=True):
        for row, u, v in each.blocks():
            found_low, found_high = shapes.interval(row, u, v)
            corner, side = box.low[axis], box.sides[axis]
            found_low = np.maximum(found_low - corner, -1.0)
            found_high = np.minimum(found_high - corner, side + 1.0)
            met = np.flatnonzero(found_low < found_high)
            i, j = (axis + 1) % 3, (axis + 2) % 3
            line = (u[met] - box.low[i]) + (v[met] - box.low[j]) * box.sides[i]
            yield _Intervals(line, found_low[met], found_high[met])


class _Pairs:
    """Pairs of boxes, (n, 3) corners each, and the mid-lines along an axis through them."""

    def __init__(self, low: Floats, high: Floats, axis: int, box: VoxelBox) -> None:
        i, j = (axis + 1) % 3, (axis + 2) % 3
        self.first: list[Ints] = []
        self.counts: list[Ints] = []
        near = (high[:, axis] > box.low[axis] - 1) & (low[:, axis] < box.high[axis] + 1)
        for other in (i, j):
            begin, end = box.low[other], box.high[other]
            first = np.ceil(np.clip(low[:, other], begin, end) - 0.5).astype(np.int64)
            last = np.floor(np.clip(high[:, other], begin, end) - 0.5).astype(np.int64)
            first, last = np.maximum(first, begin), np.minimum(last, end - 1)
            self.first.append(first)
            self.counts.append(np.where(near, np.maximum(last - first + 1, 0), 0))
        self.total = self.counts[0] * self.counts[1]
        self.size = int(self.total.sum(dtype=np.float64))

    def blocks(self) -> Iterator[tuple[Ints, Ints, Ints]]:
        """Yield numbers of boxes, u and v of mid-lines, (n,) int64 each, block by block."""
        rows = np.flatnonzero(self.total)
        block = np.cumsum(self.total[rows]) // _BLOCK
        for part in np.split(rows, np.flatnonzero(np.diff(block)) + 1):
            if part.size:
                row = np.repeat(part, self.total[part])
                rank = expand_ranges(np.zeros(part.size, dtype=np.int64), self.total[part])
                v = rank // self.counts[0][row]
                u = rank - v * self.counts[0][row]
                yield row, u + self.first[0][row], v + self.first[1][row]


class _Balls:
    """Balls, and the intervals of mid-lines that are inside of them."""

    def __init__(self, chain: BallChain, which: Ints, axis: int) -> None:
        self.center, self.square = chain.points[which], chain.radii[which] ** 2
        self.axes = (axis + 1) % 3, (axis + 2) % 3, axis
        gram = chain.metric.T @ chain.metric
        self.gram = gram[np.ix_(self.axes, self.axes)]

    def interval(self, row: Ints, u: Ints, v: Ints) -> tuple[Floats, Floats]:
        """Return the ends of the intervals; nan where there is none."""
        i, j, k = self.axes
        du, dv = u + 0.5 - self.center[row, i], v + 0.5 - self.center[row, j]
        half, constant = _line_terms(self.gram, du, dv)
        constant -= self.square[row]
        with np.errstate(invalid="ignore"):
            root = np.sqrt(half * half - self.gram[2, 2] * constant)
        middle = self.center[row, k]
        return middle - (root + half) / self.gram[2, 2], middle + (root - half) / self.gram[2, 2]


class _Frustums:
    """Frustums of cones that touch two balls all round, and the intervals inside of them."""

    def __init__(self, chain: BallChain, axis: int) -> None:
        self.axes = (axis + 1) % 3, (axis + 2) % 3, axis
        first = chain.first
        self.center, self.radius = chain.points[first], chain.radii[first]
        along = (chain.points[first + 1] - self.center) @ chain.metric.T
        length = np.sqrt((along * along).sum(axis=1))
        with np.errstate(all="ignore"):
            # The height along the axis of a mid-line's point, as a function of its coordinates.
            self.height = ((along / length[:, None]) @ chain.metric)[:, self.axes]
            self.slope = (self.radius - chain.radii[first + 1]) / length
        square = 1 - self.slope**2
        self.exists = (square > _SOLID) & (length > _SOLID)
        self.square = np.where(self.exists, square, 1.0)
        self.low = self.radius * self.slope
        self.high = length + chain.radii[first + 1] * self.slope
        gram = chain.metric.T @ chain.metric
        self.gram = gram[np.ix_(self.axes, self.axes)]

    @np.errstate(all="ignore")
    def interval(self, row: Ints, u: Ints, v: Ints) -> tuple[Floats, Floats]:
        """Return the ends of the intervals; low is not below high, or nan, where there is none.

        With the height y along the axis and the distance d from it, the cone's inside is
        d cos + y sin <= r, and its square a quadratic along the line.
        """
        i, j, k = self.axes
        du, dv = u + 0.5 - self.center[row, i], v + 0.5 - self.center[row, j]
        half, constant = _line_terms(self.gram, du, dv)
        rise = self.height[row, 2]
        height = self.height[row, 0] * du + self.height[row, 1] * dv
        square, low_y, radius = self.square[row], self.low[row], self.radius[row]
        a = square * self.gram[2, 2] - rise * rise
        b = square * half - (height - low_y) * rise
        c = square * constant - (height - 2 * low_y) * height - radius * radius
        # Between the planes of the circles in which the cone touches the balls.
        ends = (low_y - height) / rise, (self.high[row] - height) / rise
        low, high = np.minimum(*ends), np.maximum(*ends)
        level = rise == 0
        if level.any():
            within = level & (height >= low_y) & (height <= self.high[row])
            low = np.where(level, np.where(within, -np.inf, np.nan), low)
            high = np.where(level, np.where(within, np.inf, np.nan), high)
        root = np.sqrt(b * b - a * c)
        far = -(b + np.copysign(root, b))
        one, two = far / a, np.where(far == 0, 0.0, c / far)
        first, last = np.minimum(one, two), np.maximum(one, two)
        steep = a < 0
        if steep.any():  # inside of the cone's two halves, one of which is between the planes
            none = steep & np.isnan(root)  # no hit at all: all of the line is inside
            lower = steep & ~(np.minimum(high, first) <= low)
            first, last = (
                np.where(steep, np.where(lower | none, -np.inf, last), first),
                np.where(steep, np.where(lower & ~none, first, np.inf), last),
            )
        low, high = np.maximum(low, first), np.minimum(high, last)
        low = np.where(self.exists[row], low, np.nan)
        middle = self.center[row, k]
        return middle + low, middle + high


def _line_terms(gram: Floats, du: Floats, dv: Floats) -> tuple[Floats, Floats]:
    """Return h and k of the squared length g w**2 + 2 h w + k of (du, dv, w) by a metric."""
    constant = gram[0, 0] * (du * du) + gram[1, 1] * (dv * dv)
    half = np.zeros(1)
    if gram[0, 1] != 0:
        constant += (2 * gram[0, 1]) * (du * dv)
    if gram[0, 2] != 0 or gram[1, 2] != 0:
        half = gram[0, 2] * du + gram[1, 2] * dv
    return half, constant

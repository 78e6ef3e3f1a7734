"""Voxelisation of height fields by columns.

A voxel is lit if the surface meets its central cross, the pieces of three mid-lines that are
nearer to its centre than to any other: in the column at a centre that is the voxel of f there,
and all whose centres lie between f there and f at the middles between it and the four columns
beside it. Columns are evaluated in their middles and halfway between; nothing is refined but
where f jumps. Must not know formulas.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.errors import BodyError
from voxdisplay.expressions.interval import Interval
from voxdisplay.voxelization.index_ranges import expand_ranges
from voxdisplay.voxelization.surfaces.implicit_cover_proof import open_cells
from voxdisplay.voxelization.surfaces.interval_subdivision import prune
from voxdisplay.voxelization.surfaces.wire_cover import distinct
from voxdisplay.voxelization.voxel_set import VoxelSet

if TYPE_CHECKING:
    from collections.abc import Callable

    from voxdisplay.bodies.body import Body
    from voxdisplay.bodies.height_field import HeightFunction
    from voxdisplay.compute.array_types import Bools, Floats, Ints
    from voxdisplay.voxelization.voxel_box import VoxelBox

_STEEP = 1.5
"""Steps of f over half a voxel that are longer, in voxels, are halved: they may be jumps."""
_HALVINGS = 40

_Beyond = tuple["Ints", "Ints", "Floats", "Floats"]


def voxelize_heights(
    geometry: HeightFunction,
    box: VoxelBox,
    body: Body,
    *,
    certified: bool = False,
) -> VoxelSet:
    """Return the voxels of a height field inside a box.

    Raises
    ------
    BodyError
        If the function has no value at any centre of the rectangle.

    """
    x, y = (_Lines(geometry, box, axis) for axis in (0, 1))
    if not (x.count and y.count):
        return VoxelSet(box, np.empty(0, dtype=np.int64), body.kind, certified=certified)
    f = geometry.value
    with np.errstate(all="ignore"):
        middle = f(x.centre, y.centre[:, None])
        between_x = f(x.between, y.centre[:, None])
        between_y = f(x.centre, y.between[:, None])
        own = y.inside[:, None] & x.inside
        missing = own & np.isnan(middle)
        if own.any() and not (own & ~missing).any():
            raise BodyError(
                f"{body} has no value at any of {int(own.sum())} columns",
                hint="z is a number for x and y in their ranges",
            )
        runs = _Runs(middle)
        jumps: list[_Beyond] = []
        ends = between_x[:, 1:], between_x[:, :-1], between_y[1:], between_y[:-1]
        for k, end in enumerate(ends):
            valid = y.inside[:, None] if k < 2 else x.inside
            reached, beyond = _continuous(f, x, y, k, np.where(valid, middle, np.nan), end)
            if beyond is not None and beyond[0].size:
                jumps.append(beyond)
            runs.extend(np.where(valid, reached, np.nan), closed=k % 2 == 1)
        runs.include(np.where(own, middle, np.nan), box.high[2])
    notes = []
    if missing.any():
        notes.append(f"the height has no value at {int(missing.sum())} of {int(own.sum())} columns")
    if jumps:
        notes.append("the height jumps, or has poles: nothing is drawn across")
    index = distinct([runs.index(x, y, box), *(_index_beyond(each, x, y, box) for each in jumps)])
    if certified:
        above = _Above(geometry)
        unproven = open_cells(above, prune(above, box.expanded(1)), index, box)
        notes += unproven
        certified = not unproven
    return VoxelSet(box, index, body.kind, notes=tuple(notes), certified=certified)


class _Above:
    """Height above the surface, with bounds that hold no zero beyond its rectangle."""

    always_defined = False

    def __init__(self, geometry: HeightFunction) -> None:
        self._geometry = geometry

    def __call__(self, x: Floats, y: Floats, z: Floats, /) -> Floats:
        return np.asarray(z - self._geometry.value(x, y))

    def enclosure(self, x: Interval, y: Interval, z: Interval, /) -> Interval | None:
        (a, b), (c, d) = (
            (np.maximum(each.lo, low), np.minimum(each.hi, high))
            for each, low, high in zip((x, y), self._geometry.low, self._geometry.high, strict=True)
        )
        beyond = (a > b) | (c > d)
        inside = Interval(np.minimum(a, b), b), Interval(np.minimum(c, d), d)
        heights = self._geometry.value.enclosure(*inside)
        if heights is None:
            return None
        above = z - heights
        return Interval(np.where(beyond, 1.0, above.lo), np.where(beyond, 1.0, above.hi))


def _index_beyond(beyond: _Beyond, x: _Lines, y: _Lines, box: VoxelBox) -> Ints:
    """Return the scan-order indices of centres between f beyond jumps and at the next middle."""
    rows, columns, one, other = beyond
    first = np.ceil(np.clip(np.minimum(one, other), box.low[2], box.high[2]) - 0.5)
    end = np.floor(np.clip(np.maximum(one, other), box.low[2], box.high[2]) + 0.5)
    count = np.maximum(end - first, 0).astype(np.int64)
    z = expand_ranges(first.astype(np.int64) - box.low[2], count)
    nx, ny, _ = box.sides
    column = (rows + y.first - box.low[1]) * nx + columns + x.first - box.low[0]
    return np.asarray(np.repeat(column, count) + z * (nx * ny))


class _Lines:
    """Centres and middles between them along x or y, clipped to the rectangle."""

    def __init__(self, geometry: HeightFunction, box: VoxelBox, axis: int) -> None:
        low, high = float(geometry.low[axis]), float(geometry.high[axis])
        self.first = int(np.floor(np.clip(low, box.low[axis], box.high[axis])))
        last = int(np.ceil(np.clip(high, box.low[axis], box.high[axis])))
        self.count = last - self.first if low <= box.high[axis] and high >= box.low[axis] else 0
        at = np.arange(self.first, last)
        self.inside: Bools = (at + 0.5 >= low) & (at + 0.5 <= high)
        self.centre: Floats = np.clip(at + 0.5, low, high)
        self.between: Floats = np.clip(np.append(at, last), low, high)


class _Runs:
    """For each column the stretch of voxels, from first to last, that are lit."""

    def __init__(self, middle: Floats) -> None:
        self.middle = middle
        self.first = np.full(middle.shape, np.inf)
        self.last = np.full(middle.shape, -np.inf)

    def extend(self, end: Floats, *, closed: bool) -> None:
        """Add the centres between f in the middle and f at an end, the latter only if closed.

        What is exactly on the face between two columns belongs to the upper one.
        """
        up, down = end > self.middle, end < self.middle
        top, bottom = np.floor(end - 0.5), np.ceil(end - 0.5)
        if not closed:
            top, bottom = np.ceil(end - 0.5) - 1, np.floor(end - 0.5) + 1
        base, roof = np.ceil(self.middle - 0.5), np.floor(self.middle - 0.5)
        for side, first, last in ((up, base, top), (down, bottom, roof)):
            some = side & (first <= last)
            self.first = np.where(some, np.minimum(self.first, first), self.first)
            self.last = np.where(some, np.maximum(self.last, last), self.last)

    def include(self, height: Floats, wall: int) -> None:
        """Add the voxel that holds each height; on the upper wall of the box, the one below."""
        voxel = np.where(height == wall, wall - 1, np.floor(height))
        self.first = np.fmin(self.first, voxel)
        self.last = np.fmax(self.last, voxel)

    def index(self, x: _Lines, y: _Lines, box: VoxelBox) -> Ints:
        """Return the scan-order indices of the lit voxels in a box."""
        first = np.clip(self.first, box.low[2], box.high[2]).astype(np.int64)
        count = np.clip(self.last + 1, box.low[2], box.high[2]).astype(np.int64) - first
        count = np.maximum(count, 0)
        nx, ny, _ = box.sides
        rows = np.arange(y.count) + (y.first - box.low[1])
        column = rows[:, None] * nx + np.arange(x.count) + (x.first - box.low[0])
        flat = count.reshape(-1)
        z = expand_ranges(first.reshape(-1) - box.low[2], flat)
        return np.asarray(np.repeat(column.reshape(-1), flat) + z * (nx * ny))


def _continuous(
    f: Callable[[Floats, Floats], Floats], x: _Lines, y: _Lines, k: int, middle: Floats, end: Floats
) -> tuple[Floats, _Beyond | None]:
    """Return f at the ends of half steps from the middles, or where it jumps before.

    A jump is a step that stays long when its part with the greatest change is halved again and
    again. Where f ends, it is taken at its last value.

    Parameters
    ----------
    f : callable
    x, y : _Lines
    k : {0, 1, 2, 3}
        Towards greater x, lesser x, greater y, lesser y.
    middle, end : (ny, nx) float64 array
        f in the middles and at the ends.

    Returns
    -------
    (ny, nx) float64 array
    rows, columns, (n,) int64; (n,) float64, (n,) float64; or None
        Of the half steps in which it jumps: f just beyond the jump, and at the end.

    """
    steep = np.nonzero(~(np.abs(end - middle) <= _STEEP) & ~np.isnan(middle))
    if not steep[0].size:
        return end, None
    rows, columns = steep
    from_x, from_y = x.centre[columns], y.centre[rows]
    by_x = (x.between[columns + (k == 0)] if k < 2 else from_x) - from_x
    by_y = (y.between[rows + (k == 2)] if k >= 2 else from_y) - from_y
    low, high = np.zeros(rows.size), np.ones(rows.size)
    f_low, f_high = middle[steep], end[steep]
    left = np.arange(rows.size)  # those that may still jump
    for _ in range(_HALVINGS):
        left = left[~(np.abs(f_high[left] - f_low[left]) <= _STEEP)]
        if not left.size:
            break
        share = (low[left] + high[left]) / 2
        value = f(from_x[left] + share * by_x[left], from_y[left] + share * by_y[left])
        # The half of the greater change; to a point without a value it is infinite.
        first = ~(np.abs(value - f_low[left]) <= np.abs(f_high[left] - value))
        high[left[first]], f_high[left[first]] = share[first], value[first]
        low[left[~first]], f_low[left[~first]] = share[~first], value[~first]
    result = end.copy()
    result[rows[left], columns[left]] = f_low[left]  # up to the jump
    beyond = left[np.isfinite(f_high[left])]
    return result, (rows[beyond], columns[beyond], f_high[beyond], end[steep][beyond])

"""Voxelisation of implicit surfaces and solids by the signs at voxel centres.

Between neighbouring centres, one with f <= 0 and one with f > 0, there is a piece of surface; f in
the middle between them tells which of the two voxels is nearer to it, and that one is lit. So no
6-connected path leads from f <= 0 to f > 0 but through lit voxels, and every lit one is within 1/2
of the surface. Where f has bounds, bricks of space that hold no zero are not evaluated. Must not
know formulas.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.errors import BodyError
from voxdisplay.voxelization.surfaces.implicit_cover_proof import open_cells
from voxdisplay.voxelization.surfaces.interval_subdivision import BRICK, Bricks, prune
from voxdisplay.voxelization.surfaces.wire_cover import cover_wires, distinct
from voxdisplay.voxelization.voxel_box import VoxelBox
from voxdisplay.voxelization.voxel_set import VoxelSet

if TYPE_CHECKING:
    from collections.abc import Iterator

    from voxdisplay.bodies.body import Body
    from voxdisplay.bodies.implicit import ImplicitFunction
    from voxdisplay.compute.array_types import Bools, Floats, Ints

_BLOCK_SIZE = 1 << 18  # values at a time, so that they stay in a core's cache
_DENSE_COST = 0.6  # of a value on a whole plane, where axes broadcast, to one in a brick
_HALVINGS = 40


def voxelize_implicit(
    geometry: ImplicitFunction, box: VoxelBox, body: Body, *, certified: bool = False
) -> VoxelSet:
    """Return the voxels of an implicit surface, or solid, inside a box.

    Raises
    ------
    BodyError
        If the function has no value at any voxel's centre.

    """
    region = _region(geometry, box)
    if region.size == 0:
        return VoxelSet(box, np.empty(0, dtype=np.int64), body.kind, certified=certified)
    scan = _Scan(geometry, region, solid=body.kind == "solid")
    # A voxel's cross ends halfway to the centres beside it: those around the region count.
    centres = region.expanded(1)
    bricks = prune(geometry.function, centres)
    dense = centres.size
    with np.errstate(all="ignore"):
        if bricks is None or len(bricks.origin) * (BRICK + 1) ** 3 > _DENSE_COST * dense:
            for block in _planes(centres):
                scan.add(*block)
        else:
            if scan.solid:
                for low, high in bricks.filled:
                    scan.fill(low, high)
            for block in _blocks(bricks, centres):
                scan.add(*block)
    notes = scan.notes(body)
    index = scan.index()
    if geometry.wires:
        index = cover_wires(index, region, geometry.wires, lambda p: geometry.function(*p.T) <= 0)
    if certified:
        unproven = open_cells(geometry.function, bricks, index, region)
        notes += unproven
        certified = not unproven
    if region != box:
        index = box.index_of(region.voxels_at(index))
    return VoxelSet(box, index, body.kind, notes=notes, certified=certified)


def _region(geometry: ImplicitFunction, box: VoxelBox) -> VoxelBox:
    """Return the voxels of a box that reach into the box of a function."""
    low = np.floor(np.clip(geometry.bounds[0], box.low, box.high)).astype(int).tolist()
    high = np.ceil(np.clip(geometry.bounds[1], box.low, box.high)).astype(int).tolist()
    if any(a >= b for a, b in zip(low, high, strict=True)):
        return VoxelBox(box.low, box.low)
    return VoxelBox((low[0], low[1], low[2]), (high[0], high[1], high[2]))


def _planes(box: VoxelBox) -> Iterator[tuple[Ints, tuple[int, int, int]]]:
    """Yield blocks of whole planes of centres, which overlap by one."""
    nx, ny, nz = box.sides
    step = max(_BLOCK_SIZE // (nx * ny), 1)
    for z in range(0, nz - 1, step):
        origin = np.array([[box.low[0], box.low[1], box.low[2] + z]])
        yield origin, (nx, ny, min(step + 1, nz - z))


def _blocks(bricks: Bricks, box: VoxelBox) -> Iterator[tuple[Ints, tuple[int, int, int]]]:
    """Yield bricks of centres, which overlap by one, many at a time."""
    step = _BLOCK_SIZE // (BRICK + 1) ** 3
    sides = tuple(min(BRICK + 1, side) for side in box.sides)
    for begin in range(0, len(bricks.origin), step):
        yield bricks.origin[begin : begin + step], (sides[0], sides[1], sides[2])


def _voxels(place: Ints, origin: Ints, sides: tuple[int, int, int]) -> Ints:
    """Return the voxels, (n, 3), at indices of blocks [block, z, y, x] with given origins."""
    row = place // sides[0]
    plane = row // sides[1]
    block = plane // sides[2]
    voxel = origin[block]
    voxel[:, 0] += place - row * sides[0]
    voxel[:, 1] += row - plane * sides[1]
    voxel[:, 2] += plane - block * sides[2]
    return voxel


class _Scan:
    """Signs at centres, block by block, and the voxels that they light."""

    def __init__(self, geometry: ImplicitFunction, region: VoxelBox, *, solid: bool) -> None:
        self.function = geometry.function
        self.is_taken = geometry.inside
        self.region = region
        self.solid = solid
        # Of solids all centres, those around the region too, and room for whole bricks.
        self.origin = np.array(region.low) - 1
        nx, ny, nz = (-(-(side + 1) // BRICK) * BRICK + 1 for side in region.sides)
        self.mask = np.zeros((nz, ny, nx) if solid else (0, 0, 0), dtype=bool)
        self.found: list[Ints] = []
        self.values = 0
        self.missing = 0
        self.poles = 0

    def add(self, origin: Ints, sides: tuple[int, int, int]) -> None:
        """Evaluate blocks of centres.

        Parameters
        ----------
        origin : (n, 3) int64 array
            First voxel, x, y and z, of each block.
        sides : (int, int, int)
            Number of centres along x, y and z.

        """
        shapes = (1, 1, sides[0]), (1, sides[1], 1), (sides[2], 1, 1)
        axes: list[Floats] = []
        for axis, shape in enumerate(shapes):
            at = origin[:, axis, None] + (np.arange(sides[axis]) + 0.5)
            axes.append(np.asarray(at.reshape(-1, *shape), dtype=np.float64))
        value = self.function(*axes)
        inside = value <= 0
        absent = np.isnan(value)
        has_gaps = bool(absent.any())
        cut = 0  # where the function is not taken
        if self.is_taken is not None:
            cut = value.size - int(np.count_nonzero(self.is_taken(*axes)))
        self.values += value.size - cut
        self.missing += int(np.count_nonzero(absent)) - cut
        if self.solid:
            self._store(inside, origin)
            return
        values = value.reshape(-1)
        strides = 1, sides[0], sides[0] * sides[1]
        for axis in range(3):
            # Neighbours are a stride apart; pairs that wrap round to the next row are none.
            change = np.zeros(value.shape, dtype=bool)
            behind, ahead = [slice(None)] * 4, [slice(None)] * 4
            behind[3 - axis], ahead[3 - axis] = slice(None, -1), slice(1, None)
            np.not_equal(inside[tuple(behind)], inside[tuple(ahead)], out=change[tuple(behind)])
            if has_gaps:
                change[tuple(behind)] &= ~(absent[tuple(behind)] | absent[tuple(ahead)])
            place = np.flatnonzero(change)
            if place.size:
                ends = values[place], values[place + strides[axis]]
                self._cross(_voxels(place, origin, sides), axis, *ends)
        zero = np.flatnonzero(value == 0)
        if zero.size:
            self._light(_voxels(zero, origin, sides))

    def _cross(self, voxel: Ints, axis: int, first: Floats, second: Floats) -> None:
        """Light the nearer voxels of pairs, at ``voxel`` and the next along an axis."""
        x, y, z = (voxel + 0.5).T
        along = (x, y, z)[axis]
        point = [x, y, z]
        point[axis] = along + 0.5
        middle = self.function(*point)
        if not self.function.always_defined:
            real = ~self._poles(point, axis, first, middle, second)
            self.poles += int((~real).sum())
            voxel, first, middle = voxel[real], first[real], middle[real]
        # The outer one if the middle is inside; a zero there belongs to the inner one.
        forward = np.where(first <= 0, middle < 0, ~(middle < 0))
        voxel = voxel.copy()
        voxel[:, axis] += forward
        self._light(voxel)

    def _poles(
        self, point: list[Floats], axis: int, first: Floats, middle: Floats, second: Floats
    ) -> Bools:
        """Return where f changes sign by a pole: its values grow as the bracket is halved."""
        pole = np.zeros(first.size, dtype=bool)
        width = np.abs(second - first)
        inner = (first <= 0) != (middle <= 0)  # the change is in the first half
        low, high = np.where(inner, -0.5, 0.0), np.where(inner, 0.0, 0.5)
        f_low, f_high = np.where(inner, first, middle), np.where(inner, middle, second)
        left = np.arange(first.size)
        for _ in range(_HALVINGS):
            left = left[~(np.abs(f_high[left] - f_low[left]) <= 0.5 * width[left])]
            if not left.size:
                return pole
            share = (low[left] + high[left]) / 2
            at = [each[left] for each in point]
            at[axis] = at[axis] + share
            value = self.function(*at)
            inner = (f_low[left] <= 0) != (value <= 0)
            high[left[inner]], f_high[left[inner]] = share[inner], value[inner]
            low[left[~inner]], f_low[left[~inner]] = share[~inner], value[~inner]
        # A jump between finite values is a surface; beyond a pole there is none.
        pole[left] = ~(np.abs(f_high[left] - f_low[left]) <= 1e3 * width[left])
        return pole

    def _light(self, voxel: Ints) -> None:
        self.found.append(self.region.index_of(voxel[self.region.inside(voxel)]))

    def _store(self, inside: Bools, origin: Ints) -> None:
        """Store which centres of blocks, (n, sz, sy, sx), are inside of a solid."""
        _, sz, sy, sx = inside.shape
        _, ny, nx = self.mask.shape
        x, y, z = (origin - self.origin).T
        step = np.arange(sx) + nx * (np.arange(sy)[:, None] + ny * np.arange(sz)[:, None, None])
        index = (x + nx * (y + ny * z))[:, None, None, None] + step
        self.mask.reshape(-1)[index[inside]] = True

    def fill(self, low: Ints, high: Ints) -> None:
        """Store that all centres low <= (x, y, z) < high are inside of a solid."""
        begin, end = (low - self.origin).tolist(), (high - self.origin).tolist()
        x, y, z = (slice(a, b) for a, b in zip(begin, end, strict=True))
        self.mask[z, y, x] = True

    def index(self) -> Ints:
        """Return the scan-order indices of lit voxels in the region, ascending."""
        if not self.solid:
            return distinct(self.found)
        nx, ny, nz = self.region.sides
        return np.flatnonzero(self.mask[1 : nz + 1, 1 : ny + 1, 1 : nx + 1])

    def notes(self, body: Body) -> tuple[str, ...]:
        """Return what was left out; raise BodyError if there was no value at all."""
        if self.missing and self.missing == self.values:
            raise BodyError(
                f"{body} has no value at any of {self.values} points",
                hint="f is a number for x, y and z in its box",
            )
        notes = []
        if self.missing:
            share = 100 * self.missing / self.values
            notes.append(f"f has no value at {share:.2g} % of {self.values} points")
        if self.poles:
            notes.append(f"f changes sign at {self.poles} poles: nothing is drawn there")
        return tuple(notes)

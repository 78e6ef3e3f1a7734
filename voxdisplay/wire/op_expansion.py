"""Expansion of chains, bricks and shapes into voxels, many ops at once (protocol.md, 7.1 to 7.4).

Each class collects ops while they are parsed. Must not know how they are written.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from voxdisplay.raster.grid import Grid
from voxdisplay.wire.op_encoding import Ints, concat_ranges

Written = tuple[Ints, Ints, Ints]
"""Number of the op, scan-order index, and pixel value of each voxel that is written."""


def _ints(values: list[int]) -> Ints:
    return np.array(values, dtype=np.int64)


# A place packed into one number, x from the lowest bit on, and so the eight children of a cube.
_SHIFTS = (0, 21, 42)
_MASK = (1 << 21) - 1
_PACKED = _ints([1 << shift for shift in _SHIFTS])
_CHILDREN = np.indices((2, 2, 2))[::-1].reshape(3, 8).T @ _PACKED


def _cuboid(grid: Grid, sides: Sequence[int]) -> Ints:
    """Return the indices, (n,), of a cuboid's voxels, less that of its first one."""
    x, y, z = map(np.arange, sides)
    index = x + grid.nx * (y[:, None] + grid.ny * z[:, None, None])
    return index.reshape(-1)


@dataclass
class Chains:
    """Chains of steps: STEP and FROM, of which begin and end are on the grid."""

    op: list[int] = field(default_factory=list)
    pen: list[int] = field(default_factory=list)
    begin: list[int] = field(default_factory=list)
    octant: list[int] = field(default_factory=list)
    steps: list[int] = field(default_factory=list)
    crumbs: list[bytes] = field(default_factory=list)

    def add(self, op: int, pen: int, begin: int, octant: int, steps: int, crumbs: bytes) -> None:
        """Add a chain.

        Parameters
        ----------
        op, pen : int
            Number of the op, and the pixel value that it writes.
        begin : int
            Index of its first voxel.
        octant, steps, crumbs
            As on the wire.

        """
        self.op.append(op)
        self.pen.append(pen)
        self.begin.append(begin)
        self.octant.append(octant)
        self.steps.append(steps)
        self.crumbs.append(crumbs)

    def expand(self, grid: Grid) -> Written:
        """Return the voxels of all chains."""
        steps, octant = _ints(self.steps), _ints(self.octant)
        stride = np.array((1, grid.nx, grid.nx * grid.ny), dtype=np.int64)
        main = octant // 8
        # Change of the index by a step along each axis, (chains, 3): main axis, and the two others.
        axes = (main[:, None] + np.arange(3)) % 3
        delta = np.where(octant[:, None] >> axes & 1, -stride[axes], stride[axes])

        raw = np.frombuffer(b"".join(self.crumbs), dtype=np.uint8)
        bits = np.unpackbits(raw, bitorder="little").reshape(-1, 2).astype(np.int64)
        slots = -(-steps // 4) * 4
        bits = bits[concat_ranges(np.cumsum(slots) - slots, steps)]
        chain = np.repeat(np.arange(len(steps)), steps)
        moved = delta[chain, 0] + (bits * delta[chain, 1:]).sum(axis=1)

        # The first voxel of a chain comes before its steps.
        first = np.cumsum(steps + 1) - (steps + 1)
        change = np.zeros(int((steps + 1).sum()), dtype=np.int64)
        change[concat_ranges(first + 1, steps)] = moved
        total = np.cumsum(change)
        index = total + np.repeat(_ints(self.begin) - total[first], steps + 1)
        return np.repeat(_ints(self.op), steps + 1), index, np.repeat(_ints(self.pen), steps + 1)


@dataclass
class Bricks:
    """Octree bricks: OCT."""

    op: list[int] = field(default_factory=list)
    pen: list[int] = field(default_factory=list)
    corner: list[tuple[int, int, int]] = field(default_factory=list)
    level: list[int] = field(default_factory=list)
    masks: list[list[bytes]] = field(default_factory=list)

    def add(
        self, op: int, pen: int, brick: tuple[int, int, int], level: int, masks: list[bytes]
    ) -> None:
        """Add a brick.

        Parameters
        ----------
        op, pen : int
            As of `Chains.add`.
        brick : (int, int, int)
            Its coordinates, as on the wire.
        level : int
        masks : list of bytes
            Masks of the nodes of each level, from the brick's own on.

        """
        x, y, z = brick
        self.op.append(op)
        self.pen.append(pen)
        self.corner.append((x << level, y << level, z << level))
        self.level.append(level)
        self.masks.append(masks)

    def expand(self, grid: Grid) -> Written:
        """Return the voxels of all bricks; raise ValueError if one is off the grid."""
        brick = np.arange(len(self.op))
        corner = np.array(self.corner, dtype=np.int64).reshape(-1, 3) @ _PACKED
        side = np.int64(1) << _ints(self.level)
        found: list[tuple[Ints, Ints, Ints]] = []  # cubes: brick, packed corner, side
        depth = 0
        while len(brick):
            voxels = side == 1
            found.append((brick[voxels], corner[voxels], side[voxels]))
            brick, corner, side = brick[~voxels], corner[~voxels], side[~voxels]
            present = [masks[depth] for masks in self.masks if len(masks) > depth]
            mask = np.frombuffer(b"".join(present), dtype=np.uint8)
            full = mask == 0
            found.append((brick[full], corner[full], side[full]))
            child = np.flatnonzero(np.unpackbits(mask, bitorder="little"))
            node = child >> 3
            side = side[node] >> 1
            corner = corner[node] + _CHILDREN[child & 7] * side
            brick = brick[node]
            depth += 1
        owners, corners, sides = (
            np.concatenate(part) if found else np.empty(0, dtype=np.int64)
            for part in (zip(*found, strict=True) if found else ((), (), ()))
        )
        x, y, z = (corners >> shift & _MASK for shift in _SHIFTS)
        for place, length in zip((x, y, z), grid, strict=True):
            if (place + sides > length).any():
                raise ValueError("a brick writes outside the grid")
        index, owner = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.int64)]
        begin = x + grid.nx * (y + grid.ny * z)
        for level in range(max(self.level, default=-1) + 1):
            of_side = np.flatnonzero(sides == 1 << level)
            offset = _cuboid(grid, (1 << level,) * 3)
            index.append((begin[of_side, None] + offset).reshape(-1))
            owner.append(np.repeat(owners[of_side], offset.size))
        owners = np.concatenate(owner)
        return _ints(self.op)[owners], np.concatenate(index), _ints(self.pen)[owners]


@dataclass
class Shapes:
    """Lines, boxes and single voxels: LINE, BOX and DOTS, whose voxels named are on the grid."""

    lines: list[tuple[int, int, int, int]] = field(default_factory=list)
    boxes: list[tuple[int, int, int, int]] = field(default_factory=list)
    dots: list[tuple[int, int | Ints, Ints]] = field(default_factory=list)

    def add_line(self, op: int, pen: int, begin: int, end: int) -> None:
        """Add a line between the voxels of two indices."""
        self.lines.append((op, pen, begin, end))

    def add_box(self, op: int, pen: int, begin: int, end: int) -> None:
        """Add a box between the voxels of two indices."""
        self.boxes.append((op, pen, begin, end))

    def add_dots(self, op: int, pen: int | Ints, index: Ints) -> None:
        """Add voxels by their indices, (n,), of one pen or each of its own, (n,)."""
        self.dots.append((op, pen, index))

    def expand(self, grid: Grid) -> Written:
        """Return the voxels of all shapes."""
        parts = [np.empty((3, 0), dtype=np.int64)]
        if self.dots:
            counts = [len(index) for _, _, index in self.dots]
            ops = np.repeat([op for op, _, _ in self.dots], counts)
            pens = [np.broadcast_to(pen, len(index)) for _, pen, index in self.dots]
            index = np.concatenate([index for _, _, index in self.dots])
            parts.append(np.stack((ops, index, np.concatenate(pens))))
        if self.lines:
            parts.append(self._expand_lines(grid))
        if self.boxes:
            parts.append(self._expand_boxes(grid))
        op, index, pen = np.concatenate(parts, axis=1)
        return op, index, pen

    def _expand_boxes(self, grid: Grid) -> Ints:
        op, pen, begin, end = np.array(self.boxes, dtype=np.int64).T
        a, b = grid.voxels_at(begin), grid.voxels_at(end)
        first = grid.index_of(np.minimum(a, b)).tolist()
        sides = (np.abs(a - b) + 1).tolist()
        found = [at + _cuboid(grid, each) for at, each in zip(first, sides, strict=True)]
        counts = list(map(len, found))
        return np.stack((op.repeat(counts), np.concatenate(found), pen.repeat(counts)))

    def _expand_lines(self, grid: Grid) -> Ints:
        op, pen, begin, end = np.array(self.lines, dtype=np.int64).T
        a = grid.voxels_at(begin).astype(np.int64)
        d = grid.voxels_at(end).astype(np.int64) - a
        length = np.abs(d).max(axis=1)
        line = np.repeat(np.arange(len(op)), length + 1)
        k = concat_ranges(np.zeros_like(length), length + 1)[:, None]
        whole = np.maximum(length, 1)[line][:, None]
        place = a[line] + (2 * k * d[line] + whole) // (2 * whole)
        return np.stack((op[line], grid.index_of(place), pen[line]))

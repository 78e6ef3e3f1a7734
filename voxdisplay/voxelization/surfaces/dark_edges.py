"""Crossings of a mesh's edges with mid-planes where no voxel is lit nearby.

Must not know what becomes of them.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from voxdisplay.compute.array_types import Bools, Ints
from voxdisplay.compute.kernel_backend import with_kernel
from voxdisplay.voxelization.surfaces.lit_mask import LitMask
from voxdisplay.voxelization.surfaces.mesh_topology import Topology
from voxdisplay.voxelization.surfaces.snapped_mesh import HALF, SHIFT, TRIANGLES_PER_BLOCK, UNIT
from voxdisplay.voxelization.surfaces.sparse_repeat import Repeats
from voxdisplay.voxelization.surfaces.triangle_blocks import TriangleBlock, triangle_blocks

_AFTER = [1, 2, 0]


@dataclass(frozen=True, slots=True, eq=False)
class EdgeCrossings:
    """Crossings of edges with mid-planes of one axis.

    Attributes
    ----------
    triangle, corner : (n,) int64 array
        A triangle, and at which of its corners the edge begins.
    plane : (n,) int64 array
        Number of the mid-plane.

    """

    triangle: Ints
    corner: Ints
    plane: Ints


@with_kernel
def dark_edges(mask: LitMask, topology: Topology) -> list[EdgeCrossings]:
    """Return the crossings of edges with mid-planes whose nearest voxel is dark, for x, y and z.

    Where a crossing is as near to another voxel, either may be asked.
    """
    none = np.empty(0, dtype=np.int64)
    found = [[EdgeCrossings(none, none, none)] for _ in range(3)]
    for block in triangle_blocks(topology.mesh, TRIANGLES_PER_BLOCK):
        for axis in range(3):
            found[axis].append(_dark_in_block(mask, topology, block, axis))
    return [_joined(parts) for parts in found]


def _joined(parts: list[EdgeCrossings]) -> EdgeCrossings:
    return EdgeCrossings(
        *(
            np.concatenate([getattr(part, field.name) for part in parts])
            for field in fields(parts[0])
        )
    )


def _dark_in_block(
    mask: LitMask, topology: Topology, block: TriangleBlock, axis: int
) -> EdgeCrossings:
    """Return the crossings of edges with mid-planes in dual faces whose nearest corner is dark."""
    rows = np.flatnonzero(block.first[axis] <= block.last[axis])
    u, v, w = (block.corners[(axis + k) % 3].take(rows, axis=1) for k in (1, 2, 0))
    start, end = w, w[_AFTER]
    low, high = start, end
    if not topology.has_inside:  # else each edge ascends in one of its triangles
        low, high = np.minimum(start, end), np.maximum(start, end)
    first = np.maximum((low + (UNIT - 1 - HALF)) >> SHIFT, 0)
    last = np.minimum((high - HALF) >> SHIFT, mask.sides[axis] - 1)
    edge = np.flatnonzero((first <= last) & (low < high))
    repeats = Repeats((last - first + 1).take(edge).astype(np.int64))
    plane = repeats.ranges(first.take(edge).astype(np.int64))
    begin = start.take(edge).astype(np.float64)
    rise = end.take(edge) - begin
    # From where the edge begins, so that steep slopes do no harm.
    run = plane * float(UNIT) + repeats.of(HALF - begin)
    columns = []
    for each in (u, v):
        base = each.take(edge).astype(np.float64)
        slope = (each[_AFTER].take(edge) - base) / rise
        found = run * repeats.of(slope)
        found += repeats.of(base - HALF)
        found *= 1 / UNIT
        columns.append(np.rint(found).astype(np.int64))
    dark = np.flatnonzero(~is_lit(mask, axis, columns[0], columns[1], plane))
    source = repeats.of(edge)[dark]
    corner = source // len(rows) if len(rows) else source
    triangle = rows.take(source - corner * len(rows)) + block.begin
    return EdgeCrossings(triangle, corner, plane[dark])


def is_lit(mask: LitMask, axis: int, i: Ints, j: Ints, level: Ints) -> Bools:
    """Return which voxels are in the box and lit."""
    nu, nv, nw = (mask.sides[(axis + k) % 3] for k in (1, 2, 0))
    lit = (i >= 0) & (i < nu) & (j >= 0) & (j < nv) & (level >= 0) & (level < nw)
    if lit.all():
        return mask.lit(mask.locate(axis, i, j, level))
    rows = np.flatnonzero(lit)
    lit[rows] = mask.lit(mask.locate(axis, i[rows], j[rows], level[rows]))
    return np.asarray(lit)

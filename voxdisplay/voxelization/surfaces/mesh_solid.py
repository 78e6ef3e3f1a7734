"""Solids of meshes: the voxels whose centres are inside.

Along each column of voxel centres the crossings with the mesh are counted. Meshes whose triangles
agree on an outside have a winding number, others a parity. Decisions are half-open: the mesh lies
an infinitesimal step lower than it is given, so that solids that tile space have voxels that tile.
Where a mesh has holes, columns along all axes vote, of which only those count that end outside.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Bools, Ints
from voxdisplay.voxelization.surfaces.column_crossings import ColumnCrossings, column_crossings
from voxdisplay.voxelization.surfaces.mesh_topology import Topology
from voxdisplay.voxelization.voxel_box import Triple

VOXELS_PER_SLAB = 1 << 24
_MAX_INT8 = 127

Counts = NDArray[np.signedinteger]


def solid_index(topology: Topology) -> tuple[Ints, tuple[str, ...]]:
    """Return the scan-order indices, ascending, of the voxels inside of a mesh, and notes."""
    sides = topology.mesh.sides
    axes = (2,) if topology.closed else (0, 1, 2)
    crossings = [column_crossings(topology, axis) for axis in axes]
    open_columns = 0
    found = []
    for first, slab, undecided in _slabs(crossings, topology.oriented, sides):
        index = np.flatnonzero(slab)
        index += first * sides[0] * sides[1]
        found.append(index)
        open_columns += undecided
    if topology.closed:
        return np.concatenate(found), ()
    columns = sum(sides[k] * sides[(k + 1) % 3] for k in range(3))
    note = f"{open_columns} of {columns} columns of voxels do not end outside and were not counted"
    return np.concatenate(found), (note,) if open_columns else ()


def _slabs(
    crossings: list[ColumnCrossings], oriented: bool, sides: Triple
) -> Iterator[tuple[int, Bools, int]]:
    """Yield slabs of planes along z: the first plane, what is inside [z, y, x], undecided columns.

    Only a slab is in memory at a time.
    """
    nx, ny, nz = sides
    height = max(1, VOXELS_PER_SLAB // (nx * ny))
    bounds = np.arange(0, nz, height)
    alone = len(crossings) == 1
    columns = [_columns_along(each, bounds, oriented, sides) for each in crossings]
    for first in bounds.tolist():
        votes: NDArray[np.int8] | None = None
        undecided = 0
        for each, is_z in zip(columns, (False, False, True), strict=False):
            inside, ends = next(each)
            if alone:
                yield first, inside, 0
                break
            vote = np.where(inside, np.int8(1), np.int8(-1))
            vote *= ends
            votes = vote if votes is None else votes + vote
            if first == 0 or not is_z:  # columns along z are the same in each slab
                undecided += int((~ends).sum())
        if votes is not None:
            yield first, votes > 0, undecided


def _columns_along(
    crossings: ColumnCrossings, bounds: Ints, oriented: bool, sides: Triple
) -> Iterator[tuple[Bools, Bools]]:
    """Yield for slabs what is inside, [z, y, x], and which columns end outside, to broadcast."""
    axis = crossings.axis
    z, y, x = _by_axes(crossings)
    nx, ny, nz = sides
    step = crossings.step
    column = crossings.i + sides[(axis + 1) % 3] * crossings.j
    width = sides[(axis + 1) % 3] * sides[(axis + 2) % 3]
    often = np.bincount(column, minlength=1).max(initial=0) > _MAX_INT8
    kind = np.dtype(np.int32 if often else np.int8)
    # In floating point, exact for all counts that fit into memory.
    total = np.bincount(column, step if oriented else None, minlength=width)
    ends = (total == 0) if oriented else (total.astype(np.int64) & 1 == 0)
    stops = np.append(bounds[1:], nz)
    slab = np.minimum(np.searchsorted(bounds, z, side="right") - 1, len(bounds) - 1)
    order = np.argsort(slab.astype(np.uint16), kind="stable") if len(bounds) > 1 else None
    cuts = np.searchsorted(slab if order is None else slab[order], np.arange(len(bounds) + 1))
    before = np.zeros((ny, nx), dtype=kind)
    for number, (first, stop) in enumerate(zip(bounds.tolist(), stops.tolist(), strict=True)):
        rows = slice(int(cuts[number]), int(cuts[number + 1]))
        chosen = rows if order is None else order[rows]
        shape = (stop - first + (axis == 2), ny + (axis == 1), nx + (axis == 0))
        change = np.zeros(shape, dtype=kind)
        place = ((z[chosen] - first) * shape[1] + y[chosen]) * shape[2] + x[chosen]
        np.add.at(change.reshape(-1), place, step[chosen].astype(kind))
        inside = _inside(change, axis, before, oriented)[: stop - first, :ny, :nx]
        if axis == 2:
            yield inside, ends.reshape(1, ny, nx)
        elif axis == 0:
            yield inside, ends.reshape(nz, ny, 1)[first:stop]
        else:
            yield inside, ends.reshape(nx, nz).T[first:stop, None, :]


def _by_axes(crossings: ColumnCrossings) -> tuple[Ints, Ints, Ints]:
    """Return coordinates z, y, x."""
    along = {
        crossings.axis: crossings.level,
        (crossings.axis + 1) % 3: crossings.i,
        (crossings.axis + 2) % 3: crossings.j,
    }
    return along[2], along[1], along[0]


def _inside(change: Counts, axis: int, before: Counts, oriented: bool) -> Bools:
    """Return where the running sum of changes along an axis is not 0, or is odd.

    Parameters
    ----------
    change : (nz, ny, nx) array
        Overwritten.
    axis : {0, 1, 2}
        Of x, y, z.
    before : (ny, nx) array
        For columns along z the sum below; the sum at the top afterwards.
    oriented : bool

    """
    # Plane by plane: a running sum over the slow axis of the whole would miss the cache each time.
    inside = np.empty(change.shape, dtype=bool)
    if axis == 2:
        for plane, result in zip(change[:-1], inside, strict=False):
            before += plane
            np.not_equal(before if oriented else before & 1, 0, out=result)
        before += change[-1]
        return inside
    for plane, result in zip(change, inside, strict=True):
        if plane.any():
            total = plane.cumsum(axis=0 if axis == 1 else 1, dtype=plane.dtype)
            np.not_equal(total if oriented else total & 1, 0, out=result)
        else:
            result[...] = False
    return inside

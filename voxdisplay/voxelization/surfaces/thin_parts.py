"""Voxels for parts of a mesh that pass between all mid-lines: tubes, needles, grains.

The crossings with mid-lines alone lose what is thinner than a voxel. A dual face is a unit square
between four voxel centres, a dual cell a unit cube between eight. Where an edge of the mesh meets a
dual face without a lit corner, the corner nearest to such a meeting is lit; where all of a part is
inside a dual cell without a lit corner, the corner nearest to its middle. Then every point of the
mesh is in a dual cell with a lit corner, so within 1 of its centre in max norm, and the voxels of
each connected part are 26-connected. Edges between coplanar triangles do not count, so that it does
not matter how flat parts are cut into triangles.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Bools, Floats, Ints
from voxdisplay.voxelization.surfaces.dark_edges import EdgeCrossings, dark_edges, is_lit
from voxdisplay.voxelization.surfaces.lit_mask import LitMask
from voxdisplay.voxelization.surfaces.mesh_topology import Topology
from voxdisplay.voxelization.surfaces.shape_edges import is_shape_edge
from voxdisplay.voxelization.surfaces.silhouettes import silhouette_triangles
from voxdisplay.voxelization.surfaces.snapped_mesh import HALF, SHIFT, TRIANGLES_PER_BLOCK, UNIT
from voxdisplay.voxelization.surfaces.triangle_blocks import TriangleBlock, triangle_blocks
from voxdisplay.voxelization.voxel_box import Triple

# Distances that differ by less are the same.
SAME = 1e-9
_AFTER = [1, 2, 0]


@dataclass(frozen=True, slots=True, eq=False)
class LitBy:
    """Voxels, and the points of triangles that light them.

    Attributes
    ----------
    place : (n,) int64 array
        See `LitMask.locate`.
    triangle : (n,) int64 array
    weights : (3, n) float64 array
        Barycentric coordinates of the points, by corner.

    """

    place: Ints
    triangle: Ints
    weights: Floats


def mark_thin_parts(
    mask: LitMask, topology: Topology, walls: Triple, *, complete: bool
) -> list[LitBy]:
    """Light voxels for the parts of a mesh that its triangles' crossings miss; return them.

    Parameters
    ----------
    mask : LitMask
        With the voxels of the triangles: see `mesh_shell.mark_shell`.
    topology : Topology
    walls : (int, int, int)
        As of `mesh_shell.mark_shell`.
    complete : bool
        Whether the mask has all voxels near to those that matter.

    """
    lit: list[LitBy] = []
    if not (complete and topology.has_inside) or _has_dark_faces(mask, topology):
        for axis, dark in enumerate(dark_edges(mask, topology)):
            if len(dark.plane):
                lit += _faces_to_light(mask, topology, walls, axis, dark)
    for each in lit:
        mask.mark(each.place)
    parts = [_grains(mask, block) for block in triangle_blocks(topology.mesh, TRIANGLES_PER_BLOCK)]
    grains = [part for part in parts if part is not None]
    if grains:
        lit.append(_cells_to_light(mask, topology, walls, np.concatenate(grains, axis=1)))
        mask.mark(lit[-1].place)
    return lit


def _has_dark_faces(mask: LitMask, topology: Topology) -> bool:
    """Return whether edges of a closed mesh meet dual faces without a lit corner."""
    mesh = topology.mesh
    part = replace(topology, mesh=mesh.only(silhouette_triangles(mesh)))
    return any(
        len(_dark_faces(mask, part, axis, dark).rows)
        for axis, dark in enumerate(dark_edges(mask, part))
    )


@dataclass(frozen=True, slots=True, eq=False)
class DarkFaces:
    """Crossings of edges with dual faces that have no lit corner.

    Attributes
    ----------
    rows : (n,) int64 array
        Which crossings of those given.
    a, b : (N,) int64 array
        Vertices at the ends of the edges of all of them.
    share : (N,) float64 array
        How far from a to b.
    i, j : (N,) int64 array
        Columns of the dual faces.
    corners : list of (i, j, distance, exists)
        See `_corners`.
    on_border : (2, N) bool array
        Whether they are on a border along u or v.

    """

    rows: Ints
    a: Ints
    b: Ints
    share: Floats
    i: Ints
    j: Ints
    corners: list[tuple[Ints, Ints, Floats, Bools]]
    on_border: Bools


def _dark_faces(
    mask: LitMask, topology: Topology, axis: int, crossings: EdgeCrossings
) -> DarkFaces:
    """Return which crossings are in dual faces without a lit corner, exactly."""
    mesh = topology.mesh
    a = mesh.faces[crossings.triangle, crossings.corner]
    b = mesh.faces[crossings.triangle, (crossings.corner + 1) % 3]
    rise = mesh.points[axis].take(b).astype(np.int64) - mesh.points[axis].take(a)
    run = (crossings.plane << SHIFT) + HALF - mesh.points[axis].take(a)
    run, rise = np.where(rise < 0, -run, run), np.abs(rise)
    i, s = _cell_and_fraction(mesh.points[(axis + 1) % 3], a, b, run, rise)
    j, t = _cell_and_fraction(mesh.points[(axis + 2) % 3], a, b, run, rise)
    corners = list(_corners(i, j, s, t))
    lit = np.zeros(len(i), dtype=bool)
    for p, q, _, exists in corners:
        lit |= exists & is_lit(mask, axis, p, q, crossings.plane)
    on_border = np.stack((s == 0, t == 0))
    return DarkFaces(np.flatnonzero(~lit), a, b, run / rise, i, j, corners, on_border)


def _faces_to_light(
    mask: LitMask, topology: Topology, walls: Triple, axis: int, crossings: EdgeCrossings
) -> Iterator[LitBy]:
    """Yield the corners to light in dual faces without a lit corner."""
    faces = _dark_faces(mask, topology, axis, crossings)
    rows, corners = faces.rows, faces.corners
    if not len(rows):
        return
    rows = rows[is_shape_edge(topology.mesh, faces.a[rows], faces.b[rows])]
    if not len(rows):
        return
    # A dual face has a number; edges and corners of it count as others.
    group = _groups(np.stack((crossings.plane, faces.i, faces.j, *faces.on_border))[:, rows])
    distance = np.stack([np.where(exists, d, np.inf)[rows] for _, _, d, exists in corners])
    for place, near in _nearest_corners(
        mask,
        None if topology.has_inside else walls,
        axis,
        group,
        distance,
        [p[rows] for p, _, _, _ in corners],
        [q[rows] for _, q, _, _ in corners],
        crossings.plane[rows],
    ):
        chosen = rows[near]
        weights = np.zeros((3, len(chosen)))
        share = faces.share[chosen]
        corner, columns = crossings.corner[chosen], np.arange(len(chosen))
        weights[corner, columns] = 1 - share
        weights[(corner + 1) % 3, columns] = share
        yield LitBy(place, crossings.triangle[chosen], weights)


def _cell_and_fraction(
    coordinates: NDArray[np.int32], a: Ints, b: Ints, run: Ints, rise: Ints
) -> tuple[Ints, Floats]:
    """Return the number of the centre below a crossing, and how far above it that is, 0 to 1."""
    start = coordinates.take(a).astype(np.int64)
    whole = (start - HALF) * rise + (coordinates.take(b) - start) * run
    unit = rise << SHIFT
    cell = whole // unit
    return cell, (whole - cell * unit) / unit


def _corners(i: Ints, j: Ints, s: Floats, t: Floats) -> Iterator[tuple[Ints, Ints, Floats, Bools]]:
    """Yield the corners of dual faces, the squared distances from them, and whether they exist.

    At a crossing on an edge of a dual face, only that edge's corners count.
    """
    for up_u in (0, 1):
        for up_v in (0, 1):
            distance = (s - up_u) ** 2 + (t - up_v) ** 2
            exists = ((s > 0) if up_u else np.ones(len(s), dtype=bool)) & ((t > 0) | (not up_v))
            yield i + up_u, j + up_v, distance, exists


def _groups(key: Ints) -> Ints:
    """Return numbers, (n,), that are equal where all rows of a key, (k, n), are."""
    order = np.lexsort(key)
    ordered = key[:, order]
    group = np.empty(len(order), dtype=np.int64)
    group[order] = np.cumsum(np.append(0, (ordered[:, 1:] != ordered[:, :-1]).any(axis=0)))[
        : len(order)
    ]
    return group


def _nearest_corners(
    mask: LitMask,
    walls: Triple | None,
    axis: int,
    group: Ints,
    distance: Floats,
    i: list[Ints],
    j: list[Ints],
    level: Ints,
) -> Iterator[tuple[Ints, Ints]]:
    """Yield places of the corners that are nearest in their group, and the rows they belong to.

    Of several that are as near, closed and oriented meshes light all, so that mirrored meshes have
    mirrored voxels; others, which have ``walls``, the upper one, but none beyond an upper wall, as
    on the faces of voxels.
    """
    least = np.full(int(group.max()) + 1, np.inf)
    for each in distance:
        np.minimum.at(least, group, each)
    done = np.zeros(len(least), dtype=bool)
    sides = mask.sides[(axis + 1) % 3], mask.sides[(axis + 2) % 3]
    for beyond, k in itertools.product((False, True), reversed(range(len(distance)))):
        near = distance[k] <= least[group] + SAME
        if walls:
            high = (i[k] >= walls[(axis + 1) % 3]) | (j[k] >= walls[(axis + 2) % 3])
            near &= ~done[group] & (high == beyond)
        elif beyond:
            return
        rows = np.flatnonzero(near)
        done[group[rows]] = True
        p, q = i[k][rows], j[k][rows]
        inside = (p >= 0) & (p < sides[0]) & (q >= 0) & (q < sides[1])
        inside &= (level[rows] >= 0) & (level[rows] < mask.sides[axis])
        place = mask.locate(axis, p[inside], q[inside], level[rows][inside])
        yield place, rows[inside]


def _grains(mask: LitMask, block: TriangleBlock) -> Ints | None:
    """Return low and high bounds and numbers of triangles in dual cells without a lit corner.

    (7, n), or None if there are none. Those in a wall between cells belong to the wall.
    """
    sides = np.array(mask.sides)[:, None]
    low, high = block.corners.min(axis=1), block.corners.max(axis=1)
    first, last = (low + (UNIT - 1 - HALF)) >> SHIFT, (high - HALF) >> SHIFT
    inner = ((first > last) | (low == high)).all(axis=0)
    inner &= ((low >> SHIFT) < sides).all(axis=0) & (low >= 0).all(axis=0)
    rows = np.flatnonzero(inner)
    if not len(rows):
        return None
    x, y, z = block.corners[:, 0, rows].astype(np.int64) >> SHIFT
    rows = rows[~is_lit(mask, 2, x, y, z)]
    if not len(rows):
        return None
    low, high = low[:, rows].astype(np.int64), high[:, rows].astype(np.int64)
    cell, on_wall = _dual_cells(low)
    lit = np.zeros(len(rows), dtype=bool)
    for up in np.ndindex(2, 2, 2):
        corner = cell + np.array(up)[:, None]
        exists = ~(on_wall & np.array(up, dtype=bool)[:, None]).any(axis=0)
        lit |= exists & is_lit(mask, 2, *corner)
    lit |= _zero_area(block.corners[:, :, rows].astype(np.int64))
    if lit.all():
        return None
    return np.concatenate((low[:, ~lit], high[:, ~lit], rows[None, ~lit] + block.begin))


def _zero_area(corners: Ints) -> Bools:
    """Return which triangles, (3, 3, n) by axis and corner, have no area."""
    along, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray(
        (along[_AFTER] * other[[2, 0, 1]] == along[[2, 0, 1]] * other[_AFTER]).all(axis=0)
    )


def _dual_cells(point: Ints) -> tuple[Ints, Bools]:
    """Return the centres below points, (3, n), and whether points are level with them."""
    return (point - HALF) >> SHIFT, (point - HALF) & (UNIT - 1) == 0


def _cells_to_light(mask: LitMask, topology: Topology, walls: Triple, grains: Ints) -> LitBy:
    """Return the corners nearest to the middle of what is in each dual cell."""
    low, high = grains[:3], grains[3:6]
    cell, on_wall = _dual_cells(low)
    group = _groups(np.concatenate((cell, on_wall)))
    size = int(group.max()) + 1
    bounds = np.full((2, 3, size), np.iinfo(np.int64).max)
    for axis in range(3):
        np.minimum.at(bounds[0, axis], group, low[axis])
        np.minimum.at(bounds[1, axis], group, -high[axis])
    middle = bounds[0] - bounds[1]  # twice that
    # On a voxel's face both sides are as near.
    level, tied = middle >> (SHIFT + 1), middle & (2 * UNIT - 1) == 0
    if not topology.has_inside:
        level -= tied & (level == np.array(walls)[:, None])
    first = np.full(size, np.iinfo(np.int64).max)
    np.minimum.at(first, group, grains[6])
    places, triangles = [], []
    for down in np.ndindex(2, 2, 2):
        if any(down) and not topology.has_inside:
            break
        rows = (tied | (np.array(down) == 0)[:, None]).all(axis=0)
        x, y, z = (level - np.array(down)[:, None])[:, rows]
        inside = (x >= 0) & (x < mask.sides[0]) & (y >= 0) & (y < mask.sides[1])
        inside &= (z >= 0) & (z < mask.sides[2])
        places.append(mask.locate(2, x[inside], y[inside], z[inside]))
        triangles.append(first[rows][inside])
    triangle = np.concatenate(triangles)
    return LitBy(np.concatenate(places), triangle, np.full((3, len(triangle)), 1 / 3))

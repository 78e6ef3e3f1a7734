"""Points of a mesh that stand for the voxels they light: the nearest to each voxel's centre."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from voxdisplay.compute.array_types import Bools, Floats, Ints
from voxdisplay.voxelization.surfaces.lit_mask import LitMask
from voxdisplay.voxelization.surfaces.mesh_shell import lit_levels
from voxdisplay.voxelization.surfaces.mesh_topology import Topology
from voxdisplay.voxelization.surfaces.midline_crossings import midline_crossings
from voxdisplay.voxelization.surfaces.thin_parts import LitBy
from voxdisplay.voxelization.surfaces.triangle_blocks import triangle_blocks
from voxdisplay.voxelization.voxel_box import Triple

# Distances that differ by less are the same: then the triangle with the lowest number counts.
SAME = 1e-9
_LAST = np.iinfo(np.int64).max


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceSamples:
    """Points of triangles, one for each voxel.

    Attributes
    ----------
    triangle : (N,) int64 array
    weights : (3, N) float64 array
        Barycentric coordinates by corner.

    """

    triangle: Ints
    weights: Floats

    def select(self, kept: Bools | Ints) -> SurfaceSamples:
        """Return some of the samples."""
        return SurfaceSamples(self.triangle[kept], self.weights[:, kept])

    def renumbered(self, triangles: Ints) -> SurfaceSamples:
        """Return the samples with other numbers of triangles."""
        return SurfaceSamples(triangles[self.triangle], self.weights)

    def spread(self, index: Ints, inside: Ints, sides: Triple) -> SurfaceSamples | None:
        """Return samples for the voxels of a solid: those of the nearest above or below.

        Parameters
        ----------
        index, inside : (N,), (M,) int64 array
            Scan-order indices of the shell and of the solid, ascending.
        sides : (int, int, int)
            Of the box.

        """
        if not len(index):
            return None
        plane, height = sides[0] * sides[1], sides[2]

        def upright(scan: Ints) -> Ints:
            z = scan // plane
            return np.asarray((scan - z * plane) * height + z)

        known, wanted = upright(index), upright(inside)
        order = np.argsort(known)
        known = known[order]
        above = np.searchsorted(known, wanted).clip(0, len(known) - 1)
        below = (above - 1).clip(0)
        far = np.abs(known[above] - wanted) >= np.abs(wanted - known[below])
        return self.select(order[np.where(far, below, above)])


def sample_surface(
    mask: LitMask, topology: Topology, walls: Triple, index: Ints, thin: list[LitBy]
) -> SurfaceSamples:
    """Return the points of a mesh for the voxels of its shell.

    Parameters
    ----------
    mask : LitMask
    topology : Topology
    walls : (int, int, int)
        As of `mesh_shell.mark_shell`.
    index : (N,) int64 array
        Scan-order indices of the lit voxels, ascending.
    thin : list of LitBy
        Points that light voxels besides.

    """
    row, distance, triangle, weights = (
        np.concatenate(parts, axis=-1)
        for parts in zip(*_crossing_points(mask, topology, walls, index, thin), strict=True)
    )
    least = np.full(len(index), np.inf)
    np.minimum.at(least, row, distance)
    near = np.flatnonzero(distance <= least[row] + SAME)
    row, triangle, weights = row[near], triangle[near], weights[:, near]
    first = np.full(len(index), _LAST)
    np.minimum.at(first, row, triangle)
    chosen = np.flatnonzero(triangle == first[row])[::-1]  # the first of equal ones is set last
    result = np.zeros((3, len(index)))
    result[:, row[chosen]] = weights[:, chosen]
    return SurfaceSamples(first, result)


def _crossing_points(
    mask: LitMask, topology: Topology, walls: Triple, index: Ints, thin: list[LitBy]
) -> list[tuple[Ints, Floats, Ints, Floats]]:
    """Return rows of voxels, distances from their centres, triangles and weights, in blocks."""
    found: list[tuple[Ints, Floats, Ints, Floats]] = []
    for block in triangle_blocks(topology.mesh):
        for axis in range(3):
            for crossings in midline_crossings(block, axis):
                level = lit_levels(crossings, topology, walls[axis])
                inside = np.flatnonzero((level >= 0) & (level < mask.sides[axis]))
                level = level[inside]
                place = mask.locate(axis, crossings.i[inside], crossings.j[inside], level)
                row = np.searchsorted(index, mask.scan_index(place))
                distance = np.abs(crossings.depth()[inside] - (level + 0.5))
                weights = (np.stack(crossings.weights) / crossings.area)[:, inside]
                found.append((row, distance, crossings.triangle[inside], weights))
    for lit in thin:
        row = np.searchsorted(index, mask.scan_index(lit.place))
        found.append((row, np.full(len(row), 1.0), lit.triangle, lit.weights))
    none = np.empty(0, dtype=np.int64)
    found.append((none, np.empty(0), none, np.empty((3, 0))))
    return found

"""Quality figures of voxel sets, by the geometry of the body that they show."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from voxdisplay.bodies.ball_chain import BallChain
from voxdisplay.bodies.body import Body, Kind
from voxdisplay.bodies.geometry import Geometry, TriangleMesh
from voxdisplay.bodies.height_field import HeightFunction
from voxdisplay.bodies.implicit import ImplicitFunction
from voxdisplay.bodies.quadrics import QuadricPatch, QuadricPatches
from voxdisplay.compute.array_types import Floats, Ints
from voxdisplay.voxelization.flood_fill import count_enclosed
from voxdisplay.voxelization.measure_chain import chain_distances
from voxdisplay.voxelization.measure_fields import Field, field_distances, field_tunnels
from voxdisplay.voxelization.measure_mesh import (
    VoxelLookup,
    mesh_cover,
    mesh_distances,
    mesh_minimum,
    mesh_tunnels,
)
from voxdisplay.voxelization.voxel_box import VoxelBox

_STEPS = np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1)])


@dataclass(frozen=True)
class BodyReport:
    """Quality figures of a voxel set.

    Attributes
    ----------
    voxels : int
        Number of voxels.
    kind : str
        ``"surface"``, ``"solid"``, ``"volume"`` or ``"points"``.
    e_max, e_av : float or None
        Greatest and mean distance of voxel centres from the true surface, in voxels; of solids,
        of the voxels with a dark 6-neighbour. None for volumes and points.
    tunnels : int or None
        Number of lines between the centres of two dark 6-neighbours that cross the surface: at 0,
        no 6-connected path leads through. None for volumes and points.
    cover : float or None
        For meshes: greatest distance, in max norm, of a point of the surface from a lit centre.
    minimum : int or None
        For shells of meshes: size of the smallest set of voxels without tunnels, however far from
        the surface. None if that is too large to be found.
    enclosed : int or None
        Number of dark voxels to which no 6-connected path leads from outside; None if the set is
        too large to be filled.
    seconds : float
        Time spent on the voxels.
    certified : bool
        Whether it was asked for, and proven, that no part of the body is missed.

    """

    voxels: int
    kind: Kind
    e_max: float | None
    e_av: float | None
    tunnels: int | None
    cover: float | None
    enclosed: int | None
    seconds: float
    certified: bool = False
    minimum: int | None = None

    @property
    def thickness(self) -> float | None:
        """Number of voxels per voxel of the smallest set: 1 is as thin as can be."""
        return self.voxels / self.minimum if self.minimum else None


def report_on(
    voxels: Ints, box: VoxelBox, kind: Kind, body: Body | None, seconds: float
) -> BodyReport:
    """Return the figures of a voxel set.

    Parameters
    ----------
    voxels : (N, 3) int64 array
        Distinct.
    box : VoxelBox
        What the body was clipped to.
    kind : {"surface", "solid", "volume", "points"}
    body : Body, optional
        What the voxels show.
    seconds : float
        Time spent on them.

    """
    distances: Floats = np.empty(0)
    tunnels: int | None = None
    cover: float | None = None
    minimum: int | None = None
    if body is not None and kind in {"surface", "solid"}:
        geometry = body.geometry(box.corners)
        tunnels = 0
        if len(voxels):
            outer = _outer_layer(voxels, box) if kind == "solid" else voxels
            # A voxel of a solid that has a dark neighbour has the surface before its centre.
            distances = _distances(outer, geometry, 1.0 if kind == "solid" else 0.5)
            tunnels = _tunnels(voxels, box, geometry)
            if isinstance(geometry, TriangleMesh) and kind == "surface":
                inside = _inside(geometry, box)
                cover = mesh_cover(voxels, geometry.vertices, inside) if len(inside) else None
                minimum = mesh_minimum(geometry.vertices, geometry.faces, box)
    return BodyReport(
        voxels=len(voxels),
        kind=kind,
        e_max=float(distances.max()) if len(distances) else None,
        e_av=float(distances.mean()) if len(distances) else None,
        tunnels=tunnels,
        cover=cover,
        minimum=minimum,
        enclosed=count_enclosed(voxels),
        seconds=seconds,
    )


def _outer_layer(voxels: Ints, box: VoxelBox) -> Ints:
    """Return the voxels of a solid that have a dark 6-neighbour, (n, 3); all, if none has."""
    lookup = VoxelLookup(voxels)
    inner = np.ones(len(voxels), dtype=bool)
    for step in _STEPS:
        for each in (step, -step):
            inner &= (lookup.rows(voxels + each) >= 0) | ~box.inside(voxels + each)
    return voxels[~inner] if not inner.all() else voxels


def _inside(mesh: TriangleMesh, box: VoxelBox) -> Ints:
    """Return the triangles that are in the box with all their corners."""
    low, high = box.corners
    inside = np.asarray(((mesh.vertices >= low) & (mesh.vertices <= high)).all(axis=1))
    return mesh.faces[inside[mesh.faces].all(axis=1)]


def _distances(voxels: Ints, geometry: Geometry, expected: float) -> Floats:
    if isinstance(geometry, TriangleMesh):
        return mesh_distances(voxels, geometry.vertices, geometry.faces)
    centers = np.add(voxels, 0.5, dtype=np.float64)
    if isinstance(geometry, BallChain):
        return chain_distances(centers, geometry, expected)
    return field_distances(centers, _fields(geometry))


def _tunnels(voxels: Ints, box: VoxelBox, geometry: Geometry) -> int:
    if isinstance(geometry, TriangleMesh):
        return mesh_tunnels(voxels, geometry.vertices, geometry.faces, box)
    # Of the dark voxels near lit ones; further away a surface would have lit some.
    lookup = VoxelLookup(voxels)
    near = np.array(list(np.ndindex(3, 3, 3))) - 1
    cells = np.concatenate([voxels + step for step in near])
    cells = cells[box.inside(cells)]
    index = np.sort(box.index_of(cells))
    index = index[np.append(True, index[1:] != index[:-1])]
    cells = box.voxels_at(index).astype(np.int64)
    cells = cells[lookup.rows(cells) < 0]
    fields = _fields(geometry)
    if len(fields) == 1 and fields[0][1] is None:
        return _sign_changes(cells, fields[0][0])
    total = 0
    for step in _STEPS:
        after = cells + step
        dark = (lookup.rows(after) < 0) & box.inside(after)
        crossed = field_tunnels(cells[dark] + 0.5, after[dark] + 0.5, fields)
        total += int(crossed.sum())
    return total


def _sign_changes(cells: Ints, field: Field) -> int:
    """Return the number of pairs of 6-neighbours, among cells, between which a function changes."""
    if not len(cells):
        return 0
    lookup = VoxelLookup(cells)
    with np.errstate(all="ignore"):
        value = field(np.add(cells, 0.5, dtype=np.float64))
    total = 0
    for step in _STEPS:
        after = lookup.rows(cells + step)
        one, two = value[after >= 0], value[after[after >= 0]]
        total += int((((one < 0) != (two < 0)) & np.isfinite(one) & np.isfinite(two)).sum())
    return total


def _fields(geometry: Geometry) -> Sequence[tuple[Field, Field | None]]:
    """Return functions that vanish on a surface, and those that clip it."""
    if isinstance(geometry, QuadricPatches):
        return [_patch_field(patch) for patch in geometry.patches]
    if isinstance(geometry, ImplicitFunction):
        function = geometry.function
        return [(lambda p: np.asarray(function(p[:, 0], p[:, 1], p[:, 2])), None)]
    if isinstance(geometry, BallChain):
        return [(lambda p: geometry.nearest(p).distance, None)]
    if isinstance(geometry, HeightFunction):
        value, low, high = geometry.value, geometry.low, geometry.high
        return [
            (
                lambda p: p[:, 2] - np.asarray(value(p[:, 0], p[:, 1])),
                lambda p: np.maximum(low - p[:, :2], p[:, :2] - high).max(axis=1),
            )
        ]
    return []


def _patch_field(patch: QuadricPatch) -> tuple[Field, Field | None]:
    clips = patch.clips
    if not clips:
        return patch.surface, None
    clip: Callable[[Floats], Floats] = lambda p: np.max([each(p) for each in clips], axis=0)  # noqa: E731
    return patch.surface, clip

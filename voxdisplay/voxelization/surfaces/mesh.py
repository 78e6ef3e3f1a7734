"""Voxeliser of triangle meshes: shells by crossings with mid-lines, solids by columns."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.compute import kernel_backend
from voxdisplay.voxelization.surfaces.lit_mask import lit_mask
from voxdisplay.voxelization.surfaces.mesh_attributes import has_attributes, interpolate
from voxdisplay.voxelization.surfaces.mesh_shell import mark_shell
from voxdisplay.voxelization.surfaces.mesh_solid import solid_index
from voxdisplay.voxelization.surfaces.mesh_topology import Topology, analyse
from voxdisplay.voxelization.surfaces.snapped_mesh import snap
from voxdisplay.voxelization.surfaces.surface_samples import SurfaceSamples, sample_surface
from voxdisplay.voxelization.surfaces.thin_parts import mark_thin_parts
from voxdisplay.voxelization.voxel_box import Triple, VoxelBox
from voxdisplay.voxelization.voxel_set import VoxelSet

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from voxdisplay.bodies.body import Body
    from voxdisplay.bodies.geometry import TriangleMesh
    from voxdisplay.compute.array_types import Floats, Ints

_MARGIN = 2


def voxelize_mesh(
    geometry: TriangleMesh,
    box: VoxelBox,
    body: Body,
    *,
    certified: bool = False,
) -> VoxelSet:
    """Return the voxels of a mesh inside a box: see `body_voxelization.Voxeliser`."""
    if not len(geometry.vertices):  # as of a surface of which nothing is in the box
        nothing = {name: values[:0] for name, values in geometry.parameters.items()}
        proven = certified and geometry.follows_body
        return VoxelSet(
            box, np.empty(0, dtype=np.int64), body.kind, None, nothing, certified=proven
        )
    mesh = snap(geometry, box)
    kernel_backend.enable_if_worthwhile(len(mesh.faces))
    topology = analyse(mesh)
    # A sheet has a boundary, and maybe no outside, by its nature; only a solid needs them.
    said = body.kind == "solid" or not geometry.is_sheet
    notes = list(_topology_notes(topology)) if said else []
    solid = body.kind == "solid"
    samples = None
    if not solid or has_attributes(geometry):
        index, samples = shell(topology, box.sides, sampled=has_attributes(geometry))
    if solid:
        inside, more = solid_index(topology)
        notes += more
        if samples is not None:
            samples = samples.spread(index, inside, box.sides)
        index = inside
    colors: NDArray[np.uint8] | None = None
    parameters: dict[str, Floats] = {}
    if samples is not None:
        given = samples if topology.triangles is None else samples.renumbered(topology.triangles)
        colors, parameters = interpolate(geometry, given)
    return VoxelSet(
        box,
        index,
        body.kind,
        colors,
        parameters,
        tuple(notes),
        certified=certified and geometry.follows_body,
    )


def _topology_notes(topology: Topology) -> Iterator[str]:
    """Yield what is wrong with a mesh."""
    if topology.doubled:
        yield f"{topology.doubled} triangles that occur more than once were left out"
    if topology.open_edges:
        yield f"the mesh is not closed: {topology.open_edges} open edges"
    elif not topology.oriented:
        yield "the triangles do not agree on an outside"


def shell(
    topology: Topology, sides: Triple, *, sampled: bool = False
) -> tuple[Ints, SurfaceSamples | None]:
    """Return the scan-order indices, ascending, of the voxels of a shell in its mesh's box.

    Parameters
    ----------
    topology : Topology
    sides : (int, int, int)
        Of the mesh's box.
    sampled : bool
        Return the points of the mesh, too, that are nearest to the voxels' centres.

    """
    within = topology.mesh.is_within()
    walls = sides
    if not within:
        # Beyond the box too, so that clipping commutes with the search for thin parts: voxels near
        # cells that hold a part, and voxels near those.
        topology = replace(topology, mesh=topology.mesh.expanded(_MARGIN))
        walls = (sides[0] + _MARGIN, sides[1] + _MARGIN, sides[2] + _MARGIN)
    mask = lit_mask(topology.mesh.sides)
    whole = mark_shell(mask, topology, walls)
    thin = mark_thin_parts(mask, topology, walls, complete=whole or not within)
    index = mask.index()
    samples = sample_surface(mask, topology, walls, index, thin) if sampled else None
    if within:
        return index, samples
    box = VoxelBox.of_grid(sides)
    voxels = box.expanded(_MARGIN).voxels_at(index)
    kept = box.inside(voxels)
    return box.index_of(voxels[kept]), samples.select(kept) if samples else None

"""Voxeliser of triangle meshes: shells by crossings with mid-lines, solids by columns."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from voxdisplay.voxelization.surfaces.lit_mask import lit_mask
from voxdisplay.voxelization.surfaces.mesh_shell import mark_shell
from voxdisplay.voxelization.surfaces.mesh_solid import solid_index
from voxdisplay.voxelization.surfaces.mesh_topology import Topology, analyse
from voxdisplay.voxelization.surfaces.snapped_mesh import snap
from voxdisplay.voxelization.surfaces.thin_parts import mark_thin_parts
from voxdisplay.voxelization.voxel_box import Triple, VoxelBox
from voxdisplay.voxelization.voxel_set import VoxelSet

if TYPE_CHECKING:
    from voxdisplay.bodies.body import Body
    from voxdisplay.bodies.geometry import TriangleMesh
    from voxdisplay.compute.array_types import Ints


def voxelize_mesh(
    geometry: TriangleMesh,
    box: VoxelBox,
    body: Body,
    *,
    certified: bool,  # noqa: ARG001 - exact anyway
) -> VoxelSet:
    """Return the voxels of a mesh inside a box: see `body_voxelization.Voxeliser`."""
    mesh = snap(geometry, box)
    topology = analyse(mesh)
    notes = list(_topology_notes(topology))
    if body.kind == "solid":
        index, more = solid_index(topology)
        notes += more
    else:
        index = shell_index(topology, box.sides)
    return VoxelSet(box, index, body.kind, notes=tuple(notes))


def _topology_notes(topology: Topology) -> Iterator[str]:
    """Yield what is wrong with a mesh."""
    if topology.doubled:
        yield f"{topology.doubled} triangles that occur more than once were left out"
    if topology.open_edges:
        yield f"the mesh is not closed: {topology.open_edges} open edges"
    elif not topology.oriented:
        yield "the triangles do not agree on an outside"


def shell_index(topology: Topology, sides: Triple) -> Ints:
    """Return the scan-order indices, ascending, of the voxels of a shell in its mesh's box."""
    if topology.mesh.is_within():
        mask = lit_mask(sides)
        mark_shell(mask, topology, sides)
        mark_thin_parts(mask, topology)
        return mask.index()
    # Beyond the box too, so that clipping commutes with the search for thin parts.
    nx, ny, nz = sides
    topology = replace(topology, mesh=topology.mesh.expanded(1))
    mask = lit_mask(topology.mesh.sides)
    mark_shell(mask, topology, (nx + 1, ny + 1, nz + 1))
    mark_thin_parts(mask, topology)
    margin = VoxelBox((-1, -1, -1), (nx + 1, ny + 1, nz + 1))
    voxels = margin.voxels_at(mask.index())
    box = VoxelBox.of_grid(sides)
    return box.index_of(voxels[box.inside(voxels)])

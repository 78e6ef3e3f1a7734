"""Surfaces, solids and voxel models as values. Must not know displays, frames or voxelisation."""

from voxdisplay.bodies.body import Body, TransformedBody
from voxdisplay.bodies.mesh import Box, Mesh

__all__ = ["Body", "Box", "Mesh", "TransformedBody"]

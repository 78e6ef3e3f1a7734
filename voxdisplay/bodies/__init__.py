"""Surfaces, solids and voxel models as values. Must not know displays, frames or voxelisation."""

from voxdisplay.bodies.body import Body, TransformedBody
from voxdisplay.bodies.height_field import HeightField
from voxdisplay.bodies.implicit import Implicit
from voxdisplay.bodies.mesh import Box, Mesh, Polygon, Triangle
from voxdisplay.bodies.primitives import (
    Cone,
    Cylinder,
    Disc,
    Ellipsoid,
    Plane,
    Sphere,
    SphericalTriangle,
)
from voxdisplay.bodies.scatter import Scatter
from voxdisplay.bodies.surface import Surface
from voxdisplay.bodies.text import Text
from voxdisplay.bodies.tube import Torus, Tube
from voxdisplay.bodies.volume import Volume, VoxelModel

__all__ = [
    "Body",
    "Box",
    "Cone",
    "Cylinder",
    "Disc",
    "Ellipsoid",
    "HeightField",
    "Implicit",
    "Mesh",
    "Plane",
    "Polygon",
    "Scatter",
    "Sphere",
    "SphericalTriangle",
    "Surface",
    "Text",
    "Torus",
    "TransformedBody",
    "Triangle",
    "Tube",
    "Volume",
    "VoxelModel",
]

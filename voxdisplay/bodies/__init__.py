"""Surfaces, solids and voxel models as values. Must not know displays, frames or voxelisation.

Names are imported when they are first used: a command that draws curves loads no body.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
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

# The module of each name.
_MODULES = {
    "Body": "body",
    "TransformedBody": "body",
    "HeightField": "height_field",
    "Implicit": "implicit",
    "Box": "mesh",
    "Mesh": "mesh",
    "Polygon": "mesh",
    "Triangle": "mesh",
    "Cone": "primitives",
    "Cylinder": "primitives",
    "Disc": "primitives",
    "Ellipsoid": "primitives",
    "Plane": "primitives",
    "Sphere": "primitives",
    "SphericalTriangle": "primitives",
    "Scatter": "scatter",
    "Surface": "surface",
    "Text": "text",
    "Torus": "tube",
    "Tube": "tube",
    "Volume": "volume",
    "VoxelModel": "volume",
}

if not TYPE_CHECKING:  # a type checker would take any name of a module that has __getattr__

    def __getattr__(name: str) -> object:
        """Import a name when it is first used."""
        if name not in _MODULES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
        globals()[name] = value
        return value

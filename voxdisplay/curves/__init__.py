"""One-dimensional objects: curves as values. Must not know voxels, colours or displays."""

from voxdisplay.curves.circular import Arc, Circle, Ellipse, Helix
from voxdisplay.curves.curve import Curve
from voxdisplay.curves.parametric import Parametric
from voxdisplay.curves.periodic import Lissajous, TorusKnot
from voxdisplay.curves.polyline import Points, Polyline, Segment
from voxdisplay.curves.splines import Bezier, BSpline, CatmullRom
from voxdisplay.curves.transformed import Transformed

__all__ = [
    "Arc",
    "BSpline",
    "Bezier",
    "CatmullRom",
    "Circle",
    "Curve",
    "Ellipse",
    "Helix",
    "Lissajous",
    "Parametric",
    "Points",
    "Polyline",
    "Segment",
    "TorusKnot",
    "Transformed",
]

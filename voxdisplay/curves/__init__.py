"""WHAT to draw: curves as values. Nothing here knows voxels, colours or displays."""

from voxdisplay.curves.curve import Curve
from voxdisplay.curves.parametric import Parametric
from voxdisplay.curves.primitives import (
    Arc,
    Circle,
    Ellipse,
    Helix,
    Lissajous,
    Points,
    Polyline,
    Segment,
    TorusKnot,
)
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

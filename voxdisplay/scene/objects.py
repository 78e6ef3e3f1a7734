"""What a scene file may say: one Struct for each type of object, and the curve it means.

The JSON Schema is derived from these. Knows the keys and their types; the values are checked by
the curves. In angles, ``deg`` is a constant: ``"90*deg"``.
"""

from typing import Annotated, Literal, get_args

import numpy as np
from msgspec import Meta, Struct, field

from voxdisplay import curves
from voxdisplay.errors import CurveError
from voxdisplay.expressions.params import MAX_PARAMS
from voxdisplay.expressions.parse import MAX_LENGTH
from voxdisplay.scene.evaluation_context import EvaluationContext

MAX_SIDE = 65535

# "expected" is what an error says of a value of another kind.
Number = Annotated[
    float | Annotated[str, Meta(max_length=MAX_LENGTH)],
    Meta(
        description="A number, or an expression in numbers, constants and the scene's params.",
        extra={"expected": "a number or an expression"},
    ),
]
Formula = Annotated[
    float | Annotated[str, Meta(max_length=MAX_LENGTH)],
    Meta(
        description="An expression in t, numbers, constants and the scene's params.",
        extra={"expected": "a number or an expression of t"},
    ),
]
Vector = Annotated[
    tuple[Number, Number, Number], Meta(extra={"expected": "three numbers [x, y, z]"})
]
Range = Annotated[tuple[Number, Number], Meta(extra={"expected": "two numbers [from, to]"})]
Side = Annotated[
    Annotated[float, Meta(ge=1, le=MAX_SIDE, multiple_of=1)]
    | Annotated[str, Meta(max_length=MAX_LENGTH)],
    Meta(extra={"expected": "a whole number or an expression"}),
]
Size = Annotated[
    tuple[Side, Side, Side], Meta(extra={"expected": "three whole numbers [nx, ny, nz]"})
]
Channel = Annotated[int, Meta(ge=0, le=255)]
OneColor = Annotated[
    str | Channel | Annotated[list[Channel], Meta(min_length=3, max_length=3)],
    Meta(extra={"expected": "a colour"}),
]
Color = Annotated[
    str | Annotated[list[OneColor], Meta(min_length=1)],
    Meta(
        description="#rgb, #rrggbb, a CSS colour name or [red, green, blue], 0 to 255; or a list "
        "of colours, spread along the curve. Three whole numbers are one colour.",
        extra={"expected": "a colour or a list of colours"},
    ),
]


class SceneObject(Struct, tag_field="type", forbid_unknown_fields=True, kw_only=True, frozen=True):
    """What all objects can say."""

    color: Color = "white"
    closed: bool | None = None

    def build_curves(self, context: EvaluationContext) -> list[curves.Curve]:
        """Make the object's curves; raise SceneError or CurveError."""
        return [self.build_curve(context)]

    def build_curve(self, context: EvaluationContext) -> curves.Curve:
        """Make the curve of an object that has one; raise SceneError or CurveError."""
        raise NotImplementedError


class Parametric(SceneObject, tag="parametric", frozen=True):
    """A curve given by three expressions of t, a <= t <= b, and optionally their derivatives."""

    x: Formula
    y: Formula
    z: Formula
    t: Range
    dx: Formula | None = None
    dy: Formula | None = None
    dz: Formula | None = None

    def build_curve(self, context: EvaluationContext) -> curves.Parametric:
        """Make the curve."""
        x, y, z = (context.formula(key, getattr(self, key)) for key in ("x", "y", "z"))
        dx, dy, dz = (
            None if source is None else context.formula(key, source)
            for key, source in (("dx", self.dx), ("dy", self.dy), ("dz", self.dz))
        )
        a, b = context.numbers("t", self.t).tolist()
        return curves.Parametric(x, y, z, t=(a, b), closed=self.closed, dx=dx, dy=dy, dz=dz)


class Segment(SceneObject, tag="segment", frozen=True):
    """A straight line."""

    start: Vector = field(name="from")
    end: Vector = field(name="to")

    def build_curve(self, context: EvaluationContext) -> curves.Segment:
        """Make the curve."""
        return curves.Segment(
            context.numbers("from", self.start), context.numbers("to", self.end), closed=self.closed
        )


class Polyline(SceneObject, tag="polyline", frozen=True):
    """Straight lines from point to point, and back to the first if closed is true."""

    points: list[Vector]

    def build_curve(self, context: EvaluationContext) -> curves.Polyline:
        """Make the curve."""
        return curves.Polyline(context.points("points", self.points), closed=self.closed)


class Arc(SceneObject, tag="arc", frozen=True):
    """A part of a circle, from the angle start to the angle end, in radians.

    With the normal [0, 0, 1], angle 0 is +x and "90*deg" is +y.
    """

    center: Vector
    radius: Number
    start: Number
    end: Number
    normal: Vector = (0.0, 0.0, 1.0)

    def build_curve(self, context: EvaluationContext) -> curves.Arc:
        """Make the curve."""
        return curves.Arc(
            context.numbers("center", self.center),
            context.number("radius", self.radius),
            context.number("start", self.start),
            context.number("end", self.end),
            context.numbers("normal", self.normal),
            closed=self.closed,
        )


class Circle(SceneObject, tag="circle", frozen=True):
    """A circle in the plane across normal."""

    center: Vector
    radius: Number
    normal: Vector = (0.0, 0.0, 1.0)

    def build_curve(self, context: EvaluationContext) -> curves.Circle:
        """Make the curve."""
        return curves.Circle(
            context.numbers("center", self.center),
            context.number("radius", self.radius),
            context.numbers("normal", self.normal),
            closed=self.closed is not False,
        )


class Ellipse(SceneObject, tag="ellipse", frozen=True):
    """An ellipse, of two half axes: vectors from its center."""

    center: Vector
    axes: tuple[Vector, Vector]

    def build_curve(self, context: EvaluationContext) -> curves.Ellipse:
        """Make the curve."""
        return curves.Ellipse(
            context.numbers("center", self.center),
            context.points("axes", self.axes),
            closed=self.closed is not False,
        )


class Helix(SceneObject, tag="helix", frozen=True):
    """A helix: begins beside center at the angle start, and advances by pitch in each turn."""

    center: Vector
    radius: Number
    pitch: Number
    turns: Number
    axis: Vector = (0.0, 0.0, 1.0)
    start: Number = 0.0

    def build_curve(self, context: EvaluationContext) -> curves.Helix:
        """Make the curve."""
        return curves.Helix(
            context.numbers("center", self.center),
            context.number("radius", self.radius),
            context.number("pitch", self.pitch),
            context.number("turns", self.turns),
            context.numbers("axis", self.axis),
            start=context.number("start", self.start),
            closed=self.closed,
        )


class Lissajous(SceneObject, tag="lissajous", frozen=True):
    """center + amplitude * sin(frequency * t + phase), 0 <= t <= tau, for x, y and z."""

    center: Vector
    amplitude: Vector
    frequency: Vector
    phase: Vector = (0.0, 0.0, 0.0)

    def build_curve(self, context: EvaluationContext) -> curves.Lissajous:
        """Make the curve."""
        return curves.Lissajous(
            context.numbers("center", self.center),
            context.numbers("amplitude", self.amplitude),
            context.numbers("frequency", self.frequency),
            context.numbers("phase", self.phase),
            closed=self.closed,
        )


class TorusKnot(SceneObject, tag="torus_knot", frozen=True):
    """p times around the axis while q times around the tube; p = 2, q = 3 is the trefoil.

    major is the radius of the middle circle of the torus, minor that of its tube.
    """

    p: Number
    q: Number
    center: Vector
    major: Number
    minor: Number
    axis: Vector = (0.0, 0.0, 1.0)

    def build_curve(self, context: EvaluationContext) -> curves.TorusKnot:
        """Make the curve."""
        return curves.TorusKnot(
            context.number("p", self.p),
            context.number("q", self.q),
            context.numbers("center", self.center),
            context.number("major", self.major),
            context.number("minor", self.minor),
            context.numbers("axis", self.axis),
            closed=self.closed is not False,
        )


class Bezier(SceneObject, tag="bezier", frozen=True):
    """A Bezier curve; its degree is one less than its control points."""

    points: list[Vector]

    def build_curve(self, context: EvaluationContext) -> curves.Bezier:
        """Make the curve."""
        return curves.Bezier(context.points("points", self.points), closed=self.closed)


class BSpline(SceneObject, tag="bspline", frozen=True):
    """A B-spline; with weights, a NURBS curve. There is one knot for each point, and degree + 1."""

    points: list[Vector]
    degree: Number = 3.0
    knots: list[Number] | None = None
    weights: list[Number] | None = None

    def build_curve(self, context: EvaluationContext) -> curves.BSpline:
        """Make the curve."""
        return curves.BSpline(
            context.points("points", self.points),
            context.number("degree", self.degree),
            None if self.knots is None else context.numbers("knots", self.knots),
            None if self.weights is None else context.numbers("weights", self.weights),
            closed=self.closed,
        )


class CatmullRom(SceneObject, tag="catmull_rom", frozen=True):
    """A smooth curve through points, and on to the first if closed is true."""

    points: list[Vector]

    def build_curve(self, context: EvaluationContext) -> curves.CatmullRom:
        """Make the curve."""
        return curves.CatmullRom(context.points("points", self.points), closed=self.closed)


class Points(SceneObject, tag="points", frozen=True):
    """Ordered points, joined by straight lines: either inline or in a file beside the scene.

    The file is a text table (.csv, .txt, .tsv, .dat, .xyz) of columns x, y, z, or a .npy array of
    shape (n, 3). With "gaps": "split", rows that are empty or not finite split it into strands.
    """

    points: list[Vector] | None = None
    file: str | None = None
    gaps: Literal["split"] | None = None

    def build_curves(self, context: EvaluationContext) -> list[curves.Curve]:
        """Make one curve for each strand."""
        if self.points is not None and self.file is None:
            if self.gaps:
                raise CurveError("the key 'gaps' belongs to the key 'file'")
            points = context.points("points", self.points)
            return [curves.Points(points, closed=self.closed)]
        if self.file is None or self.points is not None:
            raise CurveError("points needs either the key 'points' or the key 'file'")
        found = context.points_from_file("file", self.file, split=self.gaps == "split")
        strands = np.split(found.points, found.starts[1:])
        return [curves.Points(strand, closed=self.closed) for strand in strands]


Object = (
    Parametric
    | Segment
    | Polyline
    | Arc
    | Circle
    | Ellipse
    | Helix
    | Lissajous
    | TorusKnot
    | Bezier
    | BSpline
    | CatmullRom
    | Points
)
TYPES = {str(scene_object.__struct_config__.tag): scene_object for scene_object in get_args(Object)}


class SceneFile(Struct, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """A scene: objects, in the order in which they are drawn.

    Coordinates are in voxels: voxel (i, j, k) is the cube [i, i+1) x [j, j+1) x [k, k+1).
    """

    objects: list[Object]
    size: Size | None = None
    params: Annotated[dict[str, Number], Meta(max_length=MAX_PARAMS)] = {}
    schema: str = field(name="$schema", default="")

"""Curve types of scene files: one Struct for each, with its keys and the curve that it makes.

Descriptions and types of the keys are those of the JSON Schema. Values are checked by the curves;
it must not know files. In angles, ``deg`` is a constant: ``"90*deg"``.
"""

from collections.abc import Sequence
from itertools import chain
from typing import Annotated, ClassVar

import numpy as np
from msgspec import Meta, field

from voxdisplay import bodies, curves
from voxdisplay.bodies import Body
from voxdisplay.compute.array_types import Floats
from voxdisplay.scene.evaluation_context import EvaluationContext
from voxdisplay.scene.point_keys import Gaps, InlinePoints, PointsFile, points_of
from voxdisplay.scene.scene_object import Axis, Center, Normal, Radius, SceneObject
from voxdisplay.scene.values import Formula, Number, Numbers, Range, Vector, Vectors


class CurveObject(SceneObject, kw_only=True, frozen=True):
    """Keys of all curve types."""

    value_names: ClassVar[tuple[str, ...]] = ("t", "s")

    closed: Annotated[
        bool | None,
        Meta(
            title="Closed",
            description="Whether the end is joined to the beginning. When left out, it is found "
            "from the end points.",
        ),
    ] = None

    thickness: Annotated[
        Number | None,
        Meta(
            title="Thickness",
            description="Diameter of a solid tube that is shown in place of the thin curve, in "
            "voxels.",
        ),
    ] = None

    def build(self, context: EvaluationContext) -> list[curves.Curve | Body]:
        """Return the curves, or solid tubes about them: `SceneObject.build`."""
        found = self.build_curves(context)
        if self.thickness is None:
            return list(found)
        radius = context.number("thickness", self.thickness) / 2
        if radius <= 0:
            raise context.error("thickness", f"must be positive, not {2 * radius:g}")
        return [bodies.Tube(curve, radius, fill="solid") for curve in found]

    def build_curves(self, context: EvaluationContext) -> list[curves.Curve]:
        """Return the object's curves; raise SceneError or CurveError."""
        return [self.build_curve(context)]

    def build_curve(self, context: EvaluationContext) -> curves.Curve:
        """Return the curve of an object that has one; raise SceneError or CurveError."""
        raise NotImplementedError


class Parametric(CurveObject, tag="parametric", frozen=True):
    """A curve given by three expressions of t, a <= t <= b, and optionally their derivatives."""

    x: Annotated[Formula, Meta(title="x of t", description="The coordinate x, in voxels.")]
    y: Annotated[Formula, Meta(title="y of t", description="The coordinate y, in voxels.")]
    z: Annotated[Formula, Meta(title="z of t", description="The coordinate z, in voxels.")]
    t: Annotated[Range, Meta(title="Range of t", description="First and last value of t.")]
    dx: Annotated[Formula | None, Meta(title="dx/dt", description="Derivative of x by t.")] = None
    dy: Annotated[Formula | None, Meta(title="dy/dt", description="Derivative of y by t.")] = None
    dz: Annotated[Formula | None, Meta(title="dz/dt", description="Derivative of z by t.")] = None

    def build_curve(self, context: EvaluationContext) -> curves.Parametric:
        """Return the curve."""
        x, y, z = (context.formula(key, getattr(self, key)) for key in ("x", "y", "z"))
        dx, dy, dz = (
            None if source is None else context.formula(key, source)
            for key, source in (("dx", self.dx), ("dy", self.dy), ("dz", self.dz))
        )
        a, b = context.numbers("t", self.t).tolist()
        return curves.Parametric(x, y, z, t=(a, b), closed=self.closed, dx=dx, dy=dy, dz=dz)


class Segment(CurveObject, tag="segment", frozen=True):
    """A straight line."""

    start: Annotated[Vector, Meta(title="From", description="The first point.")] = field(
        name="from"
    )
    end: Annotated[Vector, Meta(title="To", description="The last point.")] = field(name="to")

    def build_curve(self, context: EvaluationContext) -> curves.Segment:
        """Return the curve."""
        return curves.Segment(
            context.numbers("from", self.start), context.numbers("to", self.end), closed=self.closed
        )

    @property
    def column_numbers(self) -> tuple[str | float, ...] | None:
        """All its numbers: `SceneObject.column_numbers`."""
        return (*self.start, *self.end) if self.thickness is None else None

    @classmethod
    def build_columns(
        cls, table: Floats, objects: Sequence["Segment"]
    ) -> Sequence[curves.Curve | None]:
        """Return many segments: `SceneObject.build_columns`."""
        closed = [each.closed for each in objects]
        return curves.Segment.many(table[:, :3], table[:, 3:], closed)


class Polyline(CurveObject, tag="polyline", frozen=True):
    """Straight lines from point to point, and back to the first if closed is true."""

    points: Annotated[Vectors, Meta(description="The corners [x, y, z], two or more.")]

    def build_curve(self, context: EvaluationContext) -> curves.Polyline:
        """Return the curve."""
        return curves.Polyline(context.points("points", self.points), closed=self.closed)


class Arc(CurveObject, tag="arc", frozen=True):
    """A part of a circle, from the angle start to the angle end, in radians.

    With the normal [0, 0, 1], angle 0 is +x and "90*deg" is +y.
    """

    center: Center
    radius: Radius
    start: Annotated[Number, Meta(title="Start", description="Angle of the start, in radians.")]
    end: Annotated[Number, Meta(title="End", description="Angle of the end, in radians.")]
    normal: Normal = (0.0, 0.0, 1.0)

    def build_curve(self, context: EvaluationContext) -> curves.Arc:
        """Return the curve."""
        return curves.Arc(
            context.numbers("center", self.center),
            context.number("radius", self.radius),
            context.number("start", self.start),
            context.number("end", self.end),
            context.numbers("normal", self.normal),
            closed=self.closed,
        )

    @property
    def column_numbers(self) -> tuple[str | float, ...] | None:
        """All its numbers: `SceneObject.column_numbers`."""
        numbers = (*self.center, *self.normal, self.radius, self.start, self.end)
        return numbers if self.thickness is None else None

    @classmethod
    def build_columns(
        cls, table: Floats, objects: Sequence["Arc"]
    ) -> Sequence[curves.Curve | None]:
        """Return many arcs: `SceneObject.build_columns`."""
        center, normal, radius, angles = np.split(table, (3, 6, 7), axis=1)
        closed = [each.closed for each in objects]
        return curves.Arc.many(center, radius[:, 0], angles, normal, closed)


class Circle(CurveObject, tag="circle", frozen=True):
    """A circle in the plane across normal."""

    center: Center
    radius: Radius
    normal: Normal = (0.0, 0.0, 1.0)

    def build_curve(self, context: EvaluationContext) -> curves.Circle:
        """Return the curve."""
        return curves.Circle(
            context.numbers("center", self.center),
            context.number("radius", self.radius),
            context.numbers("normal", self.normal),
            closed=self.closed is not False,
        )

    @property
    def column_numbers(self) -> tuple[str | float, ...] | None:
        """All its numbers: `SceneObject.column_numbers`."""
        return (*self.center, *self.normal, self.radius) if self.thickness is None else None

    @classmethod
    def build_columns(
        cls, table: Floats, objects: Sequence["Circle"]
    ) -> Sequence[curves.Curve | None]:
        """Return many circles: `SceneObject.build_columns`."""
        center, normal, radius = np.split(table, (3, 6), axis=1)
        closed = [each.closed is not False for each in objects]
        return curves.Circle.many(center, radius[:, 0], normal, closed)


class Ellipse(CurveObject, tag="ellipse", frozen=True):
    """An ellipse, of two half axes: vectors from its center."""

    center: Center
    axes: Annotated[
        tuple[Vector, Vector],
        Meta(
            title="Half axes",
            description="Two vectors from the centre to the ellipse, at right angles.",
            extra={"expected": "two vectors [[x, y, z], [x, y, z]]"},
        ),
    ]

    def build_curve(self, context: EvaluationContext) -> curves.Ellipse:
        """Return the curve."""
        return curves.Ellipse(
            context.numbers("center", self.center),
            context.points("axes", self.axes),
            closed=self.closed is not False,
        )

    @property
    def column_numbers(self) -> tuple[str | float, ...] | None:
        """All its numbers: `SceneObject.column_numbers`."""
        return (*self.center, *self.axes[0], *self.axes[1]) if self.thickness is None else None

    @classmethod
    def build_columns(
        cls, table: Floats, objects: Sequence["Ellipse"]
    ) -> Sequence[curves.Curve | None]:
        """Return many ellipses: `SceneObject.build_columns`."""
        closed = [each.closed is not False for each in objects]
        return curves.Ellipse.many(table[:, :3], table[:, 3:].reshape(-1, 2, 3), closed)


class Helix(CurveObject, tag="helix", frozen=True):
    """A helix: begins beside center at the angle start, and advances by pitch in each turn."""

    center: Annotated[Vector, Meta(title="Centre", description="The axis begins here.")]
    radius: Radius
    pitch: Annotated[
        Number,
        Meta(title="Pitch", description="Advance in one turn, in voxels; it may be negative."),
    ]
    turns: Annotated[
        Number, Meta(title="Turns", description="How many turns, not only whole ones.")
    ]
    axis: Axis = (0.0, 0.0, 1.0)
    start: Annotated[Number, Meta(title="Start", description="Angle of the start, in radians.")] = (
        0.0
    )

    def build_curve(self, context: EvaluationContext) -> curves.Helix:
        """Return the curve."""
        return curves.Helix(
            context.numbers("center", self.center),
            context.number("radius", self.radius),
            context.number("pitch", self.pitch),
            context.number("turns", self.turns),
            context.numbers("axis", self.axis),
            start=context.number("start", self.start),
            closed=self.closed,
        )


class Lissajous(CurveObject, tag="lissajous", frozen=True):
    """center + amplitude * sin(frequency * t + phase), 0 <= t <= tau, for x, y and z."""

    center: Center
    amplitude: Annotated[
        Vector, Meta(title="Amplitude", description="Amplitudes in x, y and z, in voxels.")
    ]
    frequency: Annotated[
        Vector, Meta(title="Frequency", description="Oscillations in x, y and z for t = 0 to tau.")
    ]
    phase: Annotated[
        Vector, Meta(title="Phase", description="Phases in x, y and z at t = 0, in radians.")
    ] = (0.0, 0.0, 0.0)

    def build_curve(self, context: EvaluationContext) -> curves.Lissajous:
        """Return the curve."""
        return curves.Lissajous(
            context.numbers("center", self.center),
            context.numbers("amplitude", self.amplitude),
            context.numbers("frequency", self.frequency),
            context.numbers("phase", self.phase),
            closed=self.closed,
        )


class TorusKnot(CurveObject, tag="torus_knot", frozen=True):
    """p times around the axis while q times around the tube; p = 2, q = 3 is the trefoil.

    major is the radius of the middle circle of the torus, minor that of its tube.
    """

    p: Annotated[Number, Meta(title="p", description="How often around the axis; whole.")]
    q: Annotated[Number, Meta(title="q", description="How often around the tube; whole.")]
    center: Center
    major: Annotated[
        Number,
        Meta(title="Major radius", description="Radius of the torus's middle circle, in voxels."),
    ]
    minor: Annotated[
        Number, Meta(title="Minor radius", description="Radius of the torus's tube, in voxels.")
    ]
    axis: Axis = (0.0, 0.0, 1.0)

    def build_curve(self, context: EvaluationContext) -> curves.TorusKnot:
        """Return the curve."""
        return curves.TorusKnot(
            context.number("p", self.p),
            context.number("q", self.q),
            context.numbers("center", self.center),
            context.number("major", self.major),
            context.number("minor", self.minor),
            context.numbers("axis", self.axis),
            closed=self.closed is not False,
        )


class Bezier(CurveObject, tag="bezier", frozen=True):
    """A Bezier curve; its degree is one less than its control points."""

    points: Annotated[Vectors, Meta(description="The control points [x, y, z].")]

    def build_curve(self, context: EvaluationContext) -> curves.Bezier:
        """Return the curve."""
        return curves.Bezier(context.points("points", self.points), closed=self.closed)

    @property
    def column_numbers(self) -> tuple[str | float, ...] | None:
        """All its numbers: `SceneObject.column_numbers`."""
        return tuple(chain.from_iterable(self.points)) if self.thickness is None else None

    @classmethod
    def build_columns(
        cls, table: Floats, objects: Sequence["Bezier"]
    ) -> Sequence[curves.Curve | None]:
        """Return many curves: `SceneObject.build_columns`."""
        closed = [each.closed for each in objects]
        return curves.Bezier.many(table.reshape(len(table), -1, 3), closed)


class BSpline(CurveObject, tag="bspline", frozen=True):
    """A B-spline; with weights, a NURBS curve."""

    points: Annotated[Vectors, Meta(description="The control points [x, y, z].")]
    degree: Annotated[
        Number, Meta(title="Degree", description="Degree of the polynomials; 3 is cubic.")
    ] = 3.0
    knots: Annotated[
        Numbers | None,
        Meta(
            title="Knots",
            description="The knots, ascending, as many as points + degree + 1, or + degree - 1 as "
            "CAD programs write them; when left out, evenly spaced.",
        ),
    ] = None
    weights: Annotated[
        Numbers | None,
        Meta(
            title="Weights",
            description="One weight for each point: a NURBS curve. 0 takes a point out.",
        ),
    ] = None

    def build_curve(self, context: EvaluationContext) -> curves.BSpline:
        """Return the curve."""
        return curves.BSpline(
            context.points("points", self.points),
            context.number("degree", self.degree),
            None if self.knots is None else context.numbers("knots", self.knots),
            None if self.weights is None else context.numbers("weights", self.weights),
            closed=self.closed,
        )


class CatmullRom(CurveObject, tag="catmull_rom", frozen=True):
    """A smooth curve through points, and on to the first if closed is true."""

    points: Annotated[Vectors, Meta(description="Points [x, y, z] that the curve passes through.")]

    def build_curve(self, context: EvaluationContext) -> curves.CatmullRom:
        """Return the curve."""
        return curves.CatmullRom(context.points("points", self.points), closed=self.closed)


class Points(CurveObject, tag="points", frozen=True):
    """Ordered points, joined by straight lines: either inline or in a file beside the scene.

    The file is a text table (.csv, .txt, .tsv, .dat, .xyz) of columns x, y, z, or a .npy array of
    shape (n, 3). With "gaps": "split", rows that are empty or not finite split it into strands.
    """

    points: InlinePoints = None
    file: PointsFile = None
    gaps: Gaps = None

    def build_curves(self, context: EvaluationContext) -> list[curves.Curve]:
        """Return one curve for each strand."""
        found = points_of(self, "points", context)
        strands = found.separate()
        if found.columns:
            context.columns = [columns for _, columns in strands]
        return [curves.Points(points, closed=self.closed) for points, _ in strands]


AnyCurve = (
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
"""An object of any curve type."""

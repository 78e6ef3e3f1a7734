"""Body types of scene files: one Struct for each, with its keys and the body that it makes.

Descriptions and types of the keys are those of the JSON Schema. Values are checked by the bodies.
"""

from typing import Annotated, ClassVar, Literal

from msgspec import Meta, field

from voxdisplay import bodies
from voxdisplay.bodies import Body
from voxdisplay.curves import Curve
from voxdisplay.scene.evaluation_context import EvaluationContext
from voxdisplay.scene.point_keys import Gaps, InlinePoints, PointsFile, points_of
from voxdisplay.scene.scene_object import Center, Normal, Radius, SceneObject
from voxdisplay.scene.values import BodyFormula, Number, Range, Vector, Vectors

Corners = Annotated[
    tuple[Vector, Vector] | None,
    Meta(
        title="Box",
        description="Two opposite corners [[x0, y0, z0], [x1, y1, z1]].",
        extra={"expected": "two corners [[x, y, z], [x, y, z]]"},
    ),
]
From = Annotated[Vector, Meta(title="From", description="The first corner or end.")]
To = Annotated[Vector, Meta(title="To", description="The opposite corner, or the other end.")]


class BodyObject(SceneObject, kw_only=True, frozen=True):
    """Keys of all body types."""

    def build(self, context: EvaluationContext) -> list[Curve | Body]:
        """Return the body: `SceneObject.build`."""
        return [self.build_body(context)]

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body; raise SceneError, CurveError or BodyError."""
        raise NotImplementedError


class EnclosingObject(BodyObject, kw_only=True, frozen=True):
    """Keys of all bodies that enclose something."""

    fill: Annotated[
        Literal["shell", "solid"],
        Meta(title="Fill", description="shell: the surface alone. solid: what it encloses, too."),
    ] = "shell"


class Surface(EnclosingObject, tag="surface", frozen=True):
    """A surface given by three expressions of u and v."""

    value_names: ClassVar[tuple[str, ...]] = ("u", "v")

    x: Annotated[BodyFormula, Meta(title="x of u and v", description="In voxels.")]
    y: Annotated[BodyFormula, Meta(title="y of u and v", description="In voxels.")]
    z: Annotated[BodyFormula, Meta(title="z of u and v", description="In voxels.")]
    u: Annotated[Range, Meta(title="Range of u", description="First and last value of u.")]
    v: Annotated[Range, Meta(title="Range of v", description="First and last value of v.")]

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        x, y, z = (context.formula(key, getattr(self, key), ("u", "v")) for key in ("x", "y", "z"))
        u, v = context.pair("u", self.u), context.pair("v", self.v)
        return bodies.Surface(x, y, z, u=u, v=v, fill=self.fill)


class HeightField(BodyObject, tag="height_field", frozen=True):
    """A surface z = f(x, y) over a rectangle."""

    z: Annotated[BodyFormula, Meta(title="z of x and y", description="The height, in voxels.")]
    x: Annotated[Range, Meta(title="Range of x", description="First and last value of x.")]
    y: Annotated[Range, Meta(title="Range of y", description="First and last value of y.")]

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        return bodies.HeightField(
            context.formula("z", self.z, ("x", "y")),
            x=context.pair("x", self.x),
            y=context.pair("y", self.y),
        )


class Implicit(EnclosingObject, tag="implicit", frozen=True):
    """The surface f(x, y, z) = 0; solid, all where f <= 0."""

    f: Annotated[
        BodyFormula, Meta(title="f of x, y and z", description="Below 0 inside, above outside.")
    ]
    box: Annotated[
        Corners,
        Meta(title="Box", description="Where it is drawn; when left out, in the whole volume."),
    ] = None

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        f = context.formula("f", self.f, ("x", "y", "z"))
        box = None if self.box is None else context.points("box", self.box)
        return bodies.Implicit(f, box=box, fill=self.fill)


class Plane(BodyObject, tag="plane", frozen=True):
    """A plane, as far as the volume goes; u and v are voxels from its point."""

    value_names: ClassVar[tuple[str, ...]] = ("u", "v")

    point: Annotated[Vector, Meta(title="Point", description="Any point of the plane.")]
    normal: Normal

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        return bodies.Plane(
            context.numbers("point", self.point), context.numbers("normal", self.normal)
        )


class Disc(BodyObject, tag="disc", frozen=True):
    """A flat disc in the plane across normal; u is the angle, v runs from 0 to 1 at the rim."""

    value_names: ClassVar[tuple[str, ...]] = ("u", "v")

    center: Center
    radius: Radius
    normal: Normal = (0.0, 0.0, 1.0)

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        return bodies.Disc(
            context.numbers("center", self.center),
            context.number("radius", self.radius),
            context.numbers("normal", self.normal),
        )


class Triangle(BodyObject, tag="triangle", frozen=True):
    """A triangle."""

    points: Annotated[
        tuple[Vector, Vector, Vector],
        Meta(
            title="Points",
            description="The three corners.",
            extra={"expected": "three points [[x, y, z], [x, y, z], [x, y, z]]"},
        ),
    ]

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        return bodies.Triangle(context.points("points", self.points))


class Polygon(BodyObject, tag="polygon", frozen=True):
    """A flat region inside of a ring of straight lines."""

    points: Annotated[
        Vectors, Meta(description="The corners [x, y, z] in order, all in one plane.")
    ]

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        return bodies.Polygon(context.points("points", self.points))


class Sphere(EnclosingObject, tag="sphere", frozen=True):
    """A sphere; solid, a ball; u is the longitude, v the latitude, in radians."""

    value_names: ClassVar[tuple[str, ...]] = ("u", "v")

    center: Center
    radius: Radius

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        return bodies.Sphere(
            context.numbers("center", self.center),
            context.number("radius", self.radius),
            fill=self.fill,
        )


class Ellipsoid(EnclosingObject, tag="ellipsoid", frozen=True):
    """An ellipsoid along the axes; u is the longitude, v the latitude. transform turns it."""

    value_names: ClassVar[tuple[str, ...]] = ("u", "v")

    center: Center
    radii: Annotated[
        Vector | None,
        Meta(title="Radii", description="Half lengths [a, b, c] along x, y and z, in voxels."),
    ] = None
    radius: Annotated[
        Number | None, Meta(title="Radius", description="In place of three equal radii.")
    ] = None

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        if (self.radii is None) == (self.radius is None):
            raise context.object_error("an ellipsoid needs either the key 'radii' or 'radius'")
        if self.radii is None:
            assert self.radius is not None  # noqa: S101 - see above
            radii = [context.number("radius", self.radius)] * 3
        else:
            radii = context.numbers("radii", self.radii).tolist()
        return bodies.Ellipsoid(context.numbers("center", self.center), radii, fill=self.fill)


class SphericalTriangle(BodyObject, tag="spherical_triangle", frozen=True):
    """A triangle on a sphere, whose sides are arcs of great circles; u, v as of a sphere."""

    value_names: ClassVar[tuple[str, ...]] = ("u", "v")

    center: Center
    radius: Radius
    corners: Annotated[
        tuple[Vector, Vector, Vector],
        Meta(
            title="Corners",
            description="Three points, taken as directions from the centre.",
            extra={"expected": "three points [[x, y, z], [x, y, z], [x, y, z]]"},
        ),
    ]

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        return bodies.SphericalTriangle(
            context.numbers("center", self.center),
            context.number("radius", self.radius),
            context.points("corners", self.corners),
        )


class Box(EnclosingObject, tag="box", frozen=True):
    """A box along the axes, between two opposite corners; transform turns it."""

    start: From = field(name="from")
    end: To = field(name="to")

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        return bodies.Box(
            context.numbers("from", self.start), context.numbers("to", self.end), fill=self.fill
        )


class Cylinder(EnclosingObject, tag="cylinder", frozen=True):
    """A circular cylinder between two end faces; u is the angle, v runs from 0 to 1 along it."""

    value_names: ClassVar[tuple[str, ...]] = ("u", "v")

    start: From = field(name="from")
    end: To = field(name="to")
    radius: Radius

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        return bodies.Cylinder(
            context.numbers("from", self.start),
            context.numbers("to", self.end),
            context.number("radius", self.radius),
            fill=self.fill,
        )


class Cone(EnclosingObject, tag="cone", frozen=True):
    """A circular cone, from base to apex; u is the angle, v runs from 0 to 1 at the apex."""

    value_names: ClassVar[tuple[str, ...]] = ("u", "v")

    start: From = field(name="from")
    end: To = field(name="to")
    radius: Radius

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        return bodies.Cone(
            context.numbers("from", self.start),
            context.numbers("to", self.end),
            context.number("radius", self.radius),
            fill=self.fill,
        )


class Scatter(BodyObject, tag="scatter", frozen=True):
    """Points without an order, inline or in a file beside the scene: nothing joins them."""

    points: InlinePoints = None
    file: PointsFile = None
    gaps: Gaps = None

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        found = points_of(self, "scatter", context)
        context.columns = [dict(found.columns)]
        return bodies.Scatter(found.points, found.columns)

"""Types of scene files that are tubes: tori, and tubes about curves.

Descriptions and types of the keys are those of the JSON Schema. Values are checked by the bodies.
"""

from typing import Annotated, ClassVar

from msgspec import Meta

from voxdisplay import bodies
from voxdisplay.bodies import Body
from voxdisplay.scene.body_objects import EnclosingObject
from voxdisplay.scene.curve_objects import AnyCurve
from voxdisplay.scene.evaluation_context import EvaluationContext
from voxdisplay.scene.placement import transform_placement
from voxdisplay.scene.scene_object import Center, Normal
from voxdisplay.scene.values import Formula, Number

# Keys that an object has by itself, and that mean nothing for the curve inside of a tube.
_NOT_INSIDE = ("color", "during", "part", "repeat", "thickness")


class Torus(EnclosingObject, tag="torus", frozen=True):
    """A torus; u is the angle round the middle circle, v round the tube, in radians."""

    value_names: ClassVar[tuple[str, ...]] = ("u", "v")

    center: Center
    major: Annotated[
        Number,
        Meta(title="Major radius", description="Radius of the middle circle, in voxels."),
    ]
    minor: Annotated[
        Number, Meta(title="Minor radius", description="Radius of the tube, in voxels.")
    ]
    normal: Normal = (0.0, 0.0, 1.0)

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        return bodies.Torus(
            context.numbers("center", self.center),
            context.number("major", self.major),
            context.number("minor", self.minor),
            context.numbers("normal", self.normal),
            fill=self.fill,
        )


class Tube(EnclosingObject, tag="tube", frozen=True):
    """All that is within a radius of a curve; round at the ends."""

    value_names: ClassVar[tuple[str, ...]] = ("t", "s")

    along: Annotated[
        AnyCurve,
        Meta(
            title="Along",
            description="The curve in the middle: an object of any curve type.",
            extra={"expected": "an object that is a curve {...}"},
        ),
    ]
    radius: Annotated[
        Formula,
        Meta(title="Radius", description="In voxels; an expression may use the curve's own t."),
    ]

    def build_body(self, context: EvaluationContext) -> Body:
        """Return the body."""
        inner = EvaluationContext(f"{context.path}.along", context.environment, context.files)
        for key in _NOT_INSIDE:
            if getattr(self.along, key, None) is not None:
                raise inner.error(key, f"{key!r} belongs to the tube, not to the curve in it")
        curves = self.along.build_curves(inner)
        if len(curves) != 1:
            problem = f"{len(curves)} strands of points are no single curve"
            raise context.error("along", problem)
        place = transform_placement(self.along.transform, inner)
        curve = curves[0] if place is None else place.of_curve(curves[0])
        return bodies.Tube(curve, context.formula("radius", self.radius), fill=self.fill)

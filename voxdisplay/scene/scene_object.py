"""Keys that all objects of scene files have, and those that many have.

It must not know object types.
"""

from collections.abc import Sequence
from typing import Annotated, Any, ClassVar

from msgspec import Meta, Struct

from voxdisplay.bodies import Body
from voxdisplay.compute.array_types import Floats
from voxdisplay.curves import Curve
from voxdisplay.scene.evaluation_context import EvaluationContext
from voxdisplay.scene.values import Color, Number, Range, Transform, Vector

Center = Annotated[Vector, Meta(title="Centre", description="The centre [x, y, z], in voxels.")]
Radius = Annotated[Number, Meta(title="Radius", description="The radius, in voxels.")]
Normal = Annotated[
    Vector,
    Meta(title="Normal", description="Direction across the curve's plane, of any length."),
]
Axis = Annotated[Vector, Meta(title="Axis", description="Direction of the axis, of any length.")]


class SceneObject(Struct, tag_field="type", forbid_unknown_fields=True, kw_only=True, frozen=True):
    """Keys of all object types."""

    value_names: ClassVar[tuple[str, ...]] = ()
    """Names of values at voxels, besides x, y and z, by which the object can be coloured."""

    color: Color = None
    transform: Transform = []
    during: Annotated[
        Range | None,
        Meta(
            title="During",
            description="The time [from, until] in seconds in which the object is there: from its "
            "beginning on, not at its end. For scenes that have a duration.",
        ),
    ] = None
    part: Annotated[
        Range | None,
        Meta(
            title="Part",
            description="The part [a, b] of the voxels that is shown, from 0 to 1: of a curve "
            "along it, of a body from the lowest voxel up. Colours are those of the whole.",
        ),
    ] = None
    repeat: Annotated[
        dict[str, Number] | None,
        Meta(
            title="Repeat",
            description='Draws the object so many times: {"k": 14} with k = 0 to 13 in its '
            "expressions.",
        ),
    ] = None

    @property
    def is_simple(self) -> bool:
        """True if it is there once, whole, as it is, in colours that depend on nothing."""
        more = self.transform or self.repeat or self.during or self.part
        return not more and (self.color is None or isinstance(self.color, str))

    def build(self, context: EvaluationContext) -> list[Curve | Body]:
        """Return what the object is made of, in drawing order.

        Raises
        ------
        SceneError, CurveError, BodyError
            If a value is wrong.

        """
        raise NotImplementedError

    @property
    def column_numbers(self) -> tuple[str | float, ...] | None:
        """All its numbers, in the order of `build_columns`; None if it is built alone."""
        return None

    @classmethod
    def build_columns(cls, table: Floats, objects: Sequence[Any]) -> Sequence[Curve | None]:
        """Return the curves of n objects of this type: None where a number is wrong.

        Parameters
        ----------
        table : (n, k) float64 array
            The values of each object's `column_numbers`.
        objects : sequence of SceneObject

        """
        raise NotImplementedError

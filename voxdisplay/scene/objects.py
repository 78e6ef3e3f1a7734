"""Object types of scene files, groups of objects, and the file itself.

Each Struct has the keys of one; their descriptions and types are those of the JSON Schema.
"""

from typing import Annotated, get_args

from msgspec import Meta, Struct, field

from voxdisplay.expressions.params import MAX_PARAMS
from voxdisplay.scene.body_objects import (
    Box,
    Cone,
    Cylinder,
    Disc,
    Ellipsoid,
    HeightField,
    Implicit,
    Plane,
    Polygon,
    Scatter,
    Sphere,
    SphericalTriangle,
    Surface,
    Triangle,
)
from voxdisplay.scene.curve_objects import AnyCurve
from voxdisplay.scene.model_objects import Mesh, Text, Volume
from voxdisplay.scene.scene_object import SceneObject
from voxdisplay.scene.tube_objects import Torus, Tube
from voxdisplay.scene.values import Number, Param, Size


class Group(SceneObject, tag="group", kw_only=True, frozen=True):
    """Objects that are transformed, coloured, repeated and shown together."""

    objects: Annotated[
        "list[Object]",
        Meta(
            title="Objects",
            description="What the group consists of, in drawing order. Objects without a colour "
            "take that of the group.",
            extra={"expected": "a list of objects [{...}, ...]"},
        ),
    ]


Object = (
    AnyCurve
    | Surface
    | HeightField
    | Implicit
    | Plane
    | Triangle
    | Polygon
    | Disc
    | Sphere
    | Ellipsoid
    | SphericalTriangle
    | Box
    | Cylinder
    | Cone
    | Torus
    | Tube
    | Mesh
    | Volume
    | Text
    | Scatter
    | Group
)
TYPES = {str(scene_object.__struct_config__.tag): scene_object for scene_object in get_args(Object)}


class View(Struct, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """The point of view from which a scene is best seen."""

    angle: Annotated[
        tuple[Number, Number],
        Meta(
            title="Angle",
            description="Yaw and pitch in degrees: [0, 0] is from the front, x to the right and z "
            "up; a greater pitch looks from above. It is [-34, 24] when left out.",
            extra={"expected": "two angles [yaw, pitch] in degrees"},
        ),
    ] = (-34.0, 24.0)
    zoom: Annotated[Number, Meta(title="Zoom", description="0.3 to 2.5; above 1 is nearer.")] = 1.0


class SceneFile(Struct, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """A scene: objects in drawing order.

    Coordinates are in voxels: voxel (i, j, k) is the cube [i, i+1) x [j, j+1) x [k, k+1).
    """

    objects: Annotated[
        list[Object],
        Meta(
            title="Objects",
            description="What is shown, in drawing order.",
            extra={"expected": "a list of objects [{...}, ...]"},
        ),
    ]
    size: Annotated[
        Size | None,
        Meta(
            title="Size",
            description="The volume [nx, ny, nz] that the scene was composed for, in voxels. When "
            "left out, it is the display's own; on a display of another size the scene is scaled.",
        ),
    ] = None
    params: Annotated[
        dict[str, Param],
        Meta(
            max_length=MAX_PARAMS,
            title="Params",
            description="Names for numbers, expressions and tracks, which all expressions may use.",
        ),
    ] = {}
    duration: Annotated[
        Number | None,
        Meta(
            title="Duration",
            description="Seconds that the scene lasts. With it, the scene moves: expressions may "
            "use time, the seconds since its beginning, and duration.",
        ),
    ] = None
    fps: Annotated[
        Number, Meta(title="Frames per second", description="Of a scene with a duration.")
    ] = 30.0
    loop: Annotated[
        bool,
        Meta(
            title="Loop",
            description="Whether a scene with a duration starts again at its end.",
        ),
    ] = False
    view: Annotated[
        View | None,
        Meta(
            title="View",
            description="Where the scene is best seen from: pictures and the live view begin "
            "there. It changes nothing on a display.",
            extra={"expected": 'a view {"angle": [yaw, pitch], "zoom": factor}'},
        ),
    ] = None
    schema: Annotated[
        str, Meta(title="Schema", description="Address of this schema, for editors.")
    ] = field(name="$schema", default="")

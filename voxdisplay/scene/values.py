"""Annotations of the values in scene files: numbers, expressions, points, colours.

Each has the description that editors show, and in ``expected`` the words in which an error asks
for it. They must not know object types.
"""

from typing import Annotated, Literal

from msgspec import Meta, Struct

from voxdisplay.expressions.operations import FUNCTIONS
from voxdisplay.expressions.parse import MAX_LENGTH

MAX_SIDE = 65535

_Text = Annotated[str, Meta(max_length=MAX_LENGTH)]

Number = Annotated[
    float | _Text,
    Meta(
        title="Number",
        description="A number, or an expression in numbers, constants and the scene's params.",
        extra={"expected": "a number or an expression"},
    ),
]


class Track(Struct, forbid_unknown_fields=True, frozen=True):
    """A value that changes with the time, from key to key."""

    keys: Annotated[
        list[Annotated[tuple[Number, Number], Meta(extra={"expected": "a key [seconds, value]"})]],
        Meta(
            min_length=1,
            title="Keys",
            description="Times in seconds, ascending, and values there: [[at, value], ...]. Before "
            "the first and behind the last the value stays.",
            extra={"expected": "a list of keys [[seconds, value], ...]"},
        ),
    ]
    ease: Annotated[
        Literal["linear", "smooth", "step"],
        Meta(
            title="Ease",
            description="How the value goes from key to key: evenly, beginning and ending slowly, "
            "or at once when the next key is reached.",
        ),
    ] = "linear"


Param = Annotated[
    float | _Text | Track,
    Meta(
        title="Param",
        description="A number, an expression, or in a scene that has a duration a track: "
        '{"keys": [[seconds, value], ...]}.',
        extra={"expected": 'a number, an expression or {"keys": [[seconds, value], ...]}'},
    ),
]
Formula = Annotated[
    float | _Text,
    Meta(
        title="Expression of t",
        description=(
            "An expression in t, numbers, constants (pi tau e deg), the scene's params and the "
            f"functions {' '.join(sorted(FUNCTIONS))}. A condition is a comparison by one of "
            "< <= > >= == !=, as in if(t < 1, a, b)."
        ),
        extra={"expected": "a number or an expression of t"},
    ),
]
BodyFormula = Annotated[
    float | _Text,
    Meta(
        title="Expression",
        description=(
            "An expression in the variables of the surface, numbers, constants (pi tau e deg), the "
            f"scene's params and the functions {' '.join(sorted(FUNCTIONS))}. A condition is a "
            "comparison by one of < <= > >= == !=, as in if(u < 1, a, b)."
        ),
        extra={"expected": "a number or an expression"},
    ),
]
Vector = Annotated[
    tuple[Number, Number, Number],
    Meta(
        title="Point or vector",
        description="Three numbers [x, y, z], in voxels.",
        extra={"expected": "three numbers [x, y, z]"},
    ),
]
Vectors = Annotated[
    list[Vector],
    Meta(
        title="Points",
        description="A list of points [x, y, z], in voxels.",
        extra={"expected": "a list of points [[x, y, z], ...]"},
    ),
]
Numbers = Annotated[list[Number], Meta(extra={"expected": "a list of numbers"})]
Range = Annotated[tuple[Number, Number], Meta(extra={"expected": "two numbers [from, to]"})]
Side = Annotated[
    Annotated[float, Meta(ge=1, le=MAX_SIDE, multiple_of=1)] | _Text,
    Meta(
        title="Side",
        description="A whole number of voxels, or an expression in the scene's params.",
        extra={"expected": "a whole number or an expression"},
    ),
]
Size = Annotated[
    tuple[Side, Side, Side], Meta(extra={"expected": "three whole numbers [nx, ny, nz]"})
]
_Channel = Annotated[int, Meta(ge=0, le=255)]
OneColor = Annotated[
    str | _Channel | Annotated[list[_Channel], Meta(min_length=3, max_length=3)],
    Meta(
        title="Colour",
        description="#rgb, #rrggbb, a CSS colour name, rgb(), hsl() or [red, green, blue], 0 to "
        "255.",
        extra={"expected": "a colour"},
    ),
]


class ColorMap(Struct, forbid_unknown_fields=True, frozen=True):
    """Colours by a value: from the first colour of a map at the lowest one to its last colour."""

    map: Annotated[
        str | Annotated[list[OneColor], Meta(min_length=1)],
        Meta(
            title="Map",
            description="Name of a colour map (gray, hot, magma, inferno, plasma, viridis, "
            "coolwarm, rainbow, phase; with _r behind it reversed), or a list of colours.",
            extra={"expected": "the name of a colour map or a list of colours"},
        ),
    ]
    by: Annotated[
        float | _Text,
        Meta(
            title="By",
            description="An expression in x, y, z, in the object's own parameters (t of a curve, u "
            "and v of a surface), in s, which runs from 0 to 1 along a curve, in value (of a "
            "volume), or in named columns of a file of points.",
            extra={"expected": "an expression"},
        ),
    ]
    range: Annotated[
        Annotated[tuple[Number, Number], Meta(extra={"expected": "two numbers [low, high]"})]
        | None,
        Meta(
            title="Range",
            description="The values [low, high] of the first and the last colour; when left out, "
            "the lowest and the highest of the object.",
            extra={"expected": "two numbers [low, high]"},
        ),
    ] = None


Color = Annotated[
    str | Annotated[list[OneColor], Meta(min_length=1)] | ColorMap | None,
    Meta(
        title="Colour",
        description="#rgb, #rrggbb, a CSS colour name, rgb(), hsl() or [red, green, blue], 0 to "
        "255; or a list of colours, spread along a curve or from the lowest to the highest voxel "
        "of a body. Three "
        "whole numbers are one colour. A list of as many colours as the object has points (types "
        'points and scatter) colours those points. Or colours by a value: {"map": "viridis", '
        '"by": "z"}. When left out, white, or what the file of the object has.',
        extra={"expected": "a colour, a list of colours or a colour map {...}"},
    ),
]


class TransformStep(Struct, forbid_unknown_fields=True, frozen=True):
    """One step of a transform: rotate by an angle, scale or translate."""

    rotate: Annotated[
        Vector | None,
        Meta(title="Rotate", description="Direction of the axis to turn about, of any length."),
    ] = None
    angle: Annotated[
        Number | None,
        Meta(
            title="Angle",
            description="How far to turn, in radians: counter-clockwise as seen from the tip of "
            "the axis.",
        ),
    ] = None
    scale: Annotated[
        # Not a tuple: msgspec 0.23 crashes on a fixed tuple beside a limited string.
        float | _Text | Annotated[list[Number], Meta(min_length=3, max_length=3)] | None,
        Meta(
            title="Scale",
            description="A factor, or three [sx, sy, sz].",
            extra={"expected": "a number or three numbers [sx, sy, sz]"},
        ),
    ] = None
    translate: Annotated[
        Vector | None, Meta(title="Translate", description="How far to move, in voxels.")
    ] = None
    about: Annotated[
        Vector | None,
        Meta(
            title="About",
            description="The point that stays where it is; [0, 0, 0] when left out.",
        ),
    ] = None


Transform = Annotated[
    list[TransformStep],
    Meta(
        title="Transform",
        description="Turns, scalings and moves, in order.",
        extra={"expected": 'a list of steps, such as [{"translate": [1, 0, 0]}]'},
    ),
]

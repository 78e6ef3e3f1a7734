"""Annotations of the values in scene files: numbers, expressions, points, colours.

Each has the description that editors show, and in ``expected`` the words in which an error asks
for it. They must not know object types.
"""

from typing import Annotated

from msgspec import Meta

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
        description="#rgb, #rrggbb, a CSS colour name or [red, green, blue], 0 to 255.",
        extra={"expected": "a colour"},
    ),
]
Color = Annotated[
    str | Annotated[list[OneColor], Meta(min_length=1)],
    Meta(
        title="Colour",
        description="#rgb, #rrggbb, a CSS colour name or [red, green, blue], 0 to 255; or a list "
        "of colours, spread along the curve. Three whole numbers are one colour. A list of as "
        "many colours as the object has points (type points) colours those points.",
        extra={"expected": "a colour or a list of colours"},
    ),
]

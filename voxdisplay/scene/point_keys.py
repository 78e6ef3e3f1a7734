"""Keys of objects that are made of points, which are either inline or in a file beside the scene.

It must not know object types, nor what the points are for.
"""

from typing import Annotated, Literal, Protocol

import numpy as np
from msgspec import Meta

from voxdisplay.scene.evaluation_context import EvaluationContext
from voxdisplay.scene.strands import Strands
from voxdisplay.scene.values import Vectors

InlinePoints = Annotated[
    Vectors | None,
    Meta(title="Points", description="The points [x, y, z], in place of a file."),
]
PointsFile = Annotated[
    str | None,
    Meta(
        title="File",
        description="Path of a file of points, relative to the scene's folder and inside it.",
    ),
]
Gaps = Annotated[
    Literal["split"] | None,
    Meta(
        title="Gaps",
        description="split: rows of the file that are empty or not finite are no points, and "
        "separate strands of ordered points. When left out, they are errors.",
    ),
]


class PointKeys(Protocol):
    """An object with these keys."""

    @property
    def points(self) -> InlinePoints: ...  # noqa: D102 - see the annotations
    @property
    def file(self) -> PointsFile: ...  # noqa: D102
    @property
    def gaps(self) -> Gaps: ...  # noqa: D102


def points_of(keys: PointKeys, kind: str, context: EvaluationContext) -> Strands:
    """Return the points of an object; those that are inline are one strand.

    Parameters
    ----------
    keys : PointKeys
    kind : str
        The object's type, for errors.
    context : EvaluationContext

    Raises
    ------
    SceneError
        If both keys are there or none, or the points are wrong.

    """
    if keys.file is not None and keys.points is None:
        return context.points_from_file("file", keys.file, split=keys.gaps == "split")
    if keys.points is None or keys.file is not None:
        raise context.object_error(f"{kind} needs either the key 'points' or the key 'file'")
    if keys.gaps:
        raise context.object_error("the key 'gaps' belongs to the key 'file'")
    return Strands(context.points("points", keys.points), np.zeros(1, dtype=np.int64))

"""Items of a scene: one curve or body each, with its colour and its place in the file.

Must not know how a file is read.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from voxdisplay.curves import Curve
from voxdisplay.errors import BodyError, CurveError, SceneError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from voxdisplay.bodies import Body
    from voxdisplay.compute.array_types import Floats
    from voxdisplay.scene.coloring import Coloring
    from voxdisplay.scene.json_text import JsonText
    from voxdisplay.scene.placement import Placement


@dataclass(frozen=True, slots=True, eq=False)
class SceneItem:
    """One object of a scene.

    Attributes
    ----------
    type : str
        Its type in the file: ``"parametric"``, ``"sphere"``, ...
    shape : Curve or Body
    color : (k, 3) uint8 array, ColorsByValue or None
        Red, green, blue: one colour, or several spread over the voxels; colours by a value; or
        None, its own colours or white.
    path : str
        Its JSON path in the file, such as ``$.objects[0]``.
    source : JsonText, optional
        The file's text.
    columns : mapping of str to (n,) float64 array, optional
        Values by which it is coloured, of the n points that a curve is made of.
    fit : Placement, optional
        How the scene was fitted to a grid.

    """

    type: str
    shape: Curve | Body
    color: Coloring
    path: str
    source: JsonText | None = field(default=None, repr=False)
    columns: Mapping[str, Floats] | None = field(default=None, repr=False)
    fit: Placement | None = field(default=None, repr=False)

    @property
    def curve(self) -> Curve:
        """The curve of an item that has one.

        Raises
        ------
        TypeError
            If it is a body.

        """
        if not isinstance(self.shape, Curve):
            raise TypeError(f"{self.path} is a {self.type}, and no curve")
        return self.shape

    def scene_error(self, error: CurveError | BodyError) -> SceneError:
        """Return an error of the item's shape as one that names the object's place in the file."""
        found = SceneError(str(error), path=self.path, hint=error.hint)
        return self.source.add_location(found) if self.source else found


class PartSpan(NamedTuple):
    """Items of which a part is shown.

    Attributes
    ----------
    first, end : int
        The items ``first <= i < end`` of a scene.
    begin, stop : float
        The part of all their voxels, in drawing order, from 0 to 1.

    """

    first: int
    end: int
    begin: float
    stop: float

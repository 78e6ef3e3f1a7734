"""Scene model: coloured curves in drawing order, and the grid they were composed for.

It must not read files; of the one it came from it holds the text, for the places in errors.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from voxdisplay import voxelization
from voxdisplay.argument_checks import choice, instance
from voxdisplay.curves import Transformed
from voxdisplay.errors import CurveError, SceneError
from voxdisplay.frame import Drawing, Frame
from voxdisplay.raster.grid import Grid

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from voxdisplay.curves import Curve
    from voxdisplay.scene.json_text import JsonText
    from voxdisplay.voxelization import Sequence

DEFAULT_SIZE = Grid(128, 128, 128)
"""Size of the picture of a scene that names none."""

_MAX_TYPES = 5  # of objects that a repr names


@dataclass(frozen=True, slots=True, eq=False)
class SceneItem:
    """One object of a scene.

    Attributes
    ----------
    type : str
        Its type in the file: ``"parametric"``, ``"circle"``, ...
    curve : Curve
    color : (k, 3) uint8 array
        Red, green, blue: one colour, or several as `Frame.draw` takes them.
    path : str
        Its JSON path in the file, such as ``$.objects[0]``.
    source : JsonText, optional
        The file's text.

    """

    type: str
    curve: Curve
    color: NDArray[np.uint8]
    path: str
    source: JsonText | None = field(default=None, repr=False)

    def scene_error(self, error: CurveError) -> SceneError:
        """Return an error of the item's curve as one that names the object's place in the file."""
        found = SceneError(str(error), path=self.path, hint=error.hint)
        return self.source.add_location(found) if self.source else found


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Contents of a scene file.

    Attributes
    ----------
    size : Grid or None
        The grid it was composed for; None: the display's own.
    items : tuple of SceneItem
        In drawing order.
    notes : tuple of str
        Choices made by the reader, one line each, for people.

    """

    size: Grid | None
    items: tuple[SceneItem, ...]
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        size = f" {self.size}" if self.size else ""
        types = [item.type for item in self.items[:_MAX_TYPES]]
        if len(self.items) > _MAX_TYPES:
            types.append("...")
        named = f" ({', '.join(types)})" if types else ""
        count = len(self.items)
        return f"<Scene{size}: {count} object{'s' * (count != 1)}{named}>"

    def voxelize(self, **options: Any) -> list[Sequence]:
        """Return the sequences of all items, which are voxelised together.

        Parameters
        ----------
        **options
            Of `voxdisplay.voxelize`.

        Raises
        ------
        SceneError
            If a curve cannot be evaluated or drawn; it names the object.

        """
        try:
            return voxelization.voxelize_many((item.curve for item in self.items), **options)
        except CurveError:
            # Voxelised together, they fail together: one by one, to name the object.
            for item in self.items:
                try:
                    voxelization.voxelize(item.curve, **options)
                except CurveError as error:
                    raise item.scene_error(error) from error
            raise

    def draw_on(self, frame: Frame, *, fit: Literal["contain", "none"] = "contain") -> Drawing:
        """Draw all items on a frame: `Frame.draw` of a scene.

        Parameters
        ----------
        frame : Frame
        fit : {"contain", "none"}
            As of `fitted`.

        Returns
        -------
        Drawing
            The sums of all items.

        Raises
        ------
        SceneError
            As of `voxelize`.

        """
        instance("frame", frame, Frame, "a frame")
        fitted, _ = self.fitted(frame.grid, fit)
        drawings = [
            frame.draw(sequence, item.color)
            for sequence, item in zip(fitted.voxelize(), fitted.items, strict=True)
        ]
        return Drawing(
            voxels=sum(drawing.voxels for drawing in drawings),
            clipped=sum(drawing.clipped for drawing in drawings),
            exact_color=all(drawing.exact_color for drawing in drawings),
            undefined=tuple(point for drawing in drawings for point in drawing.undefined),
            jumps=tuple(t for drawing in drawings for t in drawing.jumps),
        )

    def _repr_png_(self) -> bytes | None:
        """Return a picture for notebooks; None without Pillow."""
        frame = Frame(self.size or DEFAULT_SIZE)
        self.draw_on(frame)
        return frame._repr_png_()

    def fitted(
        self, grid: Grid, mode: Literal["contain", "none"] = "contain"
    ) -> tuple[Scene, str | None]:
        """Fit the scene to a display's grid.

        Parameters
        ----------
        grid : Grid
            The display's.
        mode : {"contain", "none"}
            ``"contain"`` scales a scene that was composed for another grid by the same factor in
            x, y and z, so that all of it is shown, and centres it. ``"none"`` keeps the numbers.

        Returns
        -------
        scene : Scene
            This one when there is nothing to change.
        note : str or None
            One line that says what was changed.

        """
        choice("fit", mode, ("contain", "none"))
        grid = Grid.of(grid)
        if mode == "none" or self.size is None or self.size == grid:
            return self, None
        size, room = np.array(self.size, dtype=np.float64), np.array(grid, dtype=np.float64)
        scale = float((room / size).min())
        offset = (room - scale * size) / 2
        items = tuple(
            replace(item, curve=Transformed(item.curve, scale, offset)) for item in self.items
        )
        note = f"scene composed for {self.size}, scaled by {scale:.3g} to {grid}"
        return replace(self, size=grid, items=items), note

"""A scene in memory: coloured curves, and the grid they were composed for.

Knows nothing of the file they came from, but the place that errors name.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from voxdisplay.curves import Transformed

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from voxdisplay.curves import Curve
    from voxdisplay.raster.grid import Grid


@dataclass(frozen=True, slots=True, eq=False)
class SceneItem:
    """One object of a scene.

    Attributes
    ----------
    type : str
        What the file calls it: ``"parametric"``, ``"circle"``, ...
    curve : Curve
    color : (k, 3) uint8 array
        Red, green, blue: one colour, or several that are spread along the curve.
    path : str
        Where it stands in the file, a JSON path such as ``$.objects[0]``.

    """

    type: str
    curve: Curve
    color: NDArray[np.uint8]
    path: str


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """What a scene file means.

    Attributes
    ----------
    size : Grid or None
        The grid it was composed for; None: the display's own.
    items : tuple of Item
        In the order in which they are drawn.

    """

    size: Grid | None
    items: tuple[SceneItem, ...]

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
        if mode not in {"contain", "none"}:
            raise ValueError(f"unknown fit {mode!r}: contain or none")
        if mode == "none" or self.size is None or self.size == grid:
            return self, None
        size, room = np.array(self.size, dtype=np.float64), np.array(grid, dtype=np.float64)
        scale = float((room / size).min())
        offset = (room - scale * size) / 2
        items = tuple(
            replace(item, curve=Transformed(item.curve, scale, offset)) for item in self.items
        )
        note = f"scene composed for {self.size}, scaled by {scale:.3g} to {grid}"
        return Scene(grid, items), note

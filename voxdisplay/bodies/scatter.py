"""Points without an order: each lights its voxel, and nothing joins them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.bodies.body import Body, Kind, invertible
from voxdisplay.bodies.geometry import Bounds, LitVoxels
from voxdisplay.curves import arguments

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from voxdisplay.compute.array_types import Floats

POINT = "point"
"""Name of the values at voxels that say which point lit them."""


class Scatter(Body):
    """Points without an order; each lights the voxel that it is in.

    Parameters
    ----------
    points : (n, 3) array
        In voxels.
    values : mapping of str to (n,) array, optional
        Numbers of the points, by which they can be coloured.

    Attributes
    ----------
    point_count : int
        Number of points.

    """

    def __init__(self, points: ArrayLike, values: Mapping[str, ArrayLike] | None = None) -> None:
        self.points = arguments.points("points", points, least=1)
        self.point_count = len(self.points)
        self.values: dict[str, Floats] = {}
        for name, given in (values or {}).items():
            numbers = arguments.unmasked(given)
            if numbers.shape != (self.point_count,):
                wanted = f"has shape {numbers.shape}, not ({self.point_count},)"
                raise arguments.ArgumentError(f"values[{name!r}]", wanted)
            self.values[name] = numbers
        self._arguments = {"points": self.points, "values": self.values or None}

    @property
    def kind(self) -> Kind:
        """``"points"``."""
        return "points"

    def bounds(self) -> Bounds:
        """Return the bounding box of the points: `Body.bounds`."""
        return self.points.min(axis=0), self.points.max(axis=0)

    def geometry(self, bounds: Bounds, *, certified: bool = False) -> LitVoxels:  # noqa: ARG002 - exact anyway
        """Return the voxels of the points inside a box: `Body.geometry`."""
        low, high = bounds
        inside = ((self.points >= low - 1) & (self.points <= high + 1)).all(axis=1)
        number = np.flatnonzero(inside)
        values = {name: each[inside] for name, each in self.values.items()}
        voxels = np.floor(self.points[inside]).astype(np.int64)
        return LitVoxels(voxels, None, {**values, POINT: number.astype(np.float64)})

    def transformed(self, matrix: ArrayLike, offset: ArrayLike = (0, 0, 0)) -> Scatter:
        """Return the transformed points: `Body.transformed`."""
        by = invertible("matrix", matrix)
        return Scatter(self.points @ by.T + arguments.vector("offset", offset), self.values)

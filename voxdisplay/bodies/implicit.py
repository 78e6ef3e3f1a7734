"""Implicit surfaces f(x, y, z) = 0, and solids f <= 0."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from voxdisplay.bodies.body import Body, Fill, check_fill, transform_bounds
from voxdisplay.bodies.functions import Callback, ScalarFunction
from voxdisplay.bodies.geometry import Bounds, Geometry
from voxdisplay.compute.array_types import Floats
from voxdisplay.curves import arguments
from voxdisplay.curves.arguments import ArgumentError
from voxdisplay.curves.formula_arguments import Formula
from voxdisplay.expressions.interval import Interval
from voxdisplay.expressions.params import resolve_params
from voxdisplay.expressions.parse import constant

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class SpaceFunction(Protocol):
    """A real function of space."""

    @property
    def always_defined(self) -> bool:
        """True if it is known to have a value everywhere."""

    def __call__(self, x: Floats, y: Floats, z: Floats, /) -> Floats:
        """Return the values at arrays that broadcast; not finite where there is none."""

    def enclosure(self, x: Interval, y: Interval, z: Interval, /) -> Interval | None:
        """Return bounds over boxes, nan where nothing is known; None if there are none at all."""


@dataclass(frozen=True, slots=True, eq=False)
class ImplicitFunction(Geometry):
    """The surface f = 0, or the solid f <= 0, in a box.

    Attributes
    ----------
    function : SpaceFunction
    bounds : Bounds
        The box, possibly infinite.
    wires : tuple of (n, 3) float64 arrays
        Polylines near which there must be voxels, however thin the surface is.

    """

    function: SpaceFunction
    bounds: Bounds
    wires: tuple[Floats, ...] = ()

    def transformed(self, matrix: Floats, offset: Floats) -> ImplicitFunction:
        """Return the function of the points ``matrix @ p + offset``."""
        inverse: Floats = np.linalg.inv(matrix).astype(np.float64)
        function = _Mapped(self.function, self.bounds, inverse, offset)
        return ImplicitFunction(
            function,
            transform_bounds(self.bounds, matrix, offset),
            tuple(wire @ matrix.T + offset for wire in self.wires),
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Mapped:
    """A function of the points ``inverse @ (p - offset)``, inside the box of that function."""

    inner: SpaceFunction
    bounds: Bounds
    inverse: Floats
    offset: Floats

    @property
    def always_defined(self) -> bool:
        return self.inner.always_defined

    def __call__(self, x: Floats, y: Floats, z: Floats) -> Floats:
        d = x - self.offset[0], y - self.offset[1], z - self.offset[2]
        at = [sum(m * each for m, each in zip(row, d, strict=True)) for row in self.inverse]
        values = self.inner(*at)
        slack = 0.5 * np.abs(self.inverse).sum(axis=1)  # a voxel that reaches into the box is in it
        for axis, (low, high) in enumerate(zip(*self.bounds, strict=True)):
            if np.isfinite(low) or np.isfinite(high):
                outside = (at[axis] < low - slack[axis]) | (at[axis] > high + slack[axis])
                values = np.where(outside, np.nan, values)
        return values

    def enclosure(self, x: Interval, y: Interval, z: Interval) -> Interval | None:
        d = x - self.offset[0], y - self.offset[1], z - self.offset[2]
        at = [
            d[0] * float(row[0]) + d[1] * float(row[1]) + d[2] * float(row[2])
            for row in self.inverse
        ]
        return self.inner.enclosure(*at)


class Implicit(Body):
    """The surface f(x, y, z) = 0; with ``fill="solid"``, all where f <= 0.

    Parameters
    ----------
    f : str, float, Expression or callable
        An expression of x, y and z, or a callable of three (n,) float64 arrays to (n,).
    box : ((x0, y0, z0), (x1, y1, z1)), optional
        Where it is drawn; without it, as far as the display goes.
    fill : {"shell", "solid"}
    params : mapping of str to float or str, optional
        Names that the expressions may use.

    """

    def __init__(
        self,
        f: Formula | Callback,
        *,
        box: Sequence[Sequence[str | float]] | ArrayLike | None = None,
        fill: Fill = "shell",
        params: Mapping[str, str | float] | None = None,
    ) -> None:
        self.fill = check_fill(fill)
        values = resolve_params({} if params is None else params)
        self.function = ScalarFunction("f", f, ("x", "y", "z"), values)
        self._bounds = _corners(box, values)
        self._arguments = {"f": self.function.source, "box": box, "fill": fill}

    def bounds(self) -> Bounds:
        """Return the box, infinite without one: `Body.bounds`."""
        return self._bounds

    def geometry(self, bounds: Bounds, *, certified: bool = False) -> ImplicitFunction:  # noqa: ARG002 - the function is exact
        """Return the function: `Body.geometry`."""
        return ImplicitFunction(self.function, self._bounds)


def _corners(box: object, values: Mapping[str, float]) -> Bounds:
    if box is None:
        return np.full(3, -np.inf), np.full(3, np.inf)
    if isinstance(box, list | tuple) and len(box) == 2:
        box = [
            [constant(each, values) if isinstance(each, str) else each for each in corner]
            if isinstance(corner, list | tuple)
            else corner
            for corner in box
        ]
    corners = arguments.array("box", box, (2, 3))  # type: ignore[arg-type]
    low, high = corners
    for axis, name in enumerate("xyz"):
        if not low[axis] < high[axis]:
            raise ArgumentError("box", f"is empty along {name}: {low[axis]:g} to {high[axis]:g}")
    return low, high

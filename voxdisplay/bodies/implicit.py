"""Implicit surfaces f(x, y, z) = 0, and solids f <= 0."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from voxdisplay.bodies.body import Body, Fill, check_fill, transform_bounds
from voxdisplay.bodies.functions import Callback, ScalarFunction
from voxdisplay.bodies.geometry import Bounds, Geometry
from voxdisplay.compute.array_types import Bools, Floats
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
    inside : callable, optional
        Of x, y and z, where the function is taken, in a box that is turned; elsewhere it is nan.

    """

    function: SpaceFunction
    bounds: Bounds
    wires: tuple[Floats, ...] = ()
    inside: Callable[[Floats, Floats, Floats], Bools] | None = None

    def transformed(self, matrix: Floats, offset: Floats) -> ImplicitFunction:
        """Return the function of the points ``matrix @ p + offset``."""
        inverse: Floats = np.linalg.inv(matrix).astype(np.float64)
        function = _Mapped(self.function, self.bounds, self.inside, inverse, offset)
        return ImplicitFunction(
            function,
            transform_bounds(self.bounds, matrix, offset),
            tuple(wire @ matrix.T + offset for wire in self.wires),
            function.is_inside,
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Mapped:
    """A function of the points ``inverse @ (p - offset)``, inside the box of that function."""

    inner: SpaceFunction
    bounds: Bounds
    inside: Callable[[Floats, Floats, Floats], Bools] | None
    inverse: Floats
    offset: Floats

    @property
    def always_defined(self) -> bool:
        return self.inner.always_defined

    def __call__(self, x: Floats, y: Floats, z: Floats) -> Floats:
        at = self._before(x, y, z)
        return np.where(self._holds(at), self.inner(*at), np.nan)

    def is_inside(self, x: Floats, y: Floats, z: Floats) -> Bools:
        """Return where points are in the box, or in a voxel that reaches into it."""
        at = self._before(x, y, z)
        holds = self._holds(at)
        return holds if self.inside is None else holds & self.inside(*at)

    def _before(self, x: Floats, y: Floats, z: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the points that are mapped here."""
        d = x - self.offset[0], y - self.offset[1], z - self.offset[2]
        x, y, z = (sum(m * each for m, each in zip(row, d, strict=True)) for row in self.inverse)
        return x, y, z

    def _holds(self, at: tuple[Floats, Floats, Floats]) -> Bools:
        slack = 0.5 * np.abs(self.inverse).sum(axis=1)  # a voxel that reaches into the box is in it
        holds = np.ones(np.broadcast_shapes(*(each.shape for each in at)), dtype=bool)
        for axis, (low, high) in enumerate(zip(*self.bounds, strict=True)):
            if np.isfinite(low) or np.isfinite(high):
                holds &= (at[axis] >= low - slack[axis]) & (at[axis] <= high + slack[axis])
        return holds

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

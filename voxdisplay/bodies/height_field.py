"""Height fields: surfaces z = f(x, y) over a rectangle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from voxdisplay.bodies.body import Body, TransformedBody, invertible
from voxdisplay.bodies.functions import Callback, ScalarFunction
from voxdisplay.bodies.geometry import Bounds, Geometry
from voxdisplay.bodies.parameter_cells import parameter_cells
from voxdisplay.compute.array_types import Floats
from voxdisplay.curves import arguments
from voxdisplay.curves.formula_arguments import Bounds as Range
from voxdisplay.curves.formula_arguments import Formula, parse_range
from voxdisplay.errors import BodyError
from voxdisplay.expressions.gradient import gradient_enclosure
from voxdisplay.expressions.interval import Interval, interval
from voxdisplay.expressions.params import resolve_params

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from voxdisplay.bodies.tessellation import Enclosure


class PlaneFunction(Protocol):
    """A real function of x and y."""

    def __call__(self, x: Floats, y: Floats, /) -> Floats:
        """Return z at arrays that broadcast; not finite where there is none."""

    def enclosure(self, x: Interval, y: Interval, /) -> Interval | None:
        """Return bounds over boxes, nan where nothing is known; None if there are none at all."""


@dataclass(frozen=True, slots=True, eq=False)
class HeightFunction(Geometry):
    """A function z = f(x, y) over a rectangle.

    Attributes
    ----------
    value : PlaneFunction
    low, high : (2,) float64 array
        Corners of the rectangle.

    """

    value: PlaneFunction
    low: Floats
    high: Floats

    def transformed(self, matrix: Floats, offset: Floats) -> Geometry:
        """Return the height field of the points ``matrix @ p + offset``, matrix diagonal."""
        scale = np.diag(matrix)
        if (matrix != np.diag(scale)).any():
            raise BodyError("a height field that is turned is none", hint="draw it as a surface")
        ends = np.sort(np.stack((self.low, self.high)) * scale[:2] + offset[:2], axis=0)
        return HeightFunction(_Scaled(self.value, scale, offset), ends[0], ends[1])


@dataclass(frozen=True, slots=True, eq=False)
class _Scaled:
    value: PlaneFunction
    scale: Floats
    offset: Floats

    def __call__(self, x: Floats, y: Floats) -> Floats:
        inner = (x - self.offset[0]) / self.scale[0], (y - self.offset[1]) / self.scale[1]
        return np.asarray(self.scale[2] * self.value(*inner) + self.offset[2])

    def enclosure(self, x: Interval, y: Interval) -> Interval | None:
        one, two = 1 / self.scale[:2]
        inner = self.value.enclosure(
            (x - float(self.offset[0])) * float(one), (y - float(self.offset[1])) * float(two)
        )
        return None if inner is None else inner * float(self.scale[2]) + float(self.offset[2])


class HeightField(Body):
    """The surface z = f(x, y) over a rectangle.

    Parameters
    ----------
    z : str, float, Expression or callable
        An expression of x and y, in voxels, or a callable of two (n,) float64 arrays to (n,).
    x, y : (a, b)
        The rectangle; numbers, or expressions without variables, a < b.
    params : mapping of str to float or str, optional
        Names that the expressions may use.

    """

    def __init__(
        self,
        z: Formula | Callback,
        *,
        x: Range,
        y: Range,
        params: Mapping[str, str | float] | None = None,
    ) -> None:
        values = resolve_params({} if params is None else params)
        self.x_range, self.y_range = parse_range("x", x, values), parse_range("y", y, values)
        self.function = ScalarFunction("z", z, ("x", "y"), values)
        self._arguments = {"z": self.function.source, "x": self.x_range, "y": self.y_range}

    def bounds(self) -> Bounds:
        """Return a box that holds the surface: heights by sampling, infinite where they are."""
        low, high = (np.array(ends) for ends in zip(self.x_range, self.y_range, strict=True))
        x, y = (np.linspace(*ends, 65) for ends in (self.x_range, self.y_range))
        heights = self.function(x, y[:, None])
        heights = heights[np.isfinite(heights)]
        if not heights.size:
            return np.append(low, 0.0), np.append(high, 0.0)
        spread = heights.max() - heights.min()
        return np.append(low, heights.min() - spread), np.append(high, heights.max() + spread)

    def proven_bounds(self) -> Bounds:
        """Return a box by bounds of the heights: `Body.proven_bounds`."""
        low, high = self.bounds()
        heights = self.function.enclosure(*parameter_cells(self.x_range, self.y_range))
        if heights is not None and np.isfinite([heights.lo, heights.hi]).all():
            low[2] = min(low[2], heights.lo.min())
            high[2] = max(high[2], heights.hi.max())
        return low, high

    def geometry(self, bounds: Bounds, *, certified: bool = False) -> Geometry:  # noqa: ARG002 - column by column
        """Return the function: `Body.geometry`."""
        low, high = (np.array(ends) for ends in zip(self.x_range, self.y_range, strict=True))
        return HeightFunction(self.function, low, high)

    def transformed(self, matrix: ArrayLike, offset: ArrayLike = (0, 0, 0)) -> Body:
        """Return the body under an affine map, a surface if it is turned: `Body.transformed`."""
        by, move = invertible("matrix", matrix), arguments.vector("offset", offset)
        if (by == np.diag(np.diag(by))).all():
            return TransformedBody(self, by, move)
        from voxdisplay.bodies.surface import SurfaceBody  # noqa: PLC0415 - for turned ones alone

        shown = {"surface": self}
        ranges = self.x_range, self.y_range
        surface = SurfaceBody(_OfHeights(self.function), *ranges, fill="shell", shown=shown)
        return surface.transformed(by, move)


class _OfHeights:
    """A height field as a `SurfaceFunction` of u = x and v = y."""

    def __init__(self, function: ScalarFunction) -> None:
        self._function = function

    def __call__(self, u: Floats, v: Floats, /) -> Floats:
        return np.stack((u, v, self._function(u, v)))

    def enclosure(self, u: Interval, v: Interval, /) -> Enclosure | None:
        if self._function.expression is None:
            return None
        height, (by_u, by_v) = gradient_enclosure(self._function.expression, u, v)
        from voxdisplay.bodies.tessellation import Enclosure  # noqa: PLC0415 - as above

        zero, one = interval(0.0), interval(1.0)
        return Enclosure((u, v, height), (one, zero, by_u), (zero, one, by_v))

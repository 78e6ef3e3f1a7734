"""Tori, and tubes about curves: all points within a radius of a line, by distances.

A distance changes by no more than the point moves, which bounds it over boxes. Must not know
voxelisation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, SupportsFloat

import numpy as np

from voxdisplay.argument_checks import instance
from voxdisplay.bodies.body import Body, Fill, check_fill
from voxdisplay.bodies.curve_samples import sample_curve
from voxdisplay.bodies.functions import Callback, ScalarFunction
from voxdisplay.bodies.geometry import Bounds
from voxdisplay.bodies.implicit import ImplicitFunction
from voxdisplay.compute.array_types import Floats, Ints
from voxdisplay.curves import arguments
from voxdisplay.curves.circular import Circle
from voxdisplay.curves.curve import Curve
from voxdisplay.curves.formula_arguments import Formula
from voxdisplay.curves.orthonormal_basis import orthonormal_basis
from voxdisplay.errors import BodyError
from voxdisplay.expressions.interval import Interval
from voxdisplay.expressions.params import resolve_params

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

_THIN = 0.8661
"""Tubes of a smaller radius, in voxels, may pass between the mid-lines: their axes are covered."""
_CELL = 8.0  # of space, whose points share candidates
_PAIRS = 1 << 18  # of points and parts at a time


class _Distance:
    """Base class of functions that change by no more than the point moves."""

    always_defined = True

    def __call__(self, x: Floats, y: Floats, z: Floats, /) -> Floats:
        raise NotImplementedError

    def at_single_points(self, x: Floats, y: Floats, z: Floats, /) -> Floats:
        """Return the values at points that are not near each other."""
        return self(x, y, z)

    def enclosure(self, x: Interval, y: Interval, z: Interval, /) -> Interval | None:
        """Return the value in the middle, give or take half the diagonal."""
        sides = [(each.hi - each.lo) / 2 for each in (x, y, z)]
        middle = self.at_single_points(*((each.lo + each.hi) / 2 for each in (x, y, z)))
        reach = np.sqrt(sides[0] ** 2 + sides[1] ** 2 + sides[2] ** 2)
        reach = reach * (1 + 1e-12) + 1e-9 + 1e-12 * np.abs(middle)
        return Interval(middle - reach, middle + reach)


@dataclass(frozen=True, slots=True, eq=False)
class _TorusDistance(_Distance):
    """Distance from a torus, negative inside."""

    center: Floats
    basis: tuple[Floats, Floats, Floats]
    major: float
    minor: float

    def __call__(self, x: Floats, y: Floats, z: Floats, /) -> Floats:
        d = x - self.center[0], y - self.center[1], z - self.center[2]
        a, b, h = (
            sum(float(n) * each for n, each in zip(axis, d, strict=True) if n)
            for axis in self.basis
        )
        return np.asarray(np.hypot(np.hypot(a, b) - self.major, h) - self.minor)


class Torus(Body):
    """A torus.

    Parameters
    ----------
    center : (3,) array
    major : float
        Radius of the circle in its middle, in voxels.
    minor : float
        Radius of the tube about it, in voxels.
    normal : (3,) array
        Across the circle; of any length but 0.
    fill : {"shell", "solid"}

    """

    def __init__(
        self,
        center: ArrayLike,
        major: SupportsFloat,
        minor: SupportsFloat,
        normal: ArrayLike = (0, 0, 1),
        *,
        fill: Fill = "shell",
    ) -> None:
        self.fill = check_fill(fill)
        at = arguments.vector("center", center)
        basis = orthonormal_basis("normal", normal)
        self._function = _TorusDistance(
            at, basis, arguments.positive("major", major), arguments.positive("minor", minor)
        )
        self._arguments = {
            "center": at,
            "major": self._function.major,
            "minor": self._function.minor,
            "normal": basis[2],
            "fill": fill,
        }

    def bounds(self) -> Bounds:
        """Return the bounding box: `Body.bounds`."""
        f = self._function
        half = f.major * np.sqrt(np.maximum(1 - f.basis[2] ** 2, 0)) + f.minor
        return f.center - half, f.center + half

    def geometry(self, bounds: Bounds, *, certified: bool = False) -> ImplicitFunction:  # noqa: ARG002 - it is exact
        """Return its distance as a function: `Body.geometry`."""
        f = self._function
        wires: tuple[Floats, ...] = ()
        if f.minor < _THIN:
            circle = Circle(f.center, f.major, f.basis[2])
            wires = tuple(sample_curve(circle, *bounds).runs())
        low, high = self.bounds()
        return ImplicitFunction(f, (low - 1, high + 1), wires)


class Tube(Body):
    """All points within a radius of a curve; open curves have round ends.

    Parameters
    ----------
    along : Curve
    radius : float, str, Expression or callable
        In voxels; a formula of the curve's own t, or a callable of (n,) arrays, may vary.
    fill : {"shell", "solid"}
    params : mapping of str to float or str, optional
        Names that the formula may use.

    """

    def __init__(
        self,
        along: Curve,
        radius: Formula | Callback,
        *,
        fill: Fill = "shell",
        params: Mapping[str, str | float] | None = None,
    ) -> None:
        instance("along", along, Curve, "a Curve")
        self.fill = check_fill(fill)
        values = resolve_params({} if params is None else params)
        self.along = along
        self.radius = ScalarFunction("radius", radius, ("t",), values)
        constant = self.radius.expression.constant if self.radius.expression else None
        if constant is not None:
            arguments.positive("radius", constant)
        self._arguments = {"along": along, "radius": self.radius.source, "fill": fill}

    def bounds(self) -> Bounds:
        """Return a box that holds the tube, by sampling the curve: `Body.bounds`."""
        samples = sample_curve(self.along, np.full(3, -np.inf), np.full(3, np.inf))
        reach = float(self._radii(samples.t).max()) + 0.1
        return samples.points.min(axis=0) - reach, samples.points.max(axis=0) + reach

    def geometry(self, bounds: Bounds, *, certified: bool = False) -> ImplicitFunction:  # noqa: ARG002 - by samples
        """Return the distance from it as a function: `Body.geometry`."""
        a, b = self.along.t_range
        widest = float(self._radii(np.linspace(a, b, 257)).max()) + 1
        samples = sample_curve(self.along, bounds[0] - widest, bounds[1] + widest)
        radii = self._radii(samples.t)
        if not samples.first.size:
            far = np.full(3, -np.inf)
            return ImplicitFunction(_TubeDistance(samples.points, radii, samples.first), (far, far))
        wires = tuple(samples.runs()) if radii.min() < _THIN else ()
        low = samples.points.min(axis=0) - radii.max() - 1
        high = samples.points.max(axis=0) + radii.max() + 1
        function = _TubeDistance(samples.points, radii, samples.first)
        return ImplicitFunction(function, (low, high), wires)

    def _radii(self, t: Floats) -> Floats:
        with np.errstate(all="ignore"):
            radii = self.radius(t)
        wrong = np.flatnonzero(~(np.isfinite(radii) & (radii >= 0)))
        if wrong.size:
            at = wrong[0]
            raise BodyError(
                f"{self}: the radius is {radii[at]:g} at t = {t[at]:g}",
                hint="a radius is a number that is not negative, for all t of the curve",
            )
        return radii


@dataclass(frozen=True, slots=True, eq=False)
class _TubeDistance(_Distance):
    """Least distance from the parts of a polyline, less the radius there."""

    points: Floats
    radii: Floats
    first: Ints

    def __call__(self, x: Floats, y: Floats, z: Floats, /) -> Floats:
        x, y, z = np.broadcast_arrays(x, y, z)
        at = np.stack((x, y, z), axis=-1).reshape(-1, 3)
        out = np.empty(len(at))
        if not len(at):
            return out.reshape(x.shape)
        cell = np.floor(at / _CELL).astype(np.int64)
        low = cell.min(axis=0)
        nx, ny, _ = (cell.max(axis=0) - low + 1).tolist()
        key = (cell - low) @ np.array([1, nx, nx * ny])
        order = np.argsort(key, kind="stable")
        starts = np.flatnonzero(np.diff(key[order], prepend=-1))
        for part in np.split(order, starts[1:]):
            out[part] = self._near(at[part])
        return out.reshape(x.shape)

    def at_single_points(self, x: Floats, y: Floats, z: Floats, /) -> Floats:
        """Return the values at (n,) points, each from all parts."""
        at = np.stack((x, y, z), axis=1)
        step = max(_PAIRS // max(self.first.size, 1), 1)
        parts = [
            self._to(at[begin : begin + step], self.first).min(axis=1)
            for begin in range(0, len(at), step)
        ]
        return np.concatenate(parts) if parts else np.empty(0)

    def _near(self, at: Floats) -> Floats:
        """Return the values at points of one cell, (n,)."""
        low, high = at.min(axis=0), at.max(axis=0)
        middle, reach = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
        value = self._to(middle[None], self.first)[0]
        close = self.first[value <= value.min() + 2 * reach + 1e-9]
        if len(at) == 1:
            return np.array([value.min()])
        out = np.full(len(at), np.inf)
        for begin in range(0, close.size, 64):
            part = self._to(at, close[begin : begin + 64])
            np.minimum(out, part.min(axis=1), out=out)
        return out

    def _to(self, at: Floats, first: Ints) -> Floats:
        """Return distance less radius from n points to m straight parts, (n, m)."""
        a, along = self.points[first], self.points[first + 1] - self.points[first]
        square = np.maximum((along * along).sum(axis=1), 1e-300)
        share = (at @ along.T - (a * along).sum(axis=1)) / square
        np.clip(share, 0, 1, out=share)
        total = np.zeros(share.shape)
        for k in range(3):
            d = at[:, k, None] - (a[:, k] + share * along[:, k])
            total += d * d
        radius = self.radii[first]
        return np.asarray(np.sqrt(total) - (radius + share * (self.radii[first + 1] - radius)))

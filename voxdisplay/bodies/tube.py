"""Tori, and tubes about curves: all points within a radius. Must not know voxelisation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, SupportsFloat

import numpy as np

from voxdisplay.argument_checks import instance
from voxdisplay.bodies.ball_chain import BallChain
from voxdisplay.bodies.body import Body, Fill, check_fill, invertible
from voxdisplay.bodies.body_parameters import Toroidal
from voxdisplay.bodies.curve_samples import Samples, sample_curve
from voxdisplay.bodies.functions import Callback, ScalarFunction
from voxdisplay.bodies.geometry import Bounds
from voxdisplay.bodies.implicit import ImplicitFunction
from voxdisplay.compute.array_types import Floats
from voxdisplay.curves import arguments, checked_methods
from voxdisplay.curves.circular import Circle
from voxdisplay.curves.curve import Curve
from voxdisplay.curves.formula_arguments import Formula
from voxdisplay.curves.orthonormal_basis import orthonormal_basis
from voxdisplay.curves.transformed import Transformed
from voxdisplay.errors import BodyError
from voxdisplay.expressions.interval import Interval
from voxdisplay.expressions.params import resolve_params

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

_THIN = 0.8661
"""Tubes of a smaller radius, in voxels, may pass between the mid-lines: their axes are covered."""


@dataclass(frozen=True, slots=True, eq=False)
class _TorusDistance:
    """Distance from a torus, negative inside; it changes by no more than the point moves."""

    center: Floats
    basis: tuple[Floats, Floats, Floats]
    major: float
    minor: float

    @property
    def always_defined(self) -> bool:
        """True if it has a value everywhere: `SpaceFunction`."""
        return True

    def __call__(self, x: Floats, y: Floats, z: Floats, /) -> Floats:
        d = x - self.center[0], y - self.center[1], z - self.center[2]
        a, b, h = (
            sum(float(n) * each for n, each in zip(axis, d, strict=True) if n)
            for axis in self.basis
        )
        return np.asarray(np.hypot(np.hypot(a, b) - self.major, h) - self.minor)

    def enclosure(self, x: Interval, y: Interval, z: Interval, /) -> Interval:
        """Return the value in the middle, give or take half the diagonal."""
        sides = [(each.hi - each.lo) / 2 for each in (x, y, z)]
        middle = self(*((each.lo + each.hi) / 2 for each in (x, y, z)))
        reach = np.sqrt(sides[0] ** 2 + sides[1] ** 2 + sides[2] ** 2)
        reach = reach * (1 + 1e-12) + 1e-9 + 1e-12 * np.abs(middle)
        return Interval(middle - reach, middle + reach)


class Torus(Body):
    """A torus.

    Its voxels have the values u, the angle round the normal, and v, the angle round the tube.

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

    def values_at(self, points: Floats) -> Mapping[str, Floats]:
        """Return the angles u and v: `body_parameters.Toroidal`."""
        f = self._function
        return Toroidal(f.center, f.basis, f.major)(points)

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
    """The union of all balls with centres on a curve: open curves have round ends.

    Its voxels have the values t, the parameter of the nearest ball, and s, the share of the
    curve's length there, from 0 to 1.

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
        self.metric = np.eye(3)  # in which the balls are round
        self._arguments = {"along": along, "radius": self.radius.source, "fill": fill}

    def bounds(self) -> Bounds:
        """Return the bounding box of the tube, by sampling the curve: `Body.bounds`."""
        samples = sample_curve(self.along, np.full(3, -np.inf), np.full(3, np.inf))
        return self._chain(samples).bounds()

    def geometry(self, bounds: Bounds, *, certified: bool = False) -> BallChain:  # noqa: ARG002 - by samples
        """Return balls about points within a tolerance of the curve: `Body.geometry`."""
        checked_methods.check_curve(self.along)
        t = np.linspace(*self.along.t_range, 257)
        none = np.empty((0, 3))
        reach = BallChain(none, np.empty(0), np.empty(0, np.int64), self.metric, {}).reach
        widest = (float(self._radii(t).max()) + 1) * reach
        return self._chain(sample_curve(self.along, bounds[0] - widest, bounds[1] + widest))

    def values_at(self, points: Floats) -> Mapping[str, Floats]:
        """Return t and s of the nearest balls: `Body.values_at`."""
        if not len(points):
            return {"t": np.empty(0), "s": np.empty(0)}
        return self.geometry((points.min(axis=0), points.max(axis=0))).values_at(points)

    def transformed(self, matrix: ArrayLike, offset: ArrayLike = (0, 0, 0)) -> Body:
        """Return the tube of the transformed points: `Body.transformed`."""
        return _TransformedTube(self, matrix, offset)

    def _chain(self, samples: Samples) -> BallChain:
        radii = self._radii(samples.t)
        wires = tuple(samples.runs()) if radii.min() < _THIN else ()
        values = {"t": samples.t, "s": samples.s}
        return BallChain(samples.points, radii, samples.first, self.metric, values, wires)

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


class _TransformedTube(Tube):
    """A tube under an affine map, about a curve that is sampled where it is then."""

    def __init__(self, tube: Tube, matrix: ArrayLike, offset: ArrayLike) -> None:
        by, to = invertible("matrix", matrix), arguments.vector("offset", offset)
        along = tube.along
        whole, start = by, to
        if isinstance(along, Transformed):
            whole, start, along = by @ along.matrix, by @ along.offset + to, along.curve
        self.fill = tube.fill
        self.along = Transformed(along, whole, start)
        self.radius = tube.radius
        self.metric = tube.metric @ np.linalg.inv(by)
        self._arguments = {"body": tube, "matrix": by, "offset": to}

"""Parametric surfaces: three expressions of u and v, or any Python callable."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from voxdisplay.bodies.body import Body, Fill, check_fill, invertible
from voxdisplay.bodies.functions import Callback, Vectorised
from voxdisplay.bodies.geometry import Bounds, TriangleMesh
from voxdisplay.bodies.parameter_cells import parameter_cells
from voxdisplay.bodies.tessellation import Enclosure, SurfaceFunction, tessellate
from voxdisplay.compute.array_types import Floats
from voxdisplay.curves import arguments
from voxdisplay.curves.formula_arguments import Bounds as Range
from voxdisplay.curves.formula_arguments import Formula, parse_formula, parse_range
from voxdisplay.errors import BodyError
from voxdisplay.expressions.gradient import gradient_enclosure
from voxdisplay.expressions.interval import Interval
from voxdisplay.expressions.params import resolve_params
from voxdisplay.expressions.program import Expression, compile_rows

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

_VARIABLES = ("u", "v")
_SAMPLES = 65


class SurfaceBody(Body):
    """Base class of bodies that are a map of a rectangle of parameters into space.

    Parameters
    ----------
    function : SurfaceFunction
    u, v : (float, float)
        Ranges of the parameters.
    fill : {"shell", "solid"}
    shown : mapping of str to object
        Arguments that ``repr`` shows.

    """

    def __init__(
        self,
        function: SurfaceFunction,
        u: tuple[float, float],
        v: tuple[float, float],
        *,
        fill: Fill,
        shown: Mapping[str, object],
    ) -> None:
        self.fill = check_fill(fill)
        self._function = function
        self.u_range, self.v_range = u, v
        self._arguments = dict(shown)

    def bounds(self) -> Bounds:
        """Return a box that holds the surface, by sampling it; it is wider than what was found."""
        u, v = np.meshgrid(*(np.linspace(*r, _SAMPLES) for r in (self.u_range, self.v_range)))
        with np.errstate(all="ignore"):
            points = self._function(u.reshape(-1), v.reshape(-1))
        points = points[:, np.isfinite(points).all(axis=0)]
        if not points.size:
            return np.zeros(3), np.zeros(3)
        low, high = points.min(axis=1), points.max(axis=1)
        # Not more than the steps between samples, and a tenth, is between them.
        margin = 1 + (high - low) / 10
        return low - margin, high + margin

    def proven_bounds(self) -> Bounds:
        """Return a box by bounds of the coordinates: `Body.proven_bounds`."""
        low, high = self.bounds()
        with np.errstate(all="ignore"):
            found = self._function.enclosure(*parameter_cells(self.u_range, self.v_range))
        for axis, within in enumerate(found.position if found else ()):
            if np.isfinite([within.lo, within.hi]).all():
                low[axis] = min(low[axis], within.lo.min())
                high[axis] = max(high[axis], within.hi.max())
        return low, high

    def geometry(self, bounds: Bounds, *, certified: bool = False) -> TriangleMesh:
        """Return triangles within the tolerance of the surface: `Body.geometry`."""
        if self.fill == "solid":  # what is below and above the box counts
            bounds = np.full(3, -np.inf), np.full(3, np.inf)
        try:
            found = tessellate(
                self._function, self.u_range, self.v_range, bounds, certified=certified
            )
        except BodyError as error:
            raise BodyError(f"{self}: {error}", hint=error.hint) from None
        u, v = found.parameters.T
        return TriangleMesh(
            found.vertices,
            found.faces,
            {"u": u.copy(), "v": v.copy()},
            notes=found.notes,
            is_sheet=True,
            follows_body=found.is_proven,
        )

    def transformed(self, matrix: ArrayLike, offset: ArrayLike = (0, 0, 0)) -> Body:
        """Return the surface of the transformed points: `Body.transformed`."""
        by = invertible("matrix", matrix)
        function = _Mapped(self._function, by, arguments.vector("offset", offset))
        shown = {"surface": self, "matrix": by, "offset": function.offset}
        return SurfaceBody(function, self.u_range, self.v_range, fill=self.fill, shown=shown)


class Surface(SurfaceBody):
    """A surface given by formulas.

    ``Surface(x, y, z, u=(a, b), v=(c, d))`` takes three expressions of u and v;
    ``Surface(function, u=(a, b), v=(c, d))`` takes any callable. Sides of the rectangle that are
    one line of the surface are found, and sewn.

    Parameters
    ----------
    x, y, z : str, float or Expression
        The coordinates, in voxels.
    function : callable
        Instead of x, y, z: given u and v, (n,) float64, it returns a (3, n) array, rows x, y, z.
    u, v : (a, b)
        The ranges, a < b. Numbers, or expressions such as ``"2*pi"``.
    fill : {"shell", "solid"}
        What encloses something may be filled.
    params : mapping of str to float or str, optional
        Names that the expressions may use.

    """

    @overload
    def __init__(
        self,
        x: Formula,
        y: Formula,
        z: Formula,
        *,
        u: Range,
        v: Range,
        fill: Fill = "shell",
        params: Mapping[str, str | float] | None = None,
    ) -> None: ...

    @overload
    def __init__(
        self,
        x: Callback,
        *,
        u: Range,
        v: Range,
        fill: Fill = "shell",
        params: Mapping[str, str | float] | None = None,
    ) -> None: ...

    def __init__(
        self,
        x: Formula | Callback,
        y: Formula | None = None,
        z: Formula | None = None,
        *,
        u: Range,
        v: Range,
        fill: Fill = "shell",
        params: Mapping[str, str | float] | None = None,
    ) -> None:
        values = resolve_params({} if params is None else params)
        ranges = parse_range("u", u, values), parse_range("v", v, values)
        shown: dict[str, object]
        if callable(x):
            if y is not None or z is not None:
                raise TypeError("a callable returns all three coordinates: leave out y and z")
            function: SurfaceFunction = _ByCallable(
                Vectorised("the surface", x, _VARIABLES, rows=3)
            )
            shown = {"x": x}
        else:
            if y is None or z is None:
                raise TypeError("Surface needs x, y and z, or one callable")
            formulas = [
                parse_formula(axis, formula, values, variables=_VARIABLES, axis=axis)
                for axis, formula in zip("xyz", (x, y, z), strict=True)
            ]
            if any(formula.variables != _VARIABLES for formula in formulas):
                raise BodyError("x, y, z: expressions of u, v are needed")
            function = _ByFormulas(formulas)
            shown = {axis: each.source for axis, each in zip("xyz", formulas, strict=True)}
        shown |= {"u": ranges[0], "v": ranges[1], "fill": fill, "params": params or None}
        super().__init__(function, *ranges, fill=fill, shown=shown)


class _ByCallable:
    """A callable as a `SurfaceFunction`."""

    def __init__(self, function: Vectorised) -> None:
        self._function = function

    def __call__(self, u: Floats, v: Floats, /) -> Floats:
        return self._function(u, v)

    def enclosure(self, u: Interval, v: Interval, /) -> Enclosure | None:  # noqa: ARG002 - it has none
        return None


class _ByFormulas:
    """Three expressions of u and v as a `SurfaceFunction`."""

    def __init__(self, formulas: list[Expression]) -> None:
        self._formulas = formulas
        self._evaluate = compile_rows(formulas)

    def __getstate__(self) -> dict[str, Any]:
        return {"_formulas": self._formulas}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._evaluate = compile_rows(self._formulas)

    def __call__(self, u: Floats, v: Floats, /) -> Floats:
        return self._evaluate(u, v)

    def enclosure(self, u: Interval, v: Interval, /) -> Enclosure | None:
        rows = [gradient_enclosure(formula, u, v) for formula in self._formulas]
        (x, dx), (y, dy), (z, dz) = rows
        return Enclosure((x, y, z), (dx[0], dy[0], dz[0]), (dx[1], dy[1], dz[1]))


class _Mapped:
    """A surface under an affine map."""

    def __init__(self, inner: SurfaceFunction, matrix: Floats, offset: Floats) -> None:
        self.inner = inner
        self.matrix = matrix
        self.offset = offset

    def __call__(self, u: Floats, v: Floats, /) -> Floats:
        return np.asarray(self.matrix @ self.inner(u, v) + self.offset[:, None])

    def enclosure(self, u: Interval, v: Interval, /) -> Enclosure | None:
        inner = self.inner.enclosure(u, v)
        if inner is None:
            return None
        position, by_u, by_v = (self._mapped(each) for each in inner)
        x, y, z = (p + float(o) for p, o in zip(position, self.offset, strict=True))
        return Enclosure((x, y, z), by_u, by_v)

    def _mapped(
        self, vector: tuple[Interval, Interval, Interval]
    ) -> tuple[Interval, Interval, Interval]:
        rows = [
            vector[0] * float(a) + vector[1] * float(b) + vector[2] * float(c)
            for a, b, c in self.matrix
        ]
        return rows[0], rows[1], rows[2]

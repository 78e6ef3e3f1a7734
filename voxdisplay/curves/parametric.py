"""Curves given by formulas: three expressions of t, or any Python callable.

Knows how a formula is evaluated, not what becomes of its points: values that are not finite pass
through, and are the business of whoever draws the curve.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike

from voxdisplay.compute.array_types import Evaluate, Floats
from voxdisplay.curves import arguments
from voxdisplay.curves.curve import Curve
from voxdisplay.errors import CurveError
from voxdisplay.expressions import program
from voxdisplay.expressions.interval import Interval
from voxdisplay.expressions.params import resolve_params
from voxdisplay.expressions.parse import constant, excerpt, parse
from voxdisplay.expressions.program import Expression

Formula = str | float | Expression
Bounds = Sequence[str | float]
Function = Callable[[Any], ArrayLike]

_AXES = ("x", "y", "z")


class Parametric(Curve):
    """A curve given by formulas.

    ``Parametric(x, y, z, t=(a, b))`` takes three expressions of t, see `expression`, and has an
    exact derivative and an enclosure. ``Parametric(function, t=(a, b))`` takes any callable.

    Parameters
    ----------
    x, y, z : str, float or Expression
        The coordinates, in voxels.
    function : callable
        Instead of x, y, z: given t, (n,) float64, it returns a (3, n) array, rows x, y, z, or
        three rows that broadcast to one. A callable that understands only a single float and
        returns three numbers is called once for each parameter.
    t : (a, b)
        The range, a < b. Numbers, or expressions such as ``"-170*deg"``.
    closed : bool, optional
        Whether P(a) and P(b) are joined. None: found from the end points.
    params : mapping of str to float or str, optional
        Names that the expressions may use.
    dx, dy, dz : str, float or Expression, optional
        Derivatives by t, instead of those found from x, y and z.
    derivative : callable, optional
        Like function: gives dP/dt. Without it, the derivative is not known.

    Raises
    ------
    CurveError
        If an expression does not parse, the range is empty, reversed or not finite, or the
        callable returns the wrong shape.

    """

    @overload
    def __init__(
        self,
        x: Formula,
        y: Formula,
        z: Formula,
        *,
        t: Bounds,
        closed: bool | None = None,
        params: Mapping[str, str | float] | None = None,
        dx: Formula | None = None,
        dy: Formula | None = None,
        dz: Formula | None = None,
    ) -> None: ...

    @overload
    def __init__(
        self,
        x: Function,
        *,
        t: Bounds,
        closed: bool | None = None,
        params: Mapping[str, str | float] | None = None,
        derivative: Function | None = None,
    ) -> None: ...

    def __init__(
        self,
        x: Formula | Function,
        y: Formula | None = None,
        z: Formula | None = None,
        *,
        t: Bounds,
        closed: bool | None = None,
        params: Mapping[str, str | float] | None = None,
        dx: Formula | None = None,
        dy: Formula | None = None,
        dz: Formula | None = None,
        derivative: Function | None = None,
    ) -> None:
        values = resolve_params(params or {})
        self._formulas: list[Expression] = []
        self.t_range = _range(t, values)
        self.closed = closed
        if callable(x):
            if any(formula is not None for formula in (y, z, dx, dy, dz)):
                raise TypeError(
                    "a callable gives all three coordinates: y, z, dx, dy, dz do not fit"
                )
            self._position = _vectorised("the curve", x, self.t_range)
            self._derivative = derivative and _vectorised(
                "the derivative", derivative, self.t_range
            )
            return
        if y is None or z is None:
            raise TypeError("Parametric needs x, y and z, or one callable")
        if derivative is not None:
            raise TypeError("derivative goes with a callable; with expressions use dx, dy, dz")
        self._formulas = formulas = [
            _formula(axis, axis, formula, values)
            for axis, formula in zip(_AXES, (x, y, z), strict=True)
        ]
        self.family = tuple(formula.template for formula in formulas)
        slopes = [
            formula.derivative if slope is None else _formula(axis, f"d{axis}", slope, values).value
            for axis, formula, slope in zip(_AXES, formulas, (dx, dy, dz), strict=True)
        ]
        self._position = program.compile_rows(formulas)
        self._derivative = _stacked(slopes)

    @property
    def thread_safe(self) -> bool:
        """True if it is given by expressions; nothing is known of callables."""
        return bool(self._formulas)

    def position(self, t: Floats) -> Floats:
        """Give the points at t, (n,), as a (3, n) float64 array."""
        return self._position(t)

    @staticmethod
    def batch_evaluator(curves: Sequence[Parametric]) -> Evaluate:
        """Prepare to evaluate formulas that differ in numbers only, see `Curve.batch_evaluator`."""
        formulas = zip(*(curve._formulas for curve in curves), strict=True)
        rows = [program.batch_evaluator(row) for row in formulas]
        return lambda which, t: np.stack([row(which, t) for row in rows])

    def derivative(self, t: Floats) -> Floats | None:
        """Give dP/dt at t, (n,), as a (3, n) float64 array, or None when it is not known."""
        return self._derivative(t) if self._derivative else None

    def enclosure(self, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats] | None:
        """Give boxes that hold the curve from t_lo to t_hi, (n,): (3, n), (3, n). Not a callable.

        Nothing is known where a formula may have no value for some t in between. But an interval
        as narrow as parameters can be told apart may end where values do, as those of sqrt(1 - t)
        at t = 1, and holds for the values there are.
        """
        if not self._formulas:
            return None
        low, high = np.empty((3, t_lo.size)), np.empty((3, t_lo.size))
        wide = t_hi - t_lo > 4 * np.spacing(np.abs(self.t_range).max())
        for row, formula in enumerate(self._formulas):
            values = formula.enclosure(Interval(t_lo, t_hi))
            low[row], high[row] = values.lo, values.hi
            if values.may_be_undefined is not False:
                low[row, values.may_be_undefined & wide] = np.nan
        return low, high


def _range(t: Bounds, values: Mapping[str, float]) -> tuple[float, float]:
    if isinstance(t, str) or len(t) != 2:
        raise arguments.ArgumentError("t", f"must be two numbers (a, b), not {excerpt(t)}")
    low, high = (constant(bound, values) for bound in t)
    return arguments.parameter_range("t", low, high)


def _formula(axis: str, name: str, formula: Formula, values: Mapping[str, float]) -> Expression:
    if isinstance(formula, Expression):
        return formula
    try:
        return parse(formula, values)
    except CurveError as error:
        raise CurveError(f"{name}: {error}", axis=axis, hint=error.hint) from None


def _stacked(rows: Sequence[Callable[[Floats], Floats]]) -> Callable[[Floats], Floats]:
    def evaluate(t: Floats) -> Floats:
        return np.stack([row(t) for row in rows])

    return evaluate


def _vectorised(
    what: str, function: Function, t_range: tuple[float, float]
) -> Callable[[Floats], Floats]:
    """Make (n,) -> (3, n) of a callable, having tried on two parameters how it wants to be called.

    Two, because three parameters would make (3, n) and (n, 3) the same shape.
    """
    a, b = t_range
    trial = np.array([a, a + (b - a) / 2])

    def at_once(t: Floats) -> Floats:
        with np.errstate(all="ignore"):
            return _rows(what, function(t), t.size)

    def one_by_one(t: Floats) -> Floats:
        out = np.empty((3, t.size))
        for i, one in enumerate(t.tolist()):
            out[:, i] = _point(what, function, one)
        return out

    try:
        at_once(trial)
    except CurveError:
        raise
    except (TypeError, ValueError) as error:  # as of math.cos and "if t < 0", given an array
        try:
            one_by_one(trial)
        except CurveError:
            raise
        except (TypeError, ValueError):
            raise CurveError(
                f"{what} cannot be called: {type(error).__name__}: {error}",
                hint="it must take an (n,) array and return a (3, n) array",
            ) from error
        return one_by_one
    return at_once


def _point(what: str, function: Function, t: float) -> Floats:
    """Call a callable for one parameter: (3,), nan where it has no value there."""
    try:
        result = function(t)
    except (ArithmeticError, ValueError):  # as of 1 / 0 and math.log(0)
        return np.full(3, np.nan)
    point = np.asarray(result, dtype=np.float64)
    if point.shape != (3,):
        raise CurveError(f"{what} returned shape {point.shape}, not (3,), for one parameter")
    return point


def _rows(what: str, result: Any, n: int) -> Floats:
    """Check and copy the result of a callable: (3, n), or three rows that broadcast to that."""
    if isinstance(result, tuple | list) and len(result) == 3:
        result = np.stack(np.broadcast_arrays(*result, np.empty(n))[:3])
    points = np.array(result, dtype=np.float64)
    if points.shape != (3, n):
        raise CurveError(
            f"{what} returned shape {points.shape}, not (3, {n}), for {n} parameters",
            hint="rows are x, y, z: np.stack((x, y, z)), or .T if they are columns",
        )
    return points

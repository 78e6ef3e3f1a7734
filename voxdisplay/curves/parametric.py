"""Parametric curves: three expressions of t, or any Python callable.

Must not know what its points are used for: values that are not finite pass through.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike

from voxdisplay.compute.array_types import Bools, Evaluate, Floats
from voxdisplay.curves import arguments, checked_methods
from voxdisplay.curves.curve import Curve
from voxdisplay.curves.formula_arguments import Bounds, Formula, parse_formula, parse_range
from voxdisplay.errors import CurveError
from voxdisplay.expressions import program
from voxdisplay.expressions.interval import Interval
from voxdisplay.expressions.params import resolve_params
from voxdisplay.expressions.program import Expression

Function = Callable[[Any], ArrayLike]

_AXES = ("x", "y", "z")


class Parametric(Curve):
    """A curve given by formulas.

    ``Parametric(x, y, z, t=(a, b))`` takes three expressions of t, see `expressions.parse`, and
    has an exact derivative and an enclosure. ``Parametric(function, t=(a, b))`` takes any
    callable.

    Parameters
    ----------
    x, y, z : str, float or Expression
        The coordinates, in voxels.
    function : callable
        Instead of x, y, z: given t, (n,) float64, it returns a (3, n) array, rows x, y, z, or
        three rows that broadcast to one. A callable that understands only a single float and
        returns three numbers is called once for each parameter. It must return the same for the
        same t; the array it gets is its own to change.
    t : (a, b)
        The range, a < b. Numbers, or expressions such as ``"-170*deg"``.
    closed : bool, optional
        Whether P(a) and P(b) are joined. None: found from the end points.
    params : mapping of str to float or str, optional
        Names that the expressions may use.
    dx, dy, dz : str, float or Expression, optional
        Derivatives by t, instead of those found from x, y and z.
    derivative : callable, optional
        Like function: returns dP/dt. Without it, the derivative is not known.

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
        values = resolve_params({} if params is None else params)
        self._formulas: list[Expression] = []
        self._always_defined = False
        self.t_range = parse_range("t", t, values)
        self.closed = closed
        shown: dict[str, object]
        if callable(x):
            if any(formula is not None for formula in (y, z, dx, dy, dz)):
                raise TypeError(
                    "a callable returns all three coordinates: leave out y, z, dx, dy, dz"
                )
            self._function = _Vectorised("the curve", x, self.t_range)
            self._derivative = derivative and _Vectorised(
                "the derivative", derivative, self.t_range
            )
            shown = {"x": x}
        else:
            if y is None or z is None:
                raise TypeError("Parametric needs x, y and z, or one callable")
            if derivative is not None:
                raise TypeError("derivative goes with a callable; with expressions use dx, dy, dz")
            self._formulas = formulas = [
                parse_formula(axis, formula, values, axis=axis)
                for axis, formula in zip(_AXES, (x, y, z), strict=True)
            ]
            self.family = tuple(formula.template for formula in formulas)
            self._slopes = [
                None if slope is None else parse_formula(f"d{axis}", slope, values, axis=axis)
                for axis, slope in zip(_AXES, (dx, dy, dz), strict=True)
            ]
            self._evaluate = program.compile_rows(formulas)
            self._always_defined = all(formula.always_defined for formula in formulas)
            shown = {axis: formula.source for axis, formula in zip(_AXES, formulas, strict=True)}
        self._arguments = shown | {"t": self.t_range, "closed": closed, "params": params or None}

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "_evaluate"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        if self._formulas:
            self._evaluate = program.compile_rows(self._formulas)

    @property
    def always_defined(self) -> bool:
        """True if it is given by expressions that divide by nothing that may be 0."""
        return self._always_defined

    @property
    def thread_safe(self) -> bool:
        """True if it is given by expressions; nothing is known of callables."""
        return bool(self._formulas)

    def position(self, t: Floats) -> Floats:
        """Return the points at t, (n,), as a (3, n) float64 array."""
        return self._evaluate(t) if self._formulas else self._function(t)

    @staticmethod
    def batch_evaluator(curves: Sequence[Parametric]) -> Evaluate:
        """Return an evaluator of formulas that differ in numbers: see `Curve.batch_evaluator`."""
        formulas = zip(*(curve._formulas for curve in curves), strict=True)
        rows = [program.batch_evaluator(row) for row in formulas]
        return lambda which, t: np.stack([row(which, t) for row in rows])

    def derivative(self, t: Floats) -> Floats | None:
        """Return dP/dt at t, (n,), as a (3, n) float64 array, or None when it is not known."""
        if not self._formulas:
            return self._derivative(t) if self._derivative else None
        return np.stack(
            [
                formula.derivative(t) if slope is None else slope.value(t)
                for formula, slope in zip(self._formulas, self._slopes, strict=True)
            ]
        )

    @np.errstate(all="ignore")
    def enclosure(self, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats] | None:
        """Return boxes, (3, n) and (3, n), that hold the curve from t_lo to t_hi; None: a callable.

        Nothing is known where a formula may have no value for some t in between. An interval as
        narrow as the resolution of parameters is an exception: it may end where values do, as
        those of sqrt(1 - t) at t = 1, and its bounds hold for the values there are.
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

    @np.errstate(all="ignore")
    def unbounded(self, t_lo: Floats, t_hi: Floats) -> Bools | None:
        """Return where a formula has no finite bounds: see `Curve.unbounded`. None: a callable."""
        if not self._formulas:
            return None
        found = np.zeros(t_lo.size, dtype=bool)
        for formula in self._formulas:
            if not formula.always_defined:
                values = formula.enclosure(Interval(t_lo, t_hi))
                found |= ~(np.isfinite(values.lo) & np.isfinite(values.hi))
        return found


class _Vectorised:
    """A callable as a function of (n,) parameters to (3, n) points.

    How it wants to be called is tried on two parameters: three would make (3, n) and (n, 3) the
    same shape.

    Parameters
    ----------
    what : str
        What it is, for errors.
    function : callable
    t_range : (float, float)

    """

    def __init__(self, what: str, function: Function, t_range: tuple[float, float]) -> None:
        self._what = what
        self._function = function
        self._one_by_one = False
        a, b = t_range
        trial = np.array([a, a + (b - a) / 2])
        try:
            self._all_at_once(trial)
        except CurveError:
            raise
        except ArithmeticError:
            self(trial)
        except (TypeError, ValueError) as error:  # as of math.cos and "if t < 0", given an array
            self._one_by_one = True
            try:
                self(trial)
            except CurveError as other:
                if isinstance(other.__cause__, TypeError):
                    raise CurveError(
                        f"{what} cannot be called: {type(error).__name__}: {error}",
                        hint="it must take an (n,) array and return a (3, n) array",
                    ) from error
                raise
        except Exception as error:
            raise checked_methods.raised(what, error) from error

    def __call__(self, t: Floats) -> Floats:
        with np.errstate(all="ignore"):
            if not self._one_by_one:
                try:
                    points: Floats = checked_methods.call(self._what, self._all_at_once, t)
                except ArithmeticError:  # at one of them, maybe: the others have values
                    if t.size == 1:
                        return np.full((3, 1), np.nan)
                else:
                    return points
                parts = [self(t[i : i + 1]) for i in range(t.size)]
                return np.concatenate(parts, axis=1) if parts else np.empty((3, 0))
            one_by_one = np.empty((3, t.size))
            for i, one in enumerate(t.tolist()):
                one_by_one[:, i] = _point(self._what, self._function, one)
            return one_by_one

    def _all_at_once(self, t: Floats) -> Floats:
        # A copy: a function that works in place must not change the caller's t.
        return _rows(self._what, self._function(t.copy()), t.size)


def _point(what: str, function: Function, t: float) -> Floats:
    """Call a callable for one parameter; return (3,), nan where it has no value there."""
    try:
        result = function(t)
    except CurveError:
        raise
    except (ArithmeticError, ValueError):  # as of 1 / 0 and math.log(0)
        return np.full(3, np.nan)
    except Exception as error:
        raise checked_methods.raised(what, error) from error
    point = arguments.real_numbers(what, result)
    if point.shape != (3,):
        raise CurveError(f"{what} returned shape {point.shape}, not (3,), for one parameter")
    return point


def _rows(what: str, result: Any, n: int) -> Floats:
    """Return a checked copy of what a callable returned: (3, n), or rows that broadcast to that."""
    if isinstance(result, tuple | list) and len(result) == 3:
        rows = [arguments.real_numbers(what, row) for row in result]
        if all(row.shape in {(), (1,), (n,)} for row in rows):
            result = np.stack(np.broadcast_arrays(*rows, np.empty(n))[:3])
    return arguments.curve_points(what, result, n)

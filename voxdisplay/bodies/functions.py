"""Real functions of several variables: expressions, or callables.

Must not know what their values are used for: those that are not finite pass through.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from voxdisplay.compute.array_types import Floats
from voxdisplay.curves import arguments, checked_methods
from voxdisplay.curves.formula_arguments import Formula, parse_formula
from voxdisplay.errors import BodyError, CurveError
from voxdisplay.expressions.interval import Interval
from voxdisplay.expressions.program import Expression

Callback = Callable[..., ArrayLike]

Derivative = tuple[Interval, ...]


class ScalarFunction:
    """A real function of named variables.

    Parameters
    ----------
    name : str
        Name of the argument that it was, for errors.
    function : str, float, Expression or callable
        A callable takes as many (n,) float64 arrays as there are variables, its own to change, and
        returns (n,) values; one that understands only floats is called once for each.
    variables : tuple of str
    values : mapping of str to float
        Params of expressions.

    """

    def __init__(
        self,
        name: str,
        function: Formula | Callback,
        variables: tuple[str, ...],
        values: Mapping[str, float],
    ) -> None:
        self._name = name
        self.expression: Expression | None = None
        if callable(function):
            self._callback = Vectorised(name, function, variables, rows=1)
            self.source: object = function
        else:
            self.expression = parse_formula(name, function, values, variables=variables)
            if self.expression.variables != variables:
                raise BodyError(f"{name}: an expression of {', '.join(variables)} is needed")
            self.source = self.expression.source

    @property
    def always_defined(self) -> bool:
        """True if it is known to have a value everywhere."""
        return self.expression is not None and self.expression.always_defined

    def __call__(self, *variables: Floats) -> Floats:
        """Return the values at arrays that broadcast, of the shape to which they do."""
        if self.expression is not None:
            return self.expression.value(*variables)
        spread = np.broadcast_arrays(*variables)
        values = self._callback(*(each.reshape(-1) for each in spread))
        return np.asarray(values[0].reshape(spread[0].shape))

    def enclosure(self, *variables: Interval) -> Interval | None:
        """Return bounds over intervals, nan where nothing is known; None for callables."""
        if self.expression is None:
            return None
        return known(self.expression.enclosure(*variables))


def known(bounds: Interval) -> Interval:
    """Return bounds that are nan where there may be no value."""
    if bounds.may_be_undefined is False:
        return bounds
    lo = np.where(bounds.may_be_undefined, np.nan, bounds.lo)
    return Interval(lo, np.where(bounds.may_be_undefined, np.nan, bounds.hi))


class Vectorised:
    """A callable as a function of (n,) arrays to (rows, n).

    Parameters
    ----------
    what : str
        Its name, for errors.
    function : callable
    variables : tuple of str
        Names of its arguments.
    rows : int
        Numbers that it returns for one point; if it is one, a plain array will do.

    """

    def __init__(
        self, what: str, function: Callback, variables: tuple[str, ...], *, rows: int
    ) -> None:
        self._what = what
        self._function = function
        self._variables = variables
        self._rows = rows
        self._one_by_one = False

    def __call__(self, *variables: Floats) -> Floats:
        """Return the values, (rows, n), at (n,) float64 arrays; nan where there is none."""
        n = variables[0].size
        if not self._one_by_one:
            try:
                with np.errstate(all="ignore"):
                    result = self._function(*(each.copy() for each in variables))
                return self._checked(result, n)
            except (BodyError, CurveError):
                raise
            except ArithmeticError:  # at one of them, maybe
                pass
            except (TypeError, ValueError) as error:  # as of math.cos, given an array
                self._one_by_one = True
                self._refuse_if_unable(variables, error)
            except Exception as error:
                raise self._raised(error) from error
        out = np.empty((self._rows, n))
        for i, point in enumerate(zip(*(each.tolist() for each in variables), strict=True)):
            try:
                out[:, i] = self._checked(self._function(*point), 1)[:, 0]
            except (BodyError, CurveError):
                raise
            except (ArithmeticError, ValueError):  # as of 1 / 0 and math.log(0)
                out[:, i] = np.nan
            except Exception as error:
                raise self._raised(error) from error
        return out

    def _raised(self, error: Exception) -> BodyError:
        return BodyError(str(checked_methods.raised(self._what, error)))

    def _refuse_if_unable(self, variables: tuple[Floats, ...], cause: Exception) -> None:
        try:
            self._function(*(float(each[0]) if each.size else 0.0 for each in variables))
        except TypeError:
            names = ", ".join(self._variables)
            raise BodyError(
                f"{self._what} cannot be called: {type(cause).__name__}: {cause}",
                hint=f"it must take arrays {names} of n numbers and return {self._wanted()}",
            ) from cause
        except Exception:  # noqa: BLE001 - called again, it is told
            return

    def _wanted(self) -> str:
        return "n numbers" if self._rows == 1 else f"{self._rows} rows of n numbers"

    def _checked(self, result: Any, n: int) -> Floats:
        if self._rows > 1 and isinstance(result, tuple | list) and len(result) == self._rows:
            rows = [arguments.real_numbers(self._what, row) for row in result]
            if all(row.shape in {(), (1,), (n,)} for row in rows):
                result = np.stack(np.broadcast_arrays(*rows, np.empty(n))[: self._rows])
        numbers = arguments.real_numbers(self._what, result)
        if self._rows == 1 and numbers.shape in ((n,), (), (1,)):
            numbers = np.broadcast_to(numbers, (1, n))
        if numbers.ndim == 1 and n == 1:
            numbers = numbers[:, None]
        if numbers.shape != (self._rows, n):
            raise BodyError(
                f"{self._what} returned shape {numbers.shape} for {n} points",
                hint=f"it must return {self._wanted()}",
            )
        return numbers

"""Checks of curve classes that are written outside of this package.

What their methods return is checked where it comes from, so that an error names the class and the
method, whoever calls it. Must not know what curves are used for.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, wraps
from types import FunctionType
from typing import Any, overload

import numpy as np

from voxdisplay import argument_checks
from voxdisplay.compute.array_types import Bools, Floats
from voxdisplay.curves import arguments
from voxdisplay.curves.short_repr import short_repr
from voxdisplay.errors import CurveError, VoxDisplayError

_PACKAGE = __name__.partition(".")[0]
MAX_DEGREE = 1 << 16


NO_BREAKS: Floats = np.empty(0)
NO_BREAKS.flags.writeable = False


class Breaks:
    # Of the descriptor, whose text is that of the attribute: what is assigned is checked.
    """Parameters inside the range, (k,) ascending, where the direction may turn sharply.

    The vertices of a polyline, for example. A hint for sampling, never needed for correctness.
    May be assigned, and may be an attribute of a class.
    """

    def __init__(self, default: Floats) -> None:
        self._default = default

    @overload
    def __get__(self, curve: None, owner: type) -> Breaks: ...

    @overload
    def __get__(self, curve: Any, owner: type) -> Floats: ...

    def __get__(self, curve: Any, owner: type) -> Floats | Breaks:
        if curve is None:
            return self
        found: Floats = curve.__dict__.get("breaks", self._default)
        return found

    def __set__(self, curve: Any, value: Any) -> None:
        curve.__dict__["breaks"] = breaks(f"{type(curve).__name__}.breaks", value)


def is_foreign(cls: type) -> bool:
    """Return whether a class is defined outside of this package."""
    return cls.__module__.partition(".")[0] != _PACKAGE


def call(what: str, function: Callable[..., Any], *given: Any) -> Any:
    """Call somebody else's function; raise CurveError for what it raises.

    Errors of arithmetic pass: they may concern one parameter of many. Those of this package pass.
    """
    try:
        return function(*given)
    except (ArithmeticError, VoxDisplayError):
        raise
    except Exception as error:
        raise raised(what, error) from error


def raised(what: str, error: Exception) -> CurveError:
    """Return the CurveError for what somebody else's function raised."""
    text = f": {error}" if str(error) else ""
    return CurveError(f"{what} raised {type(error).__name__}{text}")


def check_class(cls: type) -> None:
    """Replace the methods and attributes that a class defines itself by checked ones."""
    for name, value in tuple(vars(cls).items()):
        if name in _METHODS and callable(value):
            setattr(cls, name, _METHODS[name](value))
        elif name == "batch_evaluator" and isinstance(value, staticmethod):
            cls.batch_evaluator = staticmethod(  # type: ignore[attr-defined]
                _batch_evaluator(value.__func__)
            )
        elif name in ATTRIBUTES:
            _check_attribute(cls, name, value)


def _check_attribute(cls: type, name: str, value: Any) -> None:
    check, what = ATTRIBUTES[name], f"{cls.__qualname__}.{name}"
    if isinstance(value, property) and value.fget is not None:
        getter = value.fget
        setattr(cls, name, value.getter(lambda self: check(what, call(what, getter, self))))
    elif isinstance(value, cached_property):
        function = value.func
        cached = cached_property(lambda self: check(what, call(what, function, self)))
        cached.__set_name__(cls, name)
        setattr(cls, name, cached)
    elif isinstance(value, FunctionType) or not hasattr(type(value), "__get__"):
        checked = check(what, value)
        setattr(cls, name, Breaks(checked) if name == "breaks" else checked)


def check_curve(curve: Any) -> None:
    """Raise an error if what a curve of a foreign class says of itself is of another kind."""
    if not is_foreign(type(curve)):
        return
    of = type(curve).__name__
    for name in ("closed", "family", "point_count"):
        ATTRIBUTES[name](f"{of}.{name}", getattr(curve, name))
    found = getattr(curve, "t_range", None)
    try:
        first, last = map(float, found)  # type: ignore[arg-type]
    except (OverflowError, TypeError, ValueError):
        raise CurveError(
            f"{of}.t_range must be two numbers, (first, last), not {short_repr(found)}"
        ) from None
    if not (np.isfinite(first) and np.isfinite(last) and first < last):
        raise CurveError(f"{of}.t_range must be finite and ascending, not {first:g} to {last:g}")


# ------------------------------------------------------------------------------- attributes


def breaks(what: str, value: Any) -> Floats:
    """Return parameters as a read-only array, ascending, or raise an error that names them."""
    if isinstance(value, np.ndarray) and value.dtype == np.float64 and not value.flags.writeable:
        return value  # checked before
    found = np.unique(arguments.array(what, value, (None,)))
    found.flags.writeable = False
    return found


def _degree(what: str, value: Any) -> int | None:
    return None if value is None else argument_checks.whole_number(what, value, 0, MAX_DEGREE)


def _length(what: str, value: Any) -> float:
    length = argument_checks.finite(what, value)
    if length < 0:
        raise ValueError(f"{what}: expected a length, found {length:g}")
    return length


def _closed(what: str, value: Any) -> bool | None:
    return None if value is None else argument_checks.flag(what, value)


def _family(what: str, value: Any) -> Any:
    try:
        hash(value)
    except TypeError:
        raise argument_checks.wrong_kind(what, "something hashable", value) from None
    return value


def _point_count(what: str, value: Any) -> int | None:
    return None if value is None else argument_checks.whole_number(what, value, 1, 1 << 40)


ATTRIBUTES: dict[str, Callable[[str, Any], Any]] = {
    "breaks": breaks,
    "degree": _degree,
    "min_length": _length,
    "always_defined": argument_checks.flag,
    "thread_safe": argument_checks.flag,
    "closed": _closed,
    "family": _family,
    "point_count": _point_count,
}
"""Checks of what curves say of themselves, by name."""


# ---------------------------------------------------------------------------------- methods


def _position(method: Callable[..., Any]) -> Callable[..., Floats]:
    what = method.__qualname__

    @wraps(method)
    def position(self: Any, t: Floats) -> Floats:
        # It may work in place: it gets an array of its own.
        try:
            return arguments.curve_points(what, call(what, method, self, t.copy()), t.size)
        except ArithmeticError:  # at one of the parameters, maybe: the others have points
            if t.size <= 1:
                return np.full((3, t.size), np.nan)
        return np.concatenate([position(self, t[i : i + 1]) for i in range(t.size)], axis=1)

    return position


def _derivative(method: Callable[..., Any]) -> Callable[..., Floats | None]:
    what = method.__qualname__

    @wraps(method)
    def derivative(self: Any, t: Floats) -> Floats | None:
        try:
            slopes = call(what, method, self, t.copy())
        except ArithmeticError:
            return np.full((3, t.size), np.nan)
        return None if slopes is None else arguments.curve_points(what, slopes, t.size)

    return derivative


def _enclosure(method: Callable[..., Any]) -> Callable[..., tuple[Floats, Floats] | None]:
    what = method.__qualname__

    @wraps(method)
    def enclosure(self: Any, t_lo: Floats, t_hi: Floats) -> tuple[Floats, Floats] | None:
        try:
            box = call(what, method, self, t_lo.copy(), t_hi.copy())
        except ArithmeticError:  # nothing is known
            return np.full((3, t_lo.size), np.nan), np.full((3, t_lo.size), np.nan)
        if box is None:
            return None
        if not isinstance(box, tuple | list | np.ndarray) or len(box) != 2:
            raise CurveError(
                f"{what} returned {argument_checks.described(box)}",
                hint="it must return two (3, n) arrays, the low and the high ends, or None",
            )
        low, high = (arguments.curve_points(what, end, t_lo.size) for end in box)
        with np.errstate(all="ignore"):
            crossed = low > high
        if crossed.any():
            row, at = np.argwhere(crossed)[0]
            raise CurveError(
                f"{what} returned {low[row, at]:g} as the low end of {'xyz'[row]} and "
                f"{high[row, at]:g} as its high end, from t = {float(t_lo[at])!r} "
                f"to {float(t_hi[at])!r}",
                axis="xyz"[row],
            )
        return low, high

    return enclosure


def _unbounded(method: Callable[..., Any]) -> Callable[..., Bools | None]:
    what = method.__qualname__

    @wraps(method)
    def unbounded(self: Any, t_lo: Floats, t_hi: Floats) -> Bools | None:
        try:
            found = call(what, method, self, t_lo.copy(), t_hi.copy())
        except ArithmeticError:
            return np.ones(t_lo.size, dtype=bool)
        if found is None:
            return None
        flags: Bools = np.asarray(found if isinstance(found, np.ndarray | list) else True)
        if flags.dtype != bool or flags.shape != t_lo.shape:
            raise CurveError(
                f"{what} returned {argument_checks.described(found)}",
                hint="it must return an (n,) array of True and False, or None",
            )
        return flags

    return unbounded


def _batch_evaluator(function: Callable[..., Any]) -> Callable[..., Any]:
    what = function.__qualname__
    whose = f"the function of {what}"

    @wraps(function)
    def batch_evaluator(curves: Any) -> Any:
        try:
            evaluate = call(what, function, curves)
        except ArithmeticError as error:
            raise raised(what, error) from error
        if not callable(evaluate):
            raise CurveError(
                f"{what} returned {argument_checks.described(evaluate)}",
                hint="it must return a function of indices and parameters, (n,), to (3, n) points",
            )

        def checked(which: Any, t: Floats) -> Floats:
            try:
                found = call(whose, evaluate, which.copy(), t.copy())
            except ArithmeticError as error:
                raise raised(whose, error) from error
            return arguments.curve_points(whose, found, t.size)

        return checked

    return batch_evaluator


_METHODS: dict[str, Callable[[Callable[..., Any]], Callable[..., Any]]] = {
    "position": _position,
    "derivative": _derivative,
    "enclosure": _enclosure,
    "unbounded": _unbounded,
}

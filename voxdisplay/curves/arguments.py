"""Validation of arguments of curves and bodies: each error names the argument.

Must not know the curves and the bodies.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, SupportsFloat

import numpy as np

from voxdisplay import argument_checks
from voxdisplay.errors import BodyError, CurveError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from voxdisplay.compute.array_types import Floats


_SMALL = 64  # numbers
MAX_MAGNITUDE = 1e100
"""Largest accepted magnitude: products of a few such numbers do not overflow."""


_NO_NUMBERS = "cMmV"
"""Kinds of arrays that numpy would convert: complex numbers, dates, durations, records."""
_TEXTS = "SU"


class ArgumentError(CurveError, BodyError):
    """A wrong argument of a curve or a body.

    Parameters
    ----------
    argument : str
        Its name.
    problem : str
        The rest of the message, after the name.

    """

    def __init__(self, argument: str, problem: str, *, hint: str | None = None) -> None:
        super().__init__(f"{argument} {problem}", hint=hint)
        self.argument = argument


def finite(name: str, value: SupportsFloat) -> float:
    """Return a finite float, or raise ArgumentError."""
    try:
        number = argument_checks.number(name, value)
    except TypeError:
        raise ArgumentError(name, f"is not a number: {argument_checks.described(value)}") from None
    except ValueError:
        raise ArgumentError(name, "is too large") from None
    if not math.isfinite(number):
        raise ArgumentError(name, f"is not finite: {number}")
    if abs(number) > MAX_MAGNITUDE:
        raise ArgumentError(name, f"is too large: {number:g}")
    return number


def positive(name: str, value: SupportsFloat) -> float:
    """Return a positive finite float, or raise ArgumentError."""
    number = finite(name, value)
    if number <= 0:
        raise ArgumentError(name, f"must be positive, not {number:g}")
    return number


def whole(name: str, value: SupportsFloat) -> int:
    """Return an int, or raise ArgumentError if the number is not whole."""
    number = finite(name, value)
    if not number.is_integer():
        raise ArgumentError(name, f"must be a whole number, not {number:g}")
    return int(number)


def array(name: str, value: ArrayLike, shape: tuple[int | None, ...]) -> Floats:
    """Return a finite float64 array of a shape, None for any length, or raise ArgumentError."""
    try:
        if isinstance(value, np.ndarray) and value.dtype.kind in _NO_NUMBERS:
            raise TypeError  # noqa: TRY301 - as of a list of complex numbers
        numbers = unmasked(value)
    except (OverflowError, TypeError, ValueError):
        raise ArgumentError(name, "is not an array of numbers") from None
    fits = numbers.ndim == len(shape)
    for got, wanted in zip(numbers.shape, shape, strict=False):
        fits = fits and wanted in (None, got)
    if not fits:
        want = ", ".join("n" if side is None else str(side) for side in shape)
        raise ArgumentError(
            name, f"has shape {numbers.shape}, not ({want}{',' * (len(shape) == 1)})"
        )
    # The norm settles nearly all small arrays, in a fraction of the time.
    settled = numbers.size <= _SMALL and math.hypot(*numbers.ravel().tolist()) <= MAX_MAGNITUDE
    if not (settled or (np.abs(numbers) <= MAX_MAGNITUDE).all()):
        first = tuple(np.argwhere(~(np.abs(numbers) <= MAX_MAGNITUDE))[0])
        finite(name + "".join(f"[{i}]" for i in first), numbers[first])
    return numbers


def unmasked(value: ArrayLike) -> Floats:
    """Return a copy of an array as float64, nan where it is masked."""
    if type(value) is np.ndarray and value.dtype == np.float64:
        return value.copy()
    if argument_checks.is_masked_array(value):
        value = np.ma.filled(value.astype(np.float64), np.nan)
    return np.array(value, dtype=np.float64)


def vector(name: str, value: ArrayLike) -> Floats:
    """Return a finite (3,) float64 array, or raise ArgumentError."""
    plain = type(value) is np.ndarray and value.dtype == np.float64
    parts: Any = value.tolist() if plain else value  # type: ignore[union-attr]
    if type(parts) in (list, tuple) and len(parts) == 3:
        good = [type(part) is float and -MAX_MAGNITUDE <= part <= MAX_MAGNITUDE for part in parts]
        if all(good):  # as most are, and checked sooner than by numpy
            return np.array(parts)
    return array(name, value, (3,))


def points(name: str, value: ArrayLike, *, least: int) -> Floats:
    """Return a finite (n, 3) float64 array of ``least`` points or more, or raise ArgumentError."""
    empty = isinstance(value, list | tuple) and not value
    numbers = array(name, np.empty((0, 3)) if empty else value, (None, 3))
    if len(numbers) < least:
        found = "1 point" if len(numbers) == 1 else f"{len(numbers)} points"
        raise ArgumentError(name, f"has {found}, at least {least} are needed")
    return numbers


def parameter_range(name: str, low: float, high: float) -> tuple[float, float]:
    """Return (low, high), finite and ascending, or raise ArgumentError."""
    a, b = finite(f"{name}[0]", low), finite(f"{name}[1]", high)
    if a >= b:
        raise ArgumentError(name, f"{'is empty' if a == b else 'runs backwards'}: {a:g} to {b:g}")
    return a, b


def curve_points(what: str, result: object, n: int) -> Floats:
    """Return a checked copy of the points, (3, n), of somebody else's function, or raise."""
    points = real_numbers(what, result)
    if points.shape != (3, n):
        raise CurveError(
            f"{what} returned shape {points.shape}, not (3, {n}), for {n} parameters",
            hint="rows are x, y, z: np.stack((x, y, z)), or .T if they are columns",
        )
    return points


def real_numbers(what: str, result: object) -> Floats:
    """Return a copy of what a callable returned as float64, or raise CurveError."""
    try:
        if argument_checks.is_masked_array(result):
            return unmasked(result)
        numbers = np.asarray(result)
        kind = "complex numbers" if np.iscomplexobj(numbers) else None
        if kind is None and numbers.dtype.kind in _NO_NUMBERS + _TEXTS:
            raise TypeError  # noqa: TRY301 - numpy would convert texts as well
        if kind is None:
            return unmasked(numbers)
    except (OverflowError, TypeError, ValueError):
        found = argument_checks.described(result)
        raise CurveError(f"{what} returned no numbers: {found}") from None
    raise CurveError(f"{what} returned {kind}", hint="return real ones: .real, .imag or abs()")

"""Checks of arguments of public functions: errors name the argument and what is wanted.

Must not know any of the packages that use it.
"""

from __future__ import annotations

import math
import reprlib
import sys
from collections.abc import Callable
from numbers import Integral
from typing import TYPE_CHECKING, Any, TypeGuard

if TYPE_CHECKING:
    import numpy as np

_SHORT = reprlib.Repr()
_SHORT.maxother = _SHORT.maxstring = 60


def described(value: object) -> str:
    """Return the type of a value and a short text of it, for messages."""
    return f"{type(value).__name__} {_SHORT.repr(value)}"


def wrong_kind(name: str, wanted: str, value: object) -> TypeError:
    """Return the error of an argument that is of another kind than wanted."""
    return TypeError(f"{name}: expected {wanted}, found {described(value)}")


def is_masked_array(value: object) -> TypeGuard[np.ma.MaskedArray[Any, Any]]:
    """Return whether a value is a masked array.

    numpy imports the class on first use, which takes as long as all of a small scene. Whoever has
    a masked array has imported it.
    """
    return isinstance(value, getattr(sys.modules.get("numpy.ma"), "MaskedArray", ()))


def number(name: str, value: Any) -> float:
    """Return a real number as a float; raise `TypeError` for anything else, texts too."""
    if (
        isinstance(value, str | bytes | bytearray)
        or _dimensions(value)
        or not hasattr(type(value), "__float__")
    ):
        raise wrong_kind(name, "a number", value)
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"{name}: {_SHORT.repr(value)} is too large") from None
    except (TypeError, ValueError):
        raise wrong_kind(name, "a number", value) from None


def finite(name: str, value: Any) -> float:
    """Return a finite number as a float; raise `TypeError` or `ValueError` otherwise."""
    result = number(name, value)
    if not math.isfinite(result):
        raise ValueError(f"{name}: expected a finite number, found {result:g}")
    return result


def positive(name: str, value: Any) -> float:
    """Return a finite number above 0 as a float; raise `TypeError` or `ValueError` otherwise."""
    result = number(name, value)
    if not 0 < result < float("inf"):
        raise ValueError(f"{name}: expected a number above 0, found {result:g}")
    return result


def distances(name: str, value: Any) -> tuple[float, float, float]:
    """Return three numbers above 0, for x, y and z; raise `TypeError` or `ValueError` otherwise."""
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise wrong_kind(name, "three distances [x, y, z]", value)
    x, y, z = (positive(name, each) for each in value)
    return x, y, z


def duration(name: str, value: Any) -> float:
    """Return a finite number of seconds, 0 or more; raise `TypeError` or `ValueError` otherwise."""
    seconds = number(name, value)
    if not 0 <= seconds < float("inf"):
        raise ValueError(f"{name}: expected 0 or more seconds, found {seconds:g}")
    return seconds


def whole_number(name: str, value: Any, least: int, most: int) -> int:
    """Return a whole number of a range; raise `TypeError` or `ValueError` for anything else."""
    if isinstance(value, bool) or not hasattr(type(value), "__index__") or _dimensions(value):
        raise wrong_kind(name, "a whole number", value)
    result = int(value)
    if not least <= result <= most:
        raise ValueError(f"{name}: expected {least} to {most}, found {_SHORT.repr(result)}")
    return result


def flag(name: str, value: Any) -> bool:
    """Return the truth of a value; raise `TypeError` if it has none, as an array has not."""
    if _dimensions(value):  # even an empty one, whose truth older numpy tells with a warning
        raise wrong_kind(name, "True or False", value)
    try:
        return bool(value)
    except (TypeError, ValueError):
        raise wrong_kind(name, "True or False", value) from None


def choice(name: str, value: Any, known: tuple[Any, ...]) -> None:
    """Raise `ValueError` if a value is none of those known, `TypeError` if of another kind."""
    names = ", ".join(map(repr, known))
    # Integers and texts of numpy, and those of enumerations, too.
    kinds = tuple(Integral if isinstance(each, int) else type(each) for each in known)
    if isinstance(value, bool) or not isinstance(value, kinds):
        raise wrong_kind(name, f"one of {names}", value)
    if value not in known:
        raise ValueError(f"{name}: expected one of {names}, found {_SHORT.repr(value)}")


def instance(name: str, value: object, kind: type, wanted: str) -> None:
    """Raise `TypeError` if a value is no instance of a class."""
    if not isinstance(value, kind):
        raise wrong_kind(name, wanted, value)


def function(name: str, value: object) -> Callable[..., Any] | None:
    """Return a callable or None; raise `TypeError` for anything else."""
    if value is not None and not callable(value):
        raise wrong_kind(name, "a callable or None", value)
    return value


def _dimensions(value: Any) -> int:
    """Return the number of dimensions of a numpy array; 0 for anything else."""
    return value.ndim if isinstance(getattr(value, "ndim", None), int) else 0

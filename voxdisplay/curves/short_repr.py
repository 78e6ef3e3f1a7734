"""Short texts of curve arguments, for ``repr``. Knows no particular curve."""

from __future__ import annotations

import reprlib

import numpy as np

from voxdisplay.argument_checks import is_masked_array

MAX_ROWS = 3
"""Longer arrays are abbreviated to their first rows and a count."""
MAX_CHARACTERS = 60
"""Longer texts, such as expressions, are cut in the middle."""

_TEXTS = reprlib.Repr()
_TEXTS.maxstring = _TEXTS.maxother = MAX_CHARACTERS


def short_repr(value: object) -> str:
    """Return a short text of an argument: numbers to 6 digits, long arrays and texts cut."""
    if isinstance(value, bool | np.bool_):
        return str(bool(value))
    if isinstance(value, float | int | np.number):
        try:
            return f"{float(value):.6g}"
        except OverflowError:
            return _TEXTS.repr(value)
    if is_masked_array(value) and value is np.ma.masked:
        return "masked"
    if isinstance(value, np.ndarray) and value.ndim == 0:
        return short_repr(value[()])
    if isinstance(value, tuple | list | np.ndarray):
        entries = [short_repr(entry) for entry in value[:MAX_ROWS]]
        rest = len(value) - MAX_ROWS
        if rest > 0:
            entries.append(f"... {rest} more")
        is_point = isinstance(value, tuple) or not any(np.iterable(entry) for entry in value)
        brackets = "()" if is_point else "[]"
        return brackets[0] + ", ".join(entries) + brackets[1]
    if callable(value):
        return str(getattr(value, "__qualname__", None) or type(value).__qualname__)
    return _TEXTS.repr(value)

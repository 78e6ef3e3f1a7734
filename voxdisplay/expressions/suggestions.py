"""Hints for unknown names in expressions: the word of this language for what was meant.

A hint is right or absent. What other languages call a function is looked up, not guessed by
likeness: ``arctan`` is no misspelt ``tan``. A misspelling is one slip of the keys in a word.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

SYNONYMS = {
    "sine": "write 'sin'",
    "cosine": "write 'cos'",
    "tangent": "write 'tan'",
    "arcsin": "write 'asin'",
    "arccos": "write 'acos'",
    "arctan": "write 'atan'",
    "arctan2": "write 'atan2'",
    "arctg": "write 'atan'",
    "atn": "write 'atan'",
    "tg": "write 'tan'",
    "ctg": "write 'cot'",
    "cotan": "write 'cot'",
    "cosec": "write 'csc'",
    "sh": "write 'sinh'",
    "ch": "write 'cosh'",
    "th": "write 'tanh'",
    "arcsinh": "write 'asinh'",
    "arsinh": "write 'asinh'",
    "arccosh": "write 'acosh'",
    "arcosh": "write 'acosh'",
    "arctanh": "write 'atanh'",
    "artanh": "write 'atanh'",
    "lg": "write 'log10'",
    "ld": "write 'log2'",
    "lb": "write 'log2'",
    "logn": "write log(x) / log(base)",
    "log1p": "write log(1 + x)",
    "expm1": "write exp(x) - 1",
    "exp2": "write 2**x",
    "exp10": "write 10**x",
    "pow": "write a**b",
    "power": "write a**b",
    "sq": "write x**2",
    "sqr": "write x**2, or sqrt(x) for the root",
    "square": "write x**2",
    "cube": "write x**3",
    "root": "write sqrt(x), cbrt(x) or x**(1/n)",
    "sgn": "write 'sign'",
    "signum": "write 'sign'",
    "fabs": "write 'abs'",
    "magnitude": "write 'abs' or 'hypot'",
    "norm": "write 'hypot'",
    "length": "write 'hypot'",
    "minimum": "write 'min'",
    "fmin": "write 'min'",
    "maximum": "write 'max'",
    "fmax": "write 'max'",
    "clip": "write clamp(x, low, high)",
    "saturate": "write clamp(x, 0, 1)",
    "lerp": "write mix(a, b, x)",
    "int": "write 'floor', or 'round' for the nearest",
    "trunc": "write sign(x) * floor(abs(x))",
    "fix": "write sign(x) * floor(abs(x))",
    "frac": "write mod(x, 1)",
    "fract": "write mod(x, 1)",
    "ceiling": "write 'ceil'",
    "rint": "write 'round'",
    "modulo": "write 'mod'",
    "iif": "write if(condition, a, b)",
    "ifelse": "write if(condition, a, b)",
    "where": "write if(condition, a, b)",
    "select": "write if(condition, a, b)",
    "step": "write if(x < edge, 0, 1)",
    "heaviside": "write if(x < 0, 0, 1)",
    "rad": "write x*deg for degrees to radians",
    "radians": "write x*deg for degrees to radians",
    "degrees": "write x/deg for radians to degrees",
    "and": "write if(a, if(b, x, y), y)",
    "or": "write if(a, x, if(b, x, y))",
    "not": "exchange the last two arguments of if(condition, a, b)",
    "inf": "numbers are finite",
    "infinity": "numbers are finite",
    "nan": "numbers are finite",
}
"""Names or formulas here for functions and constants of other languages."""

ARGUMENT_HINTS = {
    ("log", 2): "write log(x) / log(base)",
    ("ln", 2): "write log(x) / log(base)",
    ("round", 2): "write round(x * 10**digits) / 10**digits",
    ("atan", 2): "write atan2(y, x)",
    ("mod", 1): "write mod(a, b)",
    ("atan2", 1): "write atan(x), or atan2(y, x)",
}
"""Functions that are meant where one has so many arguments, and takes another number."""


def suggest(word: str, known: Iterable[str]) -> str | None:
    """Return a hint for an unknown word, or None.

    Parameters
    ----------
    word : str
    known : iterable of str
        Words that may stand in its place.

    """
    lower = word.lower()
    known = list(known)
    if lower in SYNONYMS:
        return SYNONYMS[lower]
    same = [each for each in known if each.lower() == lower]
    near = same or [each for each in known if _one_slip(lower, each.lower())]
    return f"did you mean {near[0]!r}?" if len(near) == 1 else None


def _one_slip(word: str, other: str) -> bool:
    """Return whether one letter was missed, added, replaced or exchanged with the next."""
    if min(len(word), len(other)) < 3 or abs(len(word) - len(other)) > 1 or word == other:
        return False
    start = next((i for i, (a, b) in enumerate(zip(word, other, strict=False)) if a != b), None)
    if start is None:  # one begins with the other: "sinn", not "sinh"
        longer = max(word, other, key=len)
        return len(word) > len(other) and longer[-1] == longer[-2]
    if len(word) != len(other):
        longer, shorter = (word, other) if len(word) > len(other) else (other, word)
        return longer[start + 1 :] == shorter[start:] and len(shorter) > 3
    swapped = word[start : start + 2] == other[start : start + 2][::-1]
    if swapped and word[start + 2 :] == other[start + 2 :]:
        return True
    return len(word) > 4 and word[start + 1 :] == other[start + 1 :]

"""The colour functions ``rgb()`` and ``hsl()`` of CSS Color Module Level 4, sections 5 and 7.

Must not know names of colours.
"""

from __future__ import annotations

import math
import re
from typing import Final

_NUMBER: Final = re.compile(
    r"([+-]?(?:[0-9]+(?:\.[0-9]+)?|\.[0-9]+)(?:e[+-]?[0-9]{1,3})?)([a-z]*|%)"
)
_DEGREES: Final = {"": 1.0, "deg": 1.0, "grad": 0.9, "rad": 180 / math.pi, "turn": 360.0}
_LONGEST: Final = 200
_FORMS: Final = {
    "rgb": "rgb(255 136 0), rgb(255, 136, 0) or rgb(100% 53% 0%)",
    "hsl": "hsl(32 100% 50%) or hsl(32deg, 100%, 50%)",
}


def parse_color_function(text: str) -> tuple[int, int, int] | None:
    """Return red, green and blue, each 0 to 255, of ``rgb()`` or ``hsl()``; None of other texts.

    Values outside their range are clamped, and fractions rounded, ties upwards. ``rgba()`` and
    ``hsla()`` are the same functions.

    Parameters
    ----------
    text : str
        In lower case, without blanks around it.

    Raises
    ------
    ValueError
        If it begins as such a function and is none, or is not opaque.

    """
    match = re.match("(rgb|hsl)a?\\(", text)
    if match is None:
        return None
    name = match.group(1)
    if len(text) > _LONGEST or not text.endswith(")"):
        raise _wrong(name)
    first, second, third = _components(name, text[match.end() : -1])
    if name == "rgb":
        red, green, blue = (_channel(each) for each in (first, second, third))
        return red, green, blue
    return _from_hsl(_hue(first), _share(second), _share(third))


def _wrong(name: str) -> ValueError:
    return ValueError(f"the colour function {name}() is written like {_FORMS[name]}")


def _components(name: str, inner: str) -> list[tuple[float, str]]:
    """Return three numbers with their units, of the form with commas or that with blanks."""
    commas = "," in inner
    if commas:
        parts = [part.strip() for part in inner.split(",")]
        alpha = parts[3:]
    else:
        before, *alpha = inner.split("/")
        parts = before.split()
    if len(parts[:3]) != 3 or len(alpha) > 1 or (not commas and len(parts) != 3):
        raise _wrong(name)
    found = [_number(name, part, none=not commas) for part in parts[:3]]
    if commas and name == "rgb" and len({unit for _, unit in found}) > 1:
        raise _wrong(name)  # all numbers, or all percentages
    if commas and name == "hsl" and {unit for _, unit in found[1:]} != {"%"}:
        raise _wrong(name)
    units = ("", "%")
    for at, (_, unit) in enumerate(found):
        if unit not in (_DEGREES if name == "hsl" and at == 0 else units):
            raise _wrong(name)
    for each in alpha:
        value, unit = _number(name, each.strip(), none=False)
        if unit not in units:
            raise _wrong(name)
        if value < (100 if unit else 1):
            raise ValueError("voxels are not transparent: leave the colour's alpha out")
    return found


def _number(name: str, text: str, *, none: bool) -> tuple[float, str]:
    if none and text == "none":
        return 0.0, ""
    match = _NUMBER.fullmatch(text)
    if match is None:
        raise _wrong(name)
    value = float(match.group(1))
    if not math.isfinite(value):
        raise _wrong(name)
    return value, match.group(2)


def _channel(component: tuple[float, str]) -> int:
    value, unit = component
    return _rounded(value / 100 if unit else value / 255)


def _hue(component: tuple[float, str]) -> float:
    value, unit = component
    return math.fmod(value * _DEGREES[unit], 360) if abs(value) < 1e300 else 0.0


def _share(component: tuple[float, str]) -> float:
    return min(max(component[0] / 100, 0.0), 1.0)


def _from_hsl(hue: float, saturation: float, lightness: float) -> tuple[int, int, int]:
    """Return red, green and blue of a hue in degrees: CSS Color 4, section 7.1."""
    chroma = saturation * min(lightness, 1 - lightness)

    def channel(offset: float) -> int:
        at = (offset + hue / 30) % 12
        return _rounded(lightness - chroma * max(-1.0, min(at - 3, 9 - at, 1.0)))

    return channel(0), channel(8), channel(4)


def _rounded(share: float) -> int:
    # A sum of products that should be a tie misses it by some ulps.
    return math.floor(min(max(share, 0.0), 1.0) * 255 + 0.5 + 1e-9)

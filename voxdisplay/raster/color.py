"""Parsing of colours: CSS names and functions, ``#rrggbb``, triples of 0 to 255, lists of these.

Must not know displays or curves.
"""

from __future__ import annotations

import re
import reprlib
from collections.abc import Sequence
from numbers import Real
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from voxdisplay.argument_checks import described, wrong_kind
from voxdisplay.errors import did_you_mean
from voxdisplay.raster.array_arguments import as_array

Color: TypeAlias = str | Sequence[str | int | Sequence[int]] | NDArray[np.integer]

_KINDS: Final = "a CSS name, '#rrggbb', (r, g, b) of 0 to 255, or a list of these"


def parse_color(text: str) -> tuple[int, int, int]:
    """Return red, green and blue, each 0 to 255, of a colour's text, in capitals or not.

    Parameters
    ----------
    text : str
        A name of CSS, ``#rgb``, ``#rrggbb``, ``rgb(255 136 0)`` or ``hsl(32deg 100% 50%)``.

    Raises
    ------
    ValueError
        If it is no colour; the message names the nearest one.

    """
    name = text.strip().lower()
    digits = NAMED.get(name)
    if digits is None and (match := re.fullmatch(r"#((?:[0-9a-f]{3}){1,2})", name)):
        digits = match.group(1)
    if digits is None and "(" in name:
        from voxdisplay.raster.css_functions import parse_color_function  # noqa: PLC0415 - rare

        if (found := parse_color_function(name)) is not None:
            return found
    if digits is None:
        near = did_you_mean(name, NAMED) or "write a CSS colour name, #rgb or #rrggbb"
        raise ValueError(f"unknown colour {reprlib.repr(text)}: {near}")
    if len(digits) == 3:
        digits = "".join(2 * digit for digit in digits)
    red, green, blue = bytes.fromhex(digits)
    return red, green, blue


def as_colors(color: Color) -> NDArray[np.uint8]:
    """Return one or several colours as an array: the one place that reads colours of all kinds.

    Parameters
    ----------
    color : str, three int, sequence of these, or integer array
        A text as `parse_color` takes it; or red, green and blue, 0 to 255, in a tuple, a list or
        a (3,) array; or a list of such colours, or a (k, 3) array, spread along the curve. Three
        whole numbers are always one colour.

    Returns
    -------
    (k, 3) uint8 array
        Columns red, green, blue; k is 1 for a single colour.

    Raises
    ------
    ValueError
        If one is no colour, or there is none.
    TypeError
        If it is of another kind.

    """
    if isinstance(color, str):
        return np.array([parse_color(color)], dtype=np.uint8)
    if isinstance(color, np.ndarray):
        color = as_array("color", color)
        names = color.ndim == 1 and color.dtype.kind in "UO"
        return as_colors(color.tolist()) if names else _from_array(color)
    if not isinstance(color, Sequence) or isinstance(color, bytes | bytearray):
        raise wrong_kind("color", _KINDS, color)
    if not len(color):
        raise ValueError("a list of colours needs at least one")
    if all(isinstance(part, Real | np.generic) for part in color):
        return _from_array(np.array([_channels(color)]))
    return np.array([_one_color(part) for part in color], dtype=np.uint8)


def _one_color(color: object) -> tuple[int, int, int]:
    if isinstance(color, str):
        return parse_color(color)
    if isinstance(color, Sequence | np.ndarray) and not isinstance(color, bytes | bytearray):
        red, green, blue = _from_array(np.array([_channels(color)]))[0].tolist()
        return red, green, blue
    raise TypeError(f"a colour in a list is a name, '#rrggbb' or (r, g, b); not {described(color)}")


def _channels(color: Sequence[Any] | NDArray[Any]) -> list[Any]:
    """Return red, green and blue as a list, having checked that they are three numbers."""
    channels = list(color)
    if len(channels) != 3 or not all(isinstance(part, Real | np.generic) for part in channels):
        raise ValueError(
            f"red, green and blue are three whole numbers, 0 to 255; this is {reprlib.repr(color)}"
        )
    return channels


def _from_array(colors: NDArray[Any]) -> NDArray[np.uint8]:
    """Return a (3,) or (k, 3) array of whole numbers as (k, 3) uint8."""
    rows = colors[None] if colors.shape == (3,) else colors
    if rows.ndim != 2 or rows.shape[1] != 3 or len(rows) == 0:
        raise ValueError(f"colours are a (3,) or (k, 3) array, k >= 1; this is {colors.shape}")
    if rows.dtype.kind == "f":
        raise ValueError(
            "colours are whole numbers from 0 to 255, not fractions: multiply 0..1 by 255 and round"
        )
    if rows.dtype.kind not in "iu":
        raise ValueError(f"colours are whole numbers from 0 to 255; this is {rows.dtype}")
    if rows.min() < 0 or rows.max() > 255:
        raise ValueError(f"colours are 0 to 255; here they are {rows.min()} to {rows.max()}")
    return rows.astype(np.uint8)


def interpolate_colors(colors: NDArray[np.uint8], count: int) -> NDArray[np.uint8]:
    """Return ``count`` colours that lead evenly through k colours, blending: (count, 3) uint8.

    Integers decide, with ties upwards, so that a device can compute the same.
    """
    if len(colors) == 1:
        return np.broadcast_to(colors, (count, 3))
    return blend(colors, count, np.arange(count))


def blend(stops: NDArray[np.uint8], count: int, places: NDArray[np.integer]) -> NDArray[np.uint8]:
    """Return the blend of stops at some of ``count`` places in a row: protocol.md, section 7.9.

    Parameters
    ----------
    stops : (k, c) uint8 array
        What the first place, the last, and places at even distances between them have.
    count : int
    places : (n,) integer array
        Each 0 to ``count`` - 1.

    Returns
    -------
    (n, c) uint8 array

    """
    steps = max(count - 1, 1)
    stop, rest = np.divmod(places.astype(np.int64) * (len(stops) - 1), steps)
    first = stops.astype(np.int64)[stop]
    change = stops.astype(np.int64)[np.minimum(stop + 1, len(stops) - 1)] - first
    blended: NDArray[np.uint8] = (
        first + (2 * rest[:, None] * change + steps) // (2 * steps)
    ).astype(np.uint8)
    return blended


def colors_at(colors: NDArray[np.uint8], index: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return the colours at fractional indices, (n,), of k colours, blending: (n, 3) uint8.

    Beyond the last colour, the first one follows.
    """
    stops = np.arange(len(colors) + 1)
    ring = np.concatenate((colors, colors[:1]))
    blended = [np.interp(index, stops, ring[:, channel]) for channel in range(3)]
    return np.floor(np.stack(blended, axis=1) + 0.5).astype(np.uint8)


# The named colours of CSS Color Module Level 4, section 6.1.
NAMED = dict(
    re.findall(
        r"(\w+):(\w+)",
        """
    aliceblue:f0f8ff antiquewhite:faebd7 aqua:00ffff aquamarine:7fffd4 azure:f0ffff
    beige:f5f5dc bisque:ffe4c4 black:000000 blanchedalmond:ffebcd blue:0000ff
    blueviolet:8a2be2 brown:a52a2a burlywood:deb887 cadetblue:5f9ea0 chartreuse:7fff00
    chocolate:d2691e coral:ff7f50 cornflowerblue:6495ed cornsilk:fff8dc crimson:dc143c
    cyan:00ffff darkblue:00008b darkcyan:008b8b darkgoldenrod:b8860b darkgray:a9a9a9
    darkgreen:006400 darkgrey:a9a9a9 darkkhaki:bdb76b darkmagenta:8b008b
    darkolivegreen:556b2f darkorange:ff8c00 darkorchid:9932cc darkred:8b0000
    darksalmon:e9967a darkseagreen:8fbc8f darkslateblue:483d8b darkslategray:2f4f4f
    darkslategrey:2f4f4f darkturquoise:00ced1 darkviolet:9400d3 deeppink:ff1493
    deepskyblue:00bfff dimgray:696969 dimgrey:696969 dodgerblue:1e90ff firebrick:b22222
    floralwhite:fffaf0 forestgreen:228b22 fuchsia:ff00ff gainsboro:dcdcdc
    ghostwhite:f8f8ff gold:ffd700 goldenrod:daa520 gray:808080 green:008000
    greenyellow:adff2f grey:808080 honeydew:f0fff0 hotpink:ff69b4 indianred:cd5c5c
    indigo:4b0082 ivory:fffff0 khaki:f0e68c lavender:e6e6fa lavenderblush:fff0f5
    lawngreen:7cfc00 lemonchiffon:fffacd lightblue:add8e6 lightcoral:f08080
    lightcyan:e0ffff lightgoldenrodyellow:fafad2 lightgray:d3d3d3 lightgreen:90ee90
    lightgrey:d3d3d3 lightpink:ffb6c1 lightsalmon:ffa07a lightseagreen:20b2aa
    lightskyblue:87cefa lightslategray:778899 lightslategrey:778899 lightsteelblue:b0c4de
    lightyellow:ffffe0 lime:00ff00 limegreen:32cd32 linen:faf0e6 magenta:ff00ff
    maroon:800000 mediumaquamarine:66cdaa mediumblue:0000cd mediumorchid:ba55d3
    mediumpurple:9370db mediumseagreen:3cb371 mediumslateblue:7b68ee
    mediumspringgreen:00fa9a mediumturquoise:48d1cc mediumvioletred:c71585
    midnightblue:191970 mintcream:f5fffa mistyrose:ffe4e1 moccasin:ffe4b5
    navajowhite:ffdead navy:000080 oldlace:fdf5e6 olive:808000 olivedrab:6b8e23
    orange:ffa500 orangered:ff4500 orchid:da70d6 palegoldenrod:eee8aa palegreen:98fb98
    paleturquoise:afeeee palevioletred:db7093 papayawhip:ffefd5 peachpuff:ffdab9
    peru:cd853f pink:ffc0cb plum:dda0dd powderblue:b0e0e6 purple:800080
    rebeccapurple:663399 red:ff0000 rosybrown:bc8f8f royalblue:4169e1 saddlebrown:8b4513
    salmon:fa8072 sandybrown:f4a460 seagreen:2e8b57 seashell:fff5ee sienna:a0522d
    silver:c0c0c0 skyblue:87ceeb slateblue:6a5acd slategray:708090 slategrey:708090
    snow:fffafa springgreen:00ff7f steelblue:4682b4 tan:d2b48c teal:008080
    thistle:d8bfd8 tomato:ff6347 turquoise:40e0d0 violet:ee82ee wheat:f5deb3
    white:ffffff whitesmoke:f5f5f5 yellow:ffff00 yellowgreen:9acd32
        """,
    )
)

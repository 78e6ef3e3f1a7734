"""Column names of point tables: which of them are x, y and z.

Knows how other programs name coordinates; it must not know rows or separators.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

AXES = "xyz"

_LONGEST = 64  # as much of a name is looked at

_UNIT = re.compile(r"\s*(?:[\[(].*|/.*|\bin\b.*)")
_NO_NAME = re.compile(r"[^A-Za-z0-9_]+")
_WORDS = re.compile(r"[a-z]+|\d+")
_AFFIXES = re.compile(r"(?:pos|coord|point|p|t)?([xyz])(?:pos|coord)?")
# Words that only say that a column is a coordinate.
_FILLERS = frozenset(
    ["pos", "position", "coord", "coordinate", "coords", "coordinates", "point", "points",
     "pose", "field", "translation", "location"]
)  # fmt: skip
_UNITS = frozenset(["m", "cm", "mm", "um", "px", "axis"])
_ARRAYS = frozenset(["points", "point", "position", "coordinates", "coords"])


def axis_columns(names: list[str]) -> list[list[int]]:
    """Return the columns that may be x, those that may be y, and those that may be z.

    Parameters
    ----------
    names : list of str
        As in the file: perhaps with units (``x [mm]``), with words (``pos_x``), or as components
        of an array (``Points:0``).

    """
    found: list[list[int]] = [[], [], []]
    for axis_of in (_exact_axis, _axis_with_unit, _axis_with_words):
        axes = [axis_of(name[:_LONGEST].strip().lower()) for name in names]
        for i, axis in enumerate(AXES):
            found[i] = found[i] or [k for k, each in enumerate(axes) if each == axis]
    return found


def _exact_axis(name: str) -> str | None:
    return name if len(name) == 1 and name in AXES else None


def _axis_with_unit(name: str) -> str | None:
    return _exact_axis(_UNIT.sub("", name))


def _axis_with_words(name: str) -> str | None:
    words = _WORDS.findall(name)
    if len(words) == 2 and words[0] in _ARRAYS and words[1] in {"0", "1", "2"}:  # as of ParaView
        return AXES[int(words[1])]
    axes = [match[1] for word in words if (match := _AFFIXES.fullmatch(word))]
    others = [word for word in words if not _AFFIXES.fullmatch(word)]
    return axes[0] if len(axes) == 1 and (_FILLERS | _UNITS).issuperset(others) else None


def value_columns(names: list[str], wanted: Sequence[str]) -> dict[str, int]:
    """Return the columns of some names, as far as there are such columns.

    Parameters
    ----------
    names : list of str
        As in the file: perhaps with units, or with characters that no name in expressions has.
    wanted : sequence of str
        Names in expressions.

    """
    found: dict[str, int] = {}
    for spelling in (str.strip, lambda name: _NO_NAME.sub("_", _UNIT.sub("", name.strip()))):
        spelt = [spelling(name) for name in names]
        for name in wanted:
            if name not in found and name in spelt:
                found[name] = spelt.index(name)
    return found

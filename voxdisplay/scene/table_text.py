"""Text of a table: decoded lines, their fields, and the numbers in them.

Knows quotes, comments, decimal commas and the words for missing numbers; it must not know what
the columns are for.
"""

from __future__ import annotations

import csv
import math
import re

from voxdisplay.errors import CurveError
from voxdisplay.expressions.parse import excerpt
from voxdisplay.scene.foreign_files import recognise, unicode_encoding

MAX_LINE = 1 << 16
"""Longest line, in characters; bounds the number of columns."""

COMMENTS = ("#", "%", "//", "!")
"""Beginnings of lines of words that are no rows; names of columns may stand behind them."""
SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", None: "blanks"}
ROWS_HINT = (
    "each line holds x, y and z, separated by commas, semicolons, tabs or blanks; "
    "a first line may name the columns"
)

_MISSING_WORDS = "nan +nan -nan na n/a #n/a <na> null none nil -"
_MISSING_OF_MICROSOFT = "nan(ind) -nan(ind) 1.#ind -1.#ind 1.#qnan -1.#qnan"
_MISSING = frozenset(["", *_MISSING_WORDS.split(), *_MISSING_OF_MICROSOFT.split()])
_INFINITE = frozenset(
    ["inf", "+inf", "-inf", "infinity", "+infinity", "-infinity", "1.#inf", "-1.#inf"]
)
_COMMENT = re.compile(r"#(?!(?:IND|QNAN|INF)\b)", re.IGNORECASE)
_CONTROL = re.compile("[\\0-\\x08\\x0e-\\x1f]")
"""Characters that no text of points has; the others separate words and lines."""
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[+-]?[0-9]+)?")
_DECIMAL_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+(?:e[+-]?[0-9]+)?")
_DIGITS = re.compile(r"[0-9.]+")
_QUOTED = re.compile(r'"([^"]*)"|(\S+)')


class TableText:
    """Lines of a text table.

    Parameters
    ----------
    name : str
        The file's name, for errors.
    data : bytes
        Text in UTF-8 or UTF-16; what is neither is replaced, as it may stand in names.

    Attributes
    ----------
    name : str
        The file's name, quoted.
    lines : list of str
    plain : bool
        Whether no line is too long, and none has a ``_``, which `float` takes inside numbers.

    Raises
    ------
    CurveError
        If it is no text.

    """

    def __init__(self, name: str, data: bytes) -> None:
        self.name = excerpt(name)
        utf16 = unicode_encoding(data) == "UTF-16"
        text = _decoded(data) if utf16 else data.decode("utf-8-sig", "replace")
        text = text.removesuffix("\x1a")  # the end of a file, as of DOS
        if _CONTROL.search(text) or data.startswith(b"PK\x03\x04"):
            found = recognise(data)
            kind = found.kind if found else "a binary file"
            problem = f"{self.name} is {kind}, not a text of points"
            raise CurveError(problem, hint="export the points as CSV text")
        if "\r" in text:
            text = text.replace("\r\n", "\n").replace("\r", "\n")
        lines = text.split("\n")
        self.lines = [_without_comment(line) for line in lines] if "#" in text else lines
        self.plain = "_" not in text and max(map(len, lines)) <= MAX_LINE

    def error(self, line: int, problem: str, hint: str | None = None) -> CurveError:
        """Return an error of a line, counted from 0."""
        return CurveError(f"{self.name}, line {line + 1}: {problem}", hint=hint)

    def is_comment(self, line: int) -> bool:
        """Return whether a line begins with # or, as in other languages, with %, // or !."""
        return self.lines[line].lstrip().startswith(COMMENTS)

    def fields(self, line: int, separator: str | None, text: str | None = None) -> list[str]:
        """Return the fields of a line, or of another text in its place, without their quotes.

        Parameters
        ----------
        line : int
        separator : str or None
            None: blanks, any number of them.
        text : str, optional

        """
        text = self.lines[line] if text is None else text
        if len(text) > MAX_LINE:
            raise self.error(line, f"{len(text)} characters are more than {MAX_LINE}", ROWS_HINT)
        if '"' not in text:
            return [field.strip().strip("'") for field in text.split(separator)]
        if separator is None:
            return [quoted or plain for quoted, plain in _QUOTED.findall(text)]
        try:
            (found,) = csv.reader([text], delimiter=separator, skipinitialspace=True)
        except (csv.Error, ValueError):
            problem = f"{excerpt(text)} is not a row of a table"
            raise self.error(line, problem, ROWS_HINT) from None
        return [field.strip() for field in found]

    def numeric_columns(self, line: int, separator: str | None) -> list[int]:
        """Return the columns of a line that hold numbers; a missing one is none."""
        fields = self.fields(line, separator)
        return [k for k, field in enumerate(fields) if field and number(field) is not None]


def without_last_empty(fields: list[str]) -> list[str]:
    """Return fields without empty ones at their end, as commas at the ends of lines make."""
    count = len(fields)
    while count and not fields[count - 1]:
        count -= 1
    return fields[:count]


def has_decimal_comma(field: str) -> bool:
    """Return whether a field is a number with a decimal comma."""
    return "," in field and _DECIMAL_COMMA.fullmatch(_plain(field)) is not None


def number(field: str) -> float | None:
    """Return the number in a field, nan if it is missing, or None if there is something else.

    A comma in a field marks decimals: it is not what separates the fields, or it stands in quotes.
    """
    text = _plain(field)
    if _NUMBER.fullmatch(text):
        return float(text)
    if text in _MISSING:
        return math.nan
    if text in _INFINITE:
        return math.inf
    return float(text.replace(",", ".")) if _DECIMAL_COMMA.fullmatch(text) else None


def _plain(field: str) -> str:
    """Return a field as numbers are written here; Fortran has exponents with a d."""
    text = field.strip("\"' \t").lower().replace("\N{MINUS SIGN}", "-")
    return text.replace("d", "e") if text[:1] in "+-.0123456789" and "n" not in text else text


def _without_comment(line: str) -> str:
    """Return a line without a comment behind its numbers; a name may have a # in it."""
    before = _COMMENT.split(line, maxsplit=1)[0]
    return before if len(_DIGITS.findall(before)) >= 3 else line


def _decoded(data: bytes) -> str:
    marked = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    little = data[1:64:2].count(0) >= data[0:64:2].count(0)
    return data.decode("utf-16" if marked else "utf-16-le" if little else "utf-16-be", "replace")

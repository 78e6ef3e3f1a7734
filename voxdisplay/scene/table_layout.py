"""Layout of a table of points: separator, header, and the columns that are x, y and z.

Found from the first lines. What is ambiguous is an error that names the ways out.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from voxdisplay.expressions.parse import excerpt
from voxdisplay.scene.column_names import AXES, axis_columns
from voxdisplay.scene.table_text import (
    ROWS_HINT,
    SEPARATORS,
    TableText,
    without_last_empty,
)

NAMES_HINT = "name the columns that are x, y and z in a first line"

_MAX_HEADER = 2  # names and units
# Either two numbers with a point each, or one with a comma: 1,5, 2,5, 3,5
_COMMA_PAIRS = re.compile(r"\s*[+-]?[0-9]+,[0-9]+(?:,\s+[+-]?[0-9]+,[0-9]+)+,?\s*")
_SEPARATOR_LINE = re.compile(r'"?sep=.?"?', re.IGNORECASE)
_IN_BRACKETS = re.compile(r"\[[^\[\]]{0,40}\]|\([^()]{0,40}\)")


class Layout(NamedTuple):
    """Notation of a table: separator, header and columns.

    Attributes
    ----------
    first : int
        Index of the first row's line.
    separator : str or None
        Text between fields; None: blanks.
    columns : int
        Number of columns that have a name or a value.
    axes : list of int
        The columns that are x, y and z.
    names : list of str
        Names of all columns; empty if the table has none.
    numeric : int
        Number of columns that hold numbers.

    """

    first: int
    separator: str | None
    columns: int
    axes: list[int]
    names: list[str]
    numeric: int


def find_layout(table: TableText) -> Layout | None:
    """Return the layout of a table; None if it has no rows.

    Raises
    ------
    CurveError
        If the first lines are not those of a table of points, or one that can be read in several
        ways.

    """
    texts = (i for i, line in enumerate(table.lines) if line.strip() and not table.is_comment(i))
    head = [i for i, _ in zip(texts, range(_MAX_HEADER + 3), strict=False)]
    head = head[_counting_lines(table, head) :]
    for position, line in enumerate(head[: _MAX_HEADER + 1]):
        found, separator = _find_separator(table, line)
        if found:
            return _layout_from(table, line, separator, head[:position])
    if not head:
        return None
    # Behind a line of names, the next one is to blame.
    named = len(head) > 1 and not any(table.numeric_columns(head[0], each) for each in SEPARATORS)
    if len(head) == 1 and any(axis_columns(table.fields(head[0], ","))):
        return None
    wrong = head[1] if named else head[0]
    raise table.error(wrong, f"{excerpt(table.lines[wrong])} is not three numbers", ROWS_HINT)


def listed(names: list[str]) -> str:
    """Return names as errors and notes show them."""
    shown = ", ".join(excerpt(name) for name in names[:8])
    return f"{shown}, ..." if len(names) > 8 else shown


def _counting_lines(table: TableText, head: list[int]) -> int:
    """Return how many lines are a count of rows and its title, or name the separator.

    So begin the .xyz files of chemistry and .pts files, and files for spreadsheets (``sep=;``).
    """
    if head and _SEPARATOR_LINE.fullmatch(table.lines[head[0]].strip()):
        return 1
    count = table.lines[head[0]].strip() if head else ""
    if not (count.isascii() and count.isdigit()) or len(count) > 9:
        return 0
    rows = sum(1 for line in table.lines[head[0] + 1 :] if line.strip())
    return {int(count): 1, int(count) + 1: 2}.get(rows, 0)


def _find_separator(table: TableText, line: int) -> tuple[bool, str | None]:
    """Return whether anything separates a line into three numbers or more, and what."""
    text = table.lines[line]
    for separator in SEPARATORS:
        if separator is not None and separator not in text:
            continue
        if len(table.numeric_columns(line, separator)) >= 3:
            if separator == "," and _COMMA_PAIRS.fullmatch(text):
                problem = (
                    f"the commas of {excerpt(text.strip())} separate columns, or mark decimals"
                )
                hint = "write decimal points, or semicolons between the columns"
                raise table.error(line, problem, hint)
            return True, separator
    return False, None


def _layout_from(table: TableText, first: int, separator: str | None, header: list[int]) -> Layout:
    """Return the layout of a table whose first row is known, and the lines before it."""
    for line in header:
        if table.numeric_columns(line, separator):
            problem = f"{excerpt(table.lines[line])} is not three numbers"
            raise table.error(line, problem, ROWS_HINT)
    row = table.fields(first, separator)
    numeric = table.numeric_columns(first, separator)
    names = _column_names(table, first, separator, header)
    axes = _named_axes(table, header[0] if header else first - 1, names) if names else None
    if axes is None:
        if names and len(numeric) > 3:
            problem = f"which of the columns {listed(names)} are x, y and z?"
            raise table.error(header[0], problem, NAMES_HINT)
        axes = numeric[:3]
    columns = max(len(without_last_empty(row)), len(without_last_empty(names)))
    return Layout(first, separator, columns, axes, names, len(numeric))


def _column_names(
    table: TableText, first: int, separator: str | None, header: list[int]
) -> list[str]:
    """Return the names of the columns; none if the table does not name them."""
    line = header[0] if header else first - 1
    if line < 0 or not (header or table.is_comment(line)):
        return []
    text = table.lines[line].strip().lstrip("#%").strip() if not header else table.lines[line]
    row = table.fields(first, separator)
    width = len(without_last_empty(row))
    for plain in (text, _IN_BRACKETS.sub("", text)):  # units may have blanks before them
        for each in (separator, *SEPARATORS):
            names = [name.rstrip(",;") for name in table.fields(line, each, plain)]
            if len(names) == len(row) or len(without_last_empty(names)) == width:
                return names if header or all(axis_columns(names)) else []
            # R leaves out the name of the column that has the names of the rows.
            if header and separator in {None, "\t"} and len(names) == width - 1 >= 3:
                return ["", *names]
    if not header:
        return []
    problem = f"{len(table.fields(line, separator))} columns have names"
    raise table.error(line, f"{problem}, but line {first + 1} has {width}", NAMES_HINT)


def _named_axes(table: TableText, line: int, names: list[str]) -> list[int] | None:
    """Return the columns that are named x, y and z; None if none of them is."""
    found = axis_columns(names)
    if not any(found):
        return None
    for axis, columns in zip(AXES, found, strict=True):
        if not columns:
            raise table.error(line, f"none of the columns {listed(names)} is {axis}", NAMES_HINT)
        if len(columns) > 1:
            several = listed([names[k] for k in columns])
            raise table.error(line, f"which of the columns {several} is {axis}?", NAMES_HINT)
    return [columns[0] for columns in found]

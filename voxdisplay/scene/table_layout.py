"""Layout of a table of points: separator, header, and the columns that are x, y and z.

Found from the first lines. What is ambiguous is an error that names the ways out.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from voxdisplay.expressions.parse import excerpt
from voxdisplay.scene.column_names import AXES, axis_columns
from voxdisplay.scene.table_text import (
    COMMENTS,
    MAX_LINE,
    ROWS_HINT,
    SEPARATORS,
    TableText,
    number,
    without_last_empty,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

NAMES_HINT = "name the columns that are x, y and z in a first line"

_MAX_HEADER = 2  # names and units
_MAX_COMMENTS = 20  # so many above the first row may name the columns
_MAX_INCOMPLETE = 1 << 12  # so many rows at the beginning may lack numbers
# Either two numbers with a point each, or one with a comma: 1,5, 2,5, 3,5
_COMMA_PAIRS = re.compile(r"\s*[+-]?[0-9]+,[0-9]+(?:,\s+[+-]?[0-9]+,[0-9]+)+,?\s*")
_LABEL = re.compile(r"[A-Za-z ]{1,40}:\s+")  # columns: t x y z
_NUMBERED = re.compile(r"(?:^|(?<=[\s,;]))[0-9]{1,3}[:.)]\s*")  # 1:t 2:x
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
    incomplete: list[int] = []
    texts = (i for i in _texts(table) if not _is_incomplete(table, i, incomplete))
    head = [i for i, _ in zip(texts, range(_MAX_HEADER + 3), strict=False)]
    head = head[_counting_lines(table, head) :]
    for position, line in enumerate(head[: _MAX_HEADER + 1]):
        found, separator = _find_separator(table, line)
        if found:
            header = head[:position]
            layout = _layout_from(table, line, separator, header)
            begin = header[-1] if header else -1
            return layout._replace(first=min([i for i in incomplete if begin < i < line] or [line]))
    if not head:
        return None
    # Behind a line of names, the next one is to blame.
    named = len(head) > 1 and not any(table.numeric_columns(head[0], each) for each in SEPARATORS)
    if len(head) == 1 and any(axis_columns(table.fields(head[0], ","))):
        return None
    wrong = head[1] if named else head[0]
    raise table.error(wrong, f"{excerpt(table.lines[wrong])} is not three numbers", ROWS_HINT)


def _texts(table: TableText) -> Iterator[int]:
    return (i for i, line in enumerate(table.lines) if line.strip() and not table.is_comment(i))


def _is_incomplete(table: TableText, line: int, found: list[int]) -> bool:
    """Return whether a line is a row without some of its numbers, and add it to those found.

    A marker that is not seen yet makes such rows at the beginning.
    """
    if len(found) == _MAX_INCOMPLETE:
        return False
    for separator in SEPARATORS:
        if separator and separator in table.lines[line]:
            numbers = [number(field) for field in table.fields(line, separator)]
            if (
                None in numbers
                or len(numbers) < 3
                or len(table.numeric_columns(line, separator)) > 2
            ):
                continue
            if table.numeric_columns(line, separator):
                found.append(line)
                return True
    return False


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
    line, names = _column_names(table, first, separator, header)
    axes = _named_axes(table, line, names) if names else None
    if axes is None:
        if names and len(numeric) > 3:
            problem = f"which of the columns {listed(names)} are x, y and z?"
            raise table.error(line, problem, NAMES_HINT)
        axes = numeric[:3]
    columns = max(len(without_last_empty(row)), len(without_last_empty(names)))
    return Layout(first, separator, columns, axes, names, len(numeric))


def _column_names(
    table: TableText, first: int, separator: str | None, header: list[int]
) -> tuple[int, list[str]]:
    """Return the line that names the columns, and the names; none if the table does not."""
    if header:
        return header[0], _header_names(table, first, separator, header[0])
    above = range(first - 1, max(0, first - _MAX_COMMENTS) - 1, -1)
    comments = [
        line for line in above if table.is_comment(line) and len(table.lines[line]) <= MAX_LINE
    ]
    for line in comments:
        text = table.lines[line].strip().lstrip("".join(COMMENTS)).strip()
        for names in _possible_names(table, first, separator, line, text):
            if all(axis_columns(names)):
                return line, names
    # Without blanks between them, as many words as columns are names, whatever they mean.
    for line in comments if separator else ():
        names = table.fields(line, separator, table.lines[line].strip().lstrip("".join(COMMENTS)))
        if len(names) == len(table.fields(first, separator)) and not any(map(number, names)):
            return line, names
    return -1, []


def _header_names(table: TableText, first: int, separator: str | None, line: int) -> list[str]:
    """Return the names in a line that is no comment."""
    text = table.lines[line]
    for names in _possible_names(table, first, separator, line, text):
        return names
    width = len(without_last_empty(table.fields(first, separator)))
    # R leaves out the name of the column that has the names of the rows.
    if separator in {None, "\t"}:
        for plain in _without_units(text):
            for each in (separator, *SEPARATORS):
                names = _names_of(table, line, each, plain)
                if len(names) == width - 1 >= 3:
                    return ["", *names]
    problem = f"{len(table.fields(line, separator))} columns have names"
    raise table.error(line, f"{problem}, but line {first + 1} has {width}", NAMES_HINT)


def _possible_names(
    table: TableText, first: int, separator: str | None, line: int, text: str
) -> Iterator[list[str]]:
    """Yield the readings of a line that have as many names as a row has columns."""
    row = table.fields(first, separator)
    width = len(without_last_empty(row))
    for plain in _without_units(text):
        for each in (separator, *SEPARATORS):
            names = _names_of(table, line, each, plain)
            if len(names) == len(row) or len(without_last_empty(names)) == width:
                yield names


def _without_units(text: str) -> tuple[str, ...]:
    """Return a text, and it without units, which may have blanks before them, and labels."""
    plain = _IN_BRACKETS.sub("", text)
    return text, plain, _LABEL.sub("", plain), _NUMBERED.sub(" ", plain).strip()


def _names_of(table: TableText, line: int, separator: str | None, text: str) -> list[str]:
    return [name.rstrip(",;") for name in table.fields(line, separator, text)]


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

"""Points of a text table: rows read as its layout says, split into strands on request.

It must not open files, nor know what the points are for.
"""

from __future__ import annotations

import math
import re
from array import array
from bisect import bisect_right
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.expressions.parse import excerpt
from voxdisplay.scene.column_names import value_columns
from voxdisplay.scene.strands import Strands, split_strands
from voxdisplay.scene.table_layout import NAMES_HINT, Layout, find_layout, listed
from voxdisplay.scene.table_text import (
    ROWS_HINT,
    SEPARATORS,
    TableText,
    has_decimal_comma,
    number,
    without_last_empty,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from voxdisplay.compute.array_types import Floats

GAPS_HINT = 'to split the points into strands there, write "gaps": "split" beside "file"'

_MOST_UNNAMED = 7  # so many columns may have other values of a point
_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}(?:,[0-9]{3})+")


def read_table(name: str, data: bytes, *, split: bool, wanted: Sequence[str] = ()) -> Strands:
    """Read a text table of points.

    Parameters
    ----------
    name : str
        The file's name, for errors.
    data : bytes
        Text in UTF-8 or UTF-16.
    split : bool
        Whether rows that are empty or not finite separate strands; else they are errors.
    wanted : sequence of str
        Names of further columns that are read if the table has them.

    Raises
    ------
    CurveError
        If it is not a table of points, or one that can be read in several ways. The message names
        the file and the line.

    """
    table = TableText(name, data)
    layout = find_layout(table)
    if layout is None:
        return Strands(np.empty((0, 3)), np.empty(0, dtype=np.int64))
    more = value_columns(layout.names, wanted)
    rows = _Rows(table, layout, list(more.values()))
    points = np.array(rows.numbers, dtype=np.float64).reshape(-1, 3)
    gaps = sorted(set(rows.empty) - {0, len(points)})
    if not split:
        if len(gaps) == len(points) - 1:  # of a program that ends its lines twice
            gaps = []
        rows.refuse_gaps(points, gaps)
    rows.refuse_ambiguity(points)
    values = np.array(rows.values, dtype=np.float64).reshape(len(points), -1)
    values = values[np.isfinite(points).all(axis=1)]
    columns = {each: values[:, i] for i, each in enumerate(more)}
    return Strands(*split_strands(points, gaps), rows.note(), columns)


class _Rows:
    """Numbers of all rows, and the lines that are no rows."""

    def __init__(self, table: TableText, layout: Layout, more: list[int]) -> None:
        self.table = table
        self.layout = layout
        self.numbers = array("d")
        self.values = array("d")  # of the further columns
        self._more = more
        self.empty: dict[int, int] = {}  # row -> an empty line before it
        self.skipped: list[int] = []  # rows before which there is a line that is no row
        self.decimal_comma: int | None = None  # line of the first one
        first = table.fields(layout.first, layout.separator)
        # The first row may be without some of its fields, which is refused when it is read.
        if any(has_decimal_comma(first[k]) for k in layout.axes if k < len(first)):
            self.decimal_comma = layout.first
        self._read()

    def _read(self) -> None:
        a, b, c = self.layout.axes
        columns = self.layout.columns
        lines, separator = self.table.lines, self.layout.separator
        extend = self.numbers.extend
        plain = self.table.plain and self.decimal_comma is None
        plain = plain and '"' not in lines[self.layout.first]
        for line, text in enumerate(lines[self.layout.first :], self.layout.first):
            fields = text.split(separator) if plain else self._quick_fields(text)
            if len(fields) == columns:
                try:
                    extend((float(fields[a]), float(fields[b]), float(fields[c])))
                except ValueError:  # raised before the first is added
                    pass
                else:
                    if self._more:
                        self._read_values(fields)
                    continue
            if text:
                self._read_line(line)
            else:
                self.empty[len(self.numbers) // 3] = line
                self.skipped.append(len(self.numbers) // 3)

    def _quick_fields(self, text: str) -> list[str]:
        """Return the fields of a simple row as `float` takes them, or nothing."""
        separator = self.layout.separator
        if not self.table.plain:
            return []
        if '"' in text:
            if any(field.count('"') == 1 for field in text.split(separator)):
                return []  # a separator inside quotes
            text = text.replace('"', "")
        if "," in text and separator != ",":
            if "." in text:
                return []
            text = text.replace(",", ".")
        return text.split(separator)

    def _read_line(self, line: int) -> None:
        """Read a line that is not a plain row of numbers."""
        text = self.table.lines[line]
        count = len(self.numbers) // 3
        if not text.strip():
            self.empty[count] = line
        if not text.strip() or self.table.is_comment(line):
            self.skipped.append(count)
            return
        layout = self.layout
        fields = self.table.fields(line, layout.separator)
        if len(fields) <= max(layout.axes) or len(without_last_empty(fields)) > layout.columns:
            problem = f"{excerpt(text)} has {len(fields)} columns, not {layout.columns}"
            raise self.table.error(line, problem, ROWS_HINT)
        for k in layout.axes:
            value = number(fields[k])
            if value is None:
                raise self.table.error(line, f"{excerpt(fields[k])} is not a number", ROWS_HINT)
            if self.decimal_comma is None and has_decimal_comma(fields[k]):
                self.decimal_comma = line
            self.numbers.append(value)
        self._read_values(fields)

    def _read_values(self, fields: list[str]) -> None:
        """Read the further columns of a row; what is no number is nan."""
        for k in self._more:
            value = number(fields[k]) if k < len(fields) else None
            self.values.append(math.nan if value is None else value)

    def _line_of(self, row: int) -> int:
        return self.layout.first + row + bisect_right(self.skipped, row)

    def refuse_gaps(self, points: Floats, gaps: list[int]) -> None:
        """Raise CurveError if a row is empty or not finite."""
        if not np.isfinite(points).all():
            row = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
            x, y, z = points[row]
            problem = f"the point {x:g}, {y:g}, {z:g} is not finite"
            raise self.table.error(self._line_of(row), problem, GAPS_HINT)
        if gaps:
            problem = "an empty line between points"
            raise self.table.error(self.empty[gaps[0]], problem, f"remove it; {GAPS_HINT}")

    def refuse_ambiguity(self, points: Floats) -> None:
        """Raise CurveError if another reading of the rows is as likely."""
        layout = self.layout
        unnamed = not layout.names
        if layout.numeric > _MOST_UNNAMED and unnamed and len(points) in {1, 3}:
            problem = f"{layout.numeric} columns: is each row a point, or each column?"
            hint = f"write one point in each row, or {NAMES_HINT}"
            raise self.table.error(layout.first, problem, hint)
        if layout.numeric > 3 and unnamed and len(points) >= 3:
            counted = points[:, 0] - np.arange(len(points))
            if counted[0] in (0, 1) and (counted == counted[0]).all():
                problem = f"column {layout.axes[0] + 1} counts rows, or is x"
                raise self.table.error(layout.first, problem, NAMES_HINT)
        if self.decimal_comma is not None:
            self._refuse_mixed_decimals(self.decimal_comma)

    def _refuse_mixed_decimals(self, comma: int) -> None:
        grouped = self.layout.separator != ";"
        for line in range(self.layout.first, len(self.table.lines)):
            text = self.table.lines[line]
            if not ("." in text or grouped) or not text.strip() or self.table.is_comment(line):
                continue
            fields = self.table.fields(line, self.layout.separator)
            used = [fields[k] for k in self.layout.axes]
            if any("." in field for field in used):
                problem = f"a decimal point, after a decimal comma in line {comma + 1}"
                raise self.table.error(line, problem, "write all numbers with decimal points")
            grouped &= all(_THOUSANDS.fullmatch(field) for field in used if "," in field)
        if grouped:
            text = excerpt(self.table.lines[comma].strip())
            problem = f"the commas of {text} mark decimals, or thousands"
            raise self.table.error(
                comma, problem, "write decimal points, and nothing between thousands"
            )

    def note(self) -> str | None:
        """Return what was taken for x, y and z, unless the table is x,y,z and nothing else."""
        layout = self.layout
        names = [layout.names[k] for k in layout.axes] if layout.names else []
        plain = [name.strip().lower() for name in names] in ([], ["x", "y", "z"])
        usual = layout.axes == [0, 1, 2] and layout.columns == 3 and layout.separator == ","
        if plain and usual and self.decimal_comma is None:
            return None
        shown = ", ".join(str(k + 1) for k in layout.axes)
        called = f" ({listed(names)})" if names else ""
        of = f" of {layout.columns}" if layout.columns > 3 else ""
        decimals = " with decimal commas" if self.decimal_comma is not None else ""
        parted = f"separated by {SEPARATORS[layout.separator]}{decimals}"
        return f"{self.table.name}: x, y, z are columns {shown}{called}{of}, {parted}"

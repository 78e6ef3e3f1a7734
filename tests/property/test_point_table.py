"""Tables of points in arbitrary notations: read as written, or refused by a CurveError."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from voxdisplay.errors import CurveError
from voxdisplay.scene.point_table import read_table

AXIS_NAMES = ["{}", "{} [mm]", "{}/mm", "pos_{}", "{} Position (mm)", '"{}"']
numbers = st.integers(-9999, 9999).map(lambda n: n / 8)  # exact in eight digits


@st.composite
def tables(draw: st.DrawFn) -> tuple[bytes, list[list[float]]]:
    """Draw a table, with names over its columns in any order, and its points."""
    rows = draw(st.lists(st.lists(numbers, min_size=3, max_size=3), min_size=2, max_size=6))
    separator = draw(st.sampled_from([",", ";", "\t", " , ", "; "]))
    comma = separator.strip(" ") != "," and draw(st.booleans())
    # Between tabs, 1,125 might be a number of thousands.
    short = ["{:.7g}"] if not comma or separator.strip(" ") == ";" else []
    style = draw(st.sampled_from(["{:.18e}", "{:+.4f}", *short]))
    quote = draw(st.sampled_from(["", '"']))
    others = draw(st.lists(st.sampled_from(["name", "t", "value"]), max_size=3, unique=True))
    columns = draw(st.permutations(["x", "y", "z", *others]))
    name = draw(st.sampled_from(AXIS_NAMES))

    def field(value: float) -> str:
        text = style.format(value)
        return f"{quote}{text.replace('.', ',') if comma else text}{quote}"

    def other(column: str, row: int) -> str:
        return f"p{row}" if column == "name" else field(row)

    header = [name.format(c) if c in "xyz" else c for c in columns]
    lines = [separator.join(header)]
    for i, row in enumerate(rows):
        values = dict(zip("xyz", row, strict=True))
        cells = [field(values[c]) if c in values else other(c, i) for c in columns]
        lines.append(separator.join(cells))
    end = draw(st.sampled_from(["\n", "\r\n", "\r"]))
    comment = draw(st.sampled_from(["", "# by hand" + end, end]))
    encoding = draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16"]))
    return (comment + end.join(lines) + end).encode(encoding), rows


@settings(deadline=None)
@given(tables())
def test_named_columns_are_found_in_any_notation(table: tuple[bytes, list[list[float]]]) -> None:
    data, points = table
    found = read_table("a.csv", data, split=False)
    assert found.points.tolist() == points
    assert found.starts.tolist() == [0]


@settings(deadline=None)
@given(
    st.lists(st.lists(numbers, min_size=3, max_size=3), min_size=1, max_size=6),
    st.sampled_from([" ", "  ", "\t", ",", ", ", ";"]),
    st.lists(st.booleans(), min_size=6, max_size=6),
    st.sampled_from(["", "nan nan nan", "NA NA NA"]),
)
def test_strands(rows: list[list[float]], separator: str, cuts: list[bool], gap: str) -> None:
    lines: list[str] = []
    starts: list[int] = []
    for i, row in enumerate(rows):
        if i == 0 or cuts[i]:
            starts.append(i)
            lines += [gap.replace(" ", separator)] if i else []
        lines.append(separator.join(map(repr, row)))
    found = read_table("a.txt", "\n".join(lines).encode(), split=True)
    assert found.points.tolist() == rows
    assert found.starts.tolist() == starts


cells = st.sampled_from(
    [
        "1",
        "2.5",
        "-3",
        "1,5",
        "nan",
        "",
        "x",
        "z [mm]",
        '"',
        "'",
        "#",
        "1_0",
        "\0",
        "\u2212",
        "9" * 400,
    ]
)


@settings(deadline=None)
@example(
    [["1,5", '"'], ["1", "1", "", "1"]], ",", False, b""
)  # fields are missing in the first row
@given(
    st.lists(st.lists(cells, max_size=6), max_size=6),
    st.sampled_from([",", ";", "\t", " ", ", "]),
    st.booleans(),
    st.binary(max_size=4),
)
def test_anything_else_is_refused_or_finite(
    rows: list[list[str]], separator: str, split: Any, noise: bytes
) -> None:
    data = "\n".join(separator.join(row) for row in rows).encode() + noise
    try:
        found = read_table("a.csv", data, split=split)
    except CurveError as error:
        message = f"{error} {error.hint}"
        if not message.isprintable():
            raise AssertionError(message) from None
    else:
        assert np.isfinite(found.points).all()
        assert found.points.shape[1] == 3

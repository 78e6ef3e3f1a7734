"""recording.md as data: its tables and vectors. Shares no code with the package."""

from __future__ import annotations

import re
from pathlib import Path

TEXT = (Path(__file__).parents[1] / "recording.md").read_text(encoding="utf-8")


def _rows(kind: str, name: str) -> list[dict[str, str]]:
    found = re.search(rf"<!-- {kind}: {name} -->\n((?:\|.*\n)+)", TEXT)
    assert found, f"no table {kind}: {name}"
    head, _, *rows = (
        [cell.strip() for cell in line.strip("|").split("|")] for line in found[1].splitlines()
    )
    return [dict(zip(head, row, strict=True)) for row in rows]


def literals() -> dict[str, int]:
    """All literals: GROUP_NAME -> value."""
    groups = re.findall(r"<!-- literals: (\w+) -->", TEXT)
    return {
        f"{group}_{row['name']}": int(row["value"])
        for group in groups
        for row in _rows("literals", group)
    }


def layouts() -> dict[str, tuple[tuple[str, int, int], ...]]:
    """All layouts: NAME -> (field, offset, size) of the fields of a fixed size."""
    return {
        name: tuple(
            (row["field"], int(row["offset"]), int(row["size"]))
            for row in _rows("layout", name)
            if row["size"].isdigit()
        )
        for name in re.findall(r"<!-- layout: (\w+) -->", TEXT)
    }


def vectors() -> list[dict[str, str]]:
    """All fenced vectors, as the keys and values of their lines."""
    blocks = re.findall(r"```vector \w+\n(.*?)```", TEXT, re.DOTALL)
    return [dict(line.split(" ", 1) for line in block.splitlines()) for block in blocks]

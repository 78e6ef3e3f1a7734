"""Lists of the public names, in the sections of the package's docstring."""

from __future__ import annotations

import re

import voxdisplay as vd


def names_by_section() -> str:
    """Return a section for each part of the package's docstring, with a table of its names."""
    parts: list[tuple[str, list[str]]] = []
    listed = set()
    for line in (vd.__doc__ or "").splitlines():
        if entry := re.fullmatch(r"    (\w+) +\S.*", line):
            parts[-1][1].append(entry[1])
            listed.add(entry[1])
        elif line and not line.startswith((" ", ">>>", "...")):
            parts.append((line, []))
    if listed != set(vd.__all__):
        raise SystemExit(f"not in the docstring or not public: {listed ^ set(vd.__all__)}")
    return "\n\n".join(_section(title, names) for title, names in parts if names)


def _section(title: str, names: list[str]) -> str:
    heading, _, rest = title.rstrip(".").partition(": ")
    rows = "\n".join(f"   voxdisplay.{name}" for name in names)
    text = f"{rest[:1].upper()}{rest[1:]}.\n\n" if rest else ""
    return (
        f"## {heading}\n\n{text}```{{eval-rst}}\n.. autosummary::\n   :toctree: api\n   "
        f":nosignatures:\n\n{rows}\n```"
    )

"""Drawing of the rooms of the code, from the flowchart in docs/architecture.md.

Reads the few forms of Mermaid that stand there: ``name[name: text]`` and ``name -->|label| name``.
"""

from __future__ import annotations

import re
import textwrap
from html import escape
from pathlib import Path

_ROOM = re.compile(r"^\s*(\w+)\[(?:\w+: )?(.+)\]$", re.MULTILINE)
_ARROW = re.compile(r"^\s*(\w+) -->(?:\|(\w+)\|)? (\w+)$", re.MULTILINE)
_WIDTH, _BOX, _HEIGHT, _GAP = 960, 208, 74, 46
_STYLE = (
    "text{font:12px sans-serif;fill:#333}.n{font-weight:bold;font-size:14px;fill:#111}"
    "rect{fill:#f2f6ff;stroke:#456}path{fill:none;stroke:#89a;stroke-width:1.4}"
)


def draw_rooms(chart: str, target: Path) -> str:
    """Draw a flowchart as SVG; return a picture in Markdown, and a table of all arrows.

    The drawing leaves out arrows that a longer way makes plain, and those to one module of a room;
    the table has them all. A room without arrows is drawn alone.
    """
    rooms = dict(_ROOM.findall(chart))
    arrows: dict[str, dict[str, str]] = {name: {} for name in rooms}
    for start, label, end in _ARROW.findall(chart):
        arrows[start][end] = f"{end}.{label}" if label else end
    levels = _levels(arrows)
    target.write_text(_svg(rooms, arrows, levels), encoding="utf-8")
    joined = {name for start, ends in arrows.items() for name in (start, *ends) if ends}
    order = sorted(joined, key=lambda name: (levels[name], name))
    rows = [f"| {name} | {', '.join(sorted(arrows[name].values())) or '-'} |" for name in order]
    table = "\n".join(["| room | imports |", "| --- | --- |", *rows])
    return f"![Rooms of the code]({target.name})\n\n{table}"


def _levels(arrows: dict[str, dict[str, str]]) -> dict[str, int]:
    """Return for each room the length of the longest way to it, by arrows to whole rooms.

    Arrows to one module of a room may run both ways between two rooms.
    """
    levels = dict.fromkeys(arrows, 0)
    for _ in arrows:
        for start, ends in arrows.items():
            for end, what in ends.items():
                if what == end:
                    levels[end] = max(levels[end], levels[start] + 1)
    return levels


def _reached(arrows: dict[str, dict[str, str]], start: str) -> set[str]:
    """Return all rooms that a way of arrows to whole rooms leads to."""
    found: set[str] = set()
    waiting = [start]
    while waiting:
        onward = {end for end, what in arrows[waiting.pop()].items() if what == end} - found
        found |= onward
        waiting += onward
    return found


def _svg(rooms: dict[str, str], arrows: dict[str, dict[str, str]], levels: dict[str, int]) -> str:
    places = {}
    for level in range(max(levels.values()) + 1):
        row = [name for name in rooms if levels[name] == level]
        for number, name in enumerate(row):
            x = _WIDTH * (number + 0.5) / len(row)
            places[name] = (x, _GAP / 2 + level * (_HEIGHT + _GAP))
    bottom = max(y for _, y in places.values()) + _HEIGHT + _GAP / 2
    lines, boxes = [], []
    for start, ends in arrows.items():
        below = {end for end, what in ends.items() if what == end}
        further = set().union(*(_reached(arrows, end) for end in below))
        for end in sorted(below - further):
            (x, y), (to_x, to_y) = places[start], places[end]
            y += _HEIGHT
            bend = (to_y - y) / 2
            lines.append(
                f'<path marker-end="url(#a)" d="M{x:g} {y:g} C{x:g} {y + bend:g} {to_x:g} '
                f'{to_y - bend:g} {to_x:g} {to_y - 6:g}"/>'
            )
    for name, (x, y) in places.items():
        words = textwrap.wrap(rooms[name], 30)[:3]
        boxes.append(
            f'<rect x="{x - _BOX / 2:g}" y="{y:g}" width="{_BOX}" height="{_HEIGHT}" rx="6"/>'
            f'<text class="n" x="{x:g}" y="{y + 19:g}" text-anchor="middle">{escape(name)}</text>'
        )
        boxes += [
            f'<text x="{x:g}" y="{y + 37 + 15 * number:g}" text-anchor="middle">'
            f"{escape(line)}</text>"
            for number, line in enumerate(words)
        ]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {bottom:g}" '
        f'width="{_WIDTH}" height="{bottom:g}"><style>{_STYLE}</style><defs><marker id="a" '
        'viewBox="0 0 8 8" refX="4" refY="4" markerWidth="6" markerHeight="6" orient="auto">'
        '<polygon points="0,0 8,4 0,8" fill="#89a"/></marker></defs>'
        '<rect width="100%" height="100%" style="fill:#fff;stroke:none"/>'
        f"{''.join(lines)}{''.join(boxes)}</svg>\n"
    )

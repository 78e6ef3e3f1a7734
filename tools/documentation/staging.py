"""Sources of the documentation as Sphinx reads them: copies whose markers are replaced.

A marker is a comment on a line of its own, such as ``<!-- insert: scene examples/star.json -->``.
Knows where documents stand and how links run between them, not what is put in place of a marker.
"""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

from documentation.markers import Inserter
from documentation.rooms import draw_rooms

ROOT = Path(__file__).resolve().parents[2]
# Documents from elsewhere in the repository, and the names of their pages.
OUTSIDE = {
    "protocol.md": "protocol.md",
    "recording.md": "recording.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "firmware/README.md": "reference-device.md",
}
_LINK = re.compile(r"\[([^\]\n]+)\]\((?!https?:|#)([^)#\s]+)(#[^)\s]*)?\)")
_MARKER = re.compile(r"^<!-- insert: (.+?) -->$", re.MULTILINE)
# Fences whose words are no name of a highlighter: vectors and traces.
_FENCE = re.compile(r"^```(?:vector|trace)\b.*$", re.MULTILINE)
_CHART = re.compile(r"^```mermaid\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def stage(folder: Path, *, draft: bool = False) -> None:
    """Write all sources of the documentation into an empty folder; a draft has short films."""
    shutil.copytree(ROOT / "docs", folder, dirs_exist_ok=True)
    shutil.copytree(ROOT / "examples", folder / "examples")
    shutil.copy(ROOT / "examples" / "head.npz", folder / "objects")  # named by a scene there
    pages = {ROOT / "docs" / path.name: path.name for path in folder.glob("*.md")}
    pages |= {ROOT / source: name for source, name in OUTSIDE.items()}
    inserter = Inserter(folder, draft=draft)
    for source, name in pages.items():
        text = source.read_text(encoding="utf-8")
        text = _FENCE.sub("```", text)
        text = _LINK.sub(lambda link, source=source: _relinked(link, source, pages), text)
        text = _CHART.sub(lambda chart: draw_rooms(chart[1], folder / "rooms.svg"), text)
        inserter.save_files(text)
        text = _MARKER.sub(lambda marker: inserter.insert(marker[1]), text)
        (folder / name).write_text(text, encoding="utf-8")
    inserter.check_complete()


def _relinked(link: re.Match[str], source: Path, pages: dict[Path, str]) -> str:
    """Return a link to the page of its target; the path as code if the target is no page."""
    text, target, anchor = link[1], link[2], link[3] or ""
    path = Path(os.path.normpath(source.parent / target))
    if path in pages:
        return f"[{text}]({pages[path]}{anchor})"
    if link.string[link.start() - 1 : link.start()] == "!":
        return link[0]
    inside = path.relative_to(ROOT).as_posix()
    return f"`{inside}`" if text.strip("`") in {target, inside} else f"{text} (`{inside}`)"

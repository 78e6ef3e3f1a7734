"""What takes the place of a marker in a page: pictures, scenes beside them, keys, names.

Markers are ``picture FILE [OPTIONS]`` (drawn by ``voxdisplay preview``), ``scene FILE [OPTIONS]``
(its source beside its picture), ``types curve|body|group``, ``common keys``, ``names`` and ``paper
table|comparison``. A file is an example, or one that a page shows below ``<!-- file: NAME -->``.
"""

from __future__ import annotations

import re
import shlex
from pathlib import Path

from documentation.names import names_by_section
from documentation.object_keys import common_keys, own_keys, types_of
from documentation.paper import paper_comparison, paper_table
from documentation.pictures import draw

_FILE = re.compile(r"^<!-- file: ([\w.-]+) -->\n```json\n(.*?)^```$", re.MULTILINE | re.DOTALL)


class Inserter:
    """Makes the text of markers.

    Parameters
    ----------
    folder : Path
        Of the staged sources; pictures are drawn into it.
    draft : bool
        Whether films may be of a few pictures.

    """

    def __init__(self, folder: Path, *, draft: bool) -> None:
        self._folder = folder
        self._draft = draft
        self._unseen = {path.name for path in folder.glob("examples/*.json")}
        self._undrawn = {path.stem for path in folder.glob("objects/*.json")}

    def save_files(self, text: str) -> None:
        """Write the scenes that a page shows as files, so that they can be drawn."""
        for name, content in _FILE.findall(text):
            (self._folder / name).write_text(content, encoding="utf-8")

    def insert(self, marker: str) -> str:
        """Return the text in place of a marker."""
        what, *rest = shlex.split(marker)
        if what == "picture":
            return self._picture(*rest)
        if what == "scene":
            self._unseen.discard(Path(rest[0]).name)
            return self._pair(*rest)
        if what == "types":
            return "\n".join(self._type(name) for name in types_of(rest[0]))
        if what == "common":
            return common_keys()
        if what == "names":
            return names_by_section()
        if what == "paper":
            return {"table": paper_table, "comparison": paper_comparison}[rest[0]]()
        raise SystemExit(f"no such marker: {marker}")

    def check_complete(self) -> None:
        """Leave the program if an example is in no gallery, or a scene is of no type."""
        if self._unseen or self._undrawn:
            raise SystemExit(f"no page shows {sorted(self._unseen | self._undrawn)}")

    def _picture(self, name: str, *options: str) -> str:
        shown = draw(self._folder / name, options, draft=self._draft)
        return f":::{{container}} shown\n![{Path(name).stem}]({shown})\n:::"

    def _pair(self, name: str, *options: str) -> str:
        source = (self._folder / name).read_text(encoding="utf-8").rstrip()
        source = re.sub(r'^ *"\$schema": .*,\n', "", source, flags=re.MULTILINE)
        shown = draw(self._folder / name, options, draft=self._draft)
        return (
            f"::::{{container}} pair\n```json\n{source}\n```\n\n![{Path(name).stem}]({shown})\n::::"
        )

    def _type(self, name: str) -> str:
        if name not in self._undrawn:
            raise SystemExit(f"docs/objects/{name}.json is missing: every type has a scene there")
        self._undrawn.remove(name)
        return f"### {name}\n\n{own_keys(name)}\n\n{self._pair(f'objects/{name}.json')}\n"

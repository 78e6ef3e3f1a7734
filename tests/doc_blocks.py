"""Code blocks of the project's documents, and the comments that say how each is tried.

A comment on the line before a block is one of ``<!-- not run: WHY -->``, ``<!-- fails: CODE -->``,
with the exit code of the block's last command, and ``<!-- file: NAME -->``, the name under which
commands below find the block. Output follows its commands at once, in a block of ``text``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
# Documents with code for users. Those of the protocol are held by their own tests.
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
# The README's two commands, which make environments of their own: .ci/run runs them.
CONTRACTS = {"start command", "test command"}
_BLOCK = re.compile(
    r"(?:^<!-- (not run|fails|file|start command|test command)(?:: (.+?))? -->\n)?"
    r"^```([\w{}-]*)\n(.*?)^```$",
    re.MULTILINE | re.DOTALL,
)


@dataclass(frozen=True)
class Block:
    """A code block: its language, its text, and what its comment says."""

    language: str
    text: str
    line: int
    mark: str
    value: str

    @property
    def is_run(self):
        return self.mark not in {"not run", *CONTRACTS}


def blocks_of(document):
    """Return the code blocks of a document, in order."""
    text = document.read_text(encoding="utf-8")
    return [
        Block(found[3], found[4], text.count("\n", 0, found.start(3)) + 1, found[1] or "",
              found[2] or "")
        for found in _BLOCK.finditer(text)
    ]  # fmt: skip


def python_blocks():
    """Return pairs of a name and a text, of all Python blocks of all documents."""
    return [
        (f"{document.stem.replace('-', '_').lower()}_{block.line}", block.text)
        for document in DOCUMENTS
        for block in blocks_of(document)
        if block.language == "python"
    ]

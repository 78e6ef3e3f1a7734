"""Build of the documentation: ``python tools/docs.py [FOLDER]`` writes HTML, warnings are errors.

Needs the extra ``docs``. Sources are docs/ and the documents at the root; what is made while
building, pictures and tables of keys, is put beside copies of them and never into the repository.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from pathlib import Path

from documentation.staging import ROOT, stage


def build(output: Path, sources: Path, *, draft: bool) -> int:
    """Stage the sources in a folder and build HTML from them; return an exit code."""
    from sphinx.cmd.build import build_main  # noqa: PLC0415 - an extra

    stage(sources, draft=draft)
    return build_main(["-W", "--keep-going", "-q", "-E", "-b", "html", str(sources), str(output)])


def main() -> int:
    """Build what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument(
        "folder", nargs="?", type=Path, default=ROOT / "build" / "docs", help="[build/docs]"
    )
    parser.add_argument("--draft", action="store_true", help="films of few pictures: half the time")
    options = parser.parse_args()
    output: Path = options.folder.resolve()
    if output.exists() and any(output.iterdir()):
        if not (output / "searchindex.js").exists():
            parser.error(f"{output} is not empty and holds no documentation: name another folder")
        shutil.rmtree(output)
    with tempfile.TemporaryDirectory() as sources:
        code = build(output, Path(sources), draft=options.draft)
    if not code:
        print(output / "index.html")
    return code


if __name__ == "__main__":
    sys.exit(main())

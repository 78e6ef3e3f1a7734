"""Links and paths in the project's documents, and the commands that name its own programs."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
# A path in backticks: of a file or folder of the repository, or of a module of a package.
PATH = re.compile(r"`((?:voxdisplay|firmware_sim|tests|tools|examples|docs)/[\w./*-]*)`")


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_somewhere(document):
    for target in re.findall(r"\]\((?!http)([^)#]+)\)", document.read_text(encoding="utf-8")):
        assert (document.parent / target).exists(), target


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_paths_exist(document):
    for path in PATH.findall(document.read_text(encoding="utf-8")):
        if path.startswith(("voxdisplay/", "firmware_sim/")) and not (ROOT / "voxdisplay").exists():
            continue  # the tests of an installed package, outside of the repository
        assert list(ROOT.glob(path.rstrip("/"))), path


def test_modules_named_without_their_folder_exist():
    modules = {path.name for path in ROOT.rglob("*.py") if ".venv" not in path.parts}
    for document in DOCUMENTS:
        for name in re.findall(r"`(\w+\.py)`", document.read_text(encoding="utf-8")):
            assert name in modules or not (ROOT / "voxdisplay").exists(), f"{document.name}: {name}"

"""docs/files.md: its code runs, its formats are those that are read and written."""

import re
from pathlib import Path

import pytest

import voxdisplay as vd
from voxdisplay.files.suffixes import SUFFIXES
from voxdisplay.files.writing import WRITERS
from voxdisplay.raster.color_map import BUILT_IN

DOCUMENT = Path(__file__).parents[3] / "docs" / "files.md"
if not DOCUMENT.exists():
    pytest.skip("docs are not installed", allow_module_level=True)
TEXT = DOCUMENT.read_text(encoding="utf-8")


def test_its_python_runs():
    (code,) = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    exec(compile(code, "files.md", "exec"), {})  # noqa: S102 - our own text


def test_it_names_every_format_and_map():
    for suffix in (*SUFFIXES, *WRITERS):
        assert f"`{suffix}`" in TEXT or suffix == ".tiff"
    for name in BUILT_IN:
        assert f"`{name}`" in TEXT


def test_the_package_has_what_it_names():
    for name in re.findall(r"`vd\.files\.(\w+)", TEXT):
        assert callable(getattr(vd.files, name))


def test_every_name_of_the_package_has_its_module():
    assert sorted(vd.files._MODULES) == sorted(vd.files.__all__)
    for name in vd.files.__all__:
        assert getattr(vd.files, name)

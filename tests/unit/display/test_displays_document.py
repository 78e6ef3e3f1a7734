"""docs/displays.md: its profile and its Python work, its tables and numbers are true."""

import re
import tomllib
from pathlib import Path

import pytest

from voxdisplay.cli.push import push
from voxdisplay.display.profile import _READERS, read_profile
from voxdisplay.raster.light import dimmed_levels, parts_of

DOCUMENT = Path(__file__).parents[3] / "docs" / "displays.md"
if not DOCUMENT.exists():
    pytest.skip("docs are not installed", allow_module_level=True)
TEXT = DOCUMENT.read_text(encoding="utf-8")


def test_its_profile_has_every_key():
    (text,) = re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL)
    keys = tomllib.loads(text)
    assert {*keys, "sink"} == set(_READERS)  # the keys of LED cubes have a page of their own
    assert read_profile(keys).limit == (8, 20)


def test_its_table_has_every_key_and_option():
    rows = re.findall(r"^\| `(\w+)` \| (?:`(--\w+)[^`]*`|[a-z' ]+) \|", TEXT, re.MULTILINE)
    assert [key for key, _ in rows] == list(_READERS)
    options = {option for parameter in push.params for option in parameter.opts}
    assert {option for _, option in rows if option} <= options
    assert len([option for _, option in rows if option]) == len(rows) - 1


def test_its_python_runs():
    (code,) = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    exec(compile(code, "displays.md", "exec"), {})  # noqa: S102 - our own text


def test_its_levels_are_true():
    (found,) = re.findall(r"brightness of 0\.5, 255 becomes (\d+), and 128 becomes (\d+)", TEXT)
    assert dimmed_levels(parts_of(0.5))[[255, 128]].tolist() == [int(each) for each in found]

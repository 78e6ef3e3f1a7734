"""docs/displays.md: its profile and its Python work, its tables and numbers are true."""

import re
import tomllib
from pathlib import Path

import pytest

from voxdisplay.cli.push import push
from voxdisplay.display import part_profile
from voxdisplay.display.part_layout import PartLayout
from voxdisplay.display.profile import _READERS, read_profile
from voxdisplay.raster.light import dimmed_levels, parts_of

DOCUMENT = Path(__file__).parents[3] / "docs" / "displays.md"
if not DOCUMENT.exists():
    pytest.skip("docs are not installed", allow_module_level=True)
TEXT = DOCUMENT.read_text(encoding="utf-8")


def test_its_profile_has_every_key():
    text, _ = re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL)
    keys = tomllib.loads(text)
    # The keys of LED cubes have a page of their own, parts another profile.
    assert {*keys, "sink", "parts"} == set(_READERS)
    assert read_profile(keys).limit == (8, 20)


def test_its_table_has_every_key_and_option():
    table = TEXT.split("Options win over the profile.")[0]
    rows = re.findall(r"^\| `(\w+)` \| (?:`(--\w+)[^`]*`|[a-z' ]+) \|", table, re.MULTILINE)
    assert [key for key, _ in rows] == list(_READERS)
    options = {option for parameter in push.params for option in parameter.opts}
    assert {option for _, option in rows if option} <= options
    assert len([option for _, option in rows if option]) == len(rows) - 2


def test_its_python_runs():
    for code in re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL):
        exec(compile(code, "displays.md", "exec"), {})  # noqa: S102 - our own text


def test_its_parts_have_every_key_and_are_drawn_as_it_says():
    _, text = re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL)
    profile = read_profile(tomllib.loads(text))
    assert [part.at for part in profile.parts] == [(0, 0, 0), (64, 0, 0)]
    assert PartLayout(profile.parts).is_whole
    rows = re.findall(r"^\| `(\w+)` \|", TEXT.split("| key of a part |")[1], re.MULTILINE)
    assert set(rows) == set(part_profile._READERS)
    (drawn,) = re.findall(r"```text\n(.*?)```", TEXT, re.DOTALL)
    layout = PartLayout(
        part_profile.read_parts(
            [
                {"name": name, "port": name, "size": [32, 32, 32], "at": at}
                for name, at in [("left", [0, 0, 0]), ("right", [32, 0, 0]), ("back", [0, 32, 0])]
            ]
        )
    )
    assert drawn == "\n".join([*layout.faults(), layout.drawing()]) + "\n"


def test_its_levels_are_true():
    (found,) = re.findall(r"brightness of 0\.5, 255 becomes (\d+), and 128 becomes (\d+)", TEXT)
    assert dimmed_levels(parts_of(0.5))[[255, 128]].tolist() == [int(each) for each in found]

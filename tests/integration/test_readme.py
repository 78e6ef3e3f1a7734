"""The README: its scene, its two commands, its length, and the example of the package."""

import doctest
import re
from pathlib import Path

import voxdisplay as vd

TEXT = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")


def test_its_scene_is_the_one_that_its_command_shows():
    (text,) = re.findall(r"```json\n(.*?)```", TEXT, re.DOTALL)
    example = vd.load_scene("examples/lissajous.json")
    (shown,), (meant,) = vd.read_scene(text).items, example.items
    assert (vd.voxelize(shown.curve).voxels == vd.voxelize(meant.curve).voxels).all()


def test_its_two_commands_stand_below_their_comments():
    for name in ("start command", "test command"):
        (command,) = re.findall(rf"^<!-- {name} -->\n```\n(.+)\n```$", TEXT, re.MULTILINE)
        assert command.startswith("python3 -m venv .venv && ")


def test_it_is_short():
    assert TEXT.count("\n") < 90


def test_the_example_of_the_package():
    failed, tried = doctest.testmod(vd)
    assert tried
    assert not failed

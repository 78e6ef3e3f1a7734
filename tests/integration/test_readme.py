"""Commands, code, scene and links of the README, run as they stand there."""

import doctest
import re
from pathlib import Path

import voxdisplay as vd
from voxdisplay.cli.command_table import ENTRIES

TEXT = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")


def test_its_python():
    (code,) = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    exec(compile(code, "README.md", "exec"), {})  # noqa: S102 - our own text


def test_its_scenes():
    text, moving = re.findall(r"```json\n(.*?)```", TEXT, re.DOTALL)
    assert vd.read_scene(moving).frame_count == 120
    example = vd.load_scene("examples/paper-curve.json")
    (shown,), (meant,) = vd.read_scene(text).items, example.items
    assert (vd.voxelize(shown.curve).voxels == vd.voxelize(meant.curve).voxels).all()


def test_its_commands(run):
    """Every command line in a code block or between backticks, down to the options."""
    commands = re.findall(r"(?:^|`)voxdisplay ([a-z-]+)([^`\n]*)", TEXT, re.MULTILINE)
    names = {name for name, _ in commands}
    assert names >= {"push", "info", "ports", "voxelize", "annotate", "conformance"}
    assert names <= set(ENTRIES)
    for name in names:
        help_text = run(name, "--help").stdout
        for _, rest in (command for command in commands if command[0] == name):
            for option in re.findall(r" (--?[a-z-]+)(?= |$)", rest):
                assert f"{option} " in help_text.replace(",", " "), (name, rest)


def test_its_links():
    for target in re.findall(r"\]\((?!http)([^)#]+)\)", TEXT):
        assert (Path(__file__).parents[2] / target).exists(), target


def test_the_example_of_the_package():
    failed, tried = doctest.testmod(vd)
    assert tried
    assert not failed

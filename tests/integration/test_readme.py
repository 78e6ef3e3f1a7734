"""What the README shows works as it stands there."""

import doctest
import re
from pathlib import Path

import voxdisplay as vd

TEXT = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")


def test_its_python():
    (code,) = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    exec(compile(code, "README.md", "exec"), {})  # noqa: S102 - our own text


def test_its_scene_is_the_example():
    (text,) = re.findall(r"```json\n(.*?)```", TEXT, re.DOTALL)
    example = vd.load_scene("examples/paper-curve.json")
    (shown,), (meant,) = vd.read_scene(text).items, example.items
    assert (vd.voxelize(shown.curve).voxels == vd.voxelize(meant.curve).voxels).all()


def test_its_commands(run):
    commands = re.findall(r"^voxdisplay ((?:voxelize|push|info|ports)\b.*)$", TEXT, re.MULTILINE)
    assert len(commands) >= 5
    for command in commands:
        help_text = run(command.split()[0], "--help").stdout
        for option in re.findall(r"(--?[a-z-]+)(?= |$)", command):
            assert option in help_text, command


def test_its_links():
    for target in re.findall(r"\]\((?!http)([^)#]+)\)", TEXT):
        assert (Path(__file__).parents[2] / target).exists(), target


def test_the_example_of_the_package():
    failed, tried = doctest.testmod(vd)
    assert tried
    assert not failed

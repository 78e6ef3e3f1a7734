"""Help texts, the table of commands, and what is imported for them."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest

from voxdisplay.cli import options, param_types, test_pattern
from voxdisplay.cli.command_table import ENTRIES
from voxdisplay.cli.main import cli
from voxdisplay.display import test_patterns
from voxdisplay.display.baud import DEFAULT_BAUD
from voxdisplay.raster.pixel_format import PixelFormat

HEAVY = {"numpy", "serial", "usb", "msgspec", "cobs", "PIL", "websockets", "asyncio"}


def loaded_by(arguments, **environment):
    """Return the modules that a command line imports, and what it prints."""
    code = "import sys; from voxdisplay.__main__ import main; code = main()\n"
    code += "print(*sys.modules, file=sys.stderr)\nsys.exit(code)"
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True,
        text=True,
        check=False,
        env={"PATH": "", **environment},
    )
    return set(done.stderr.splitlines()[-1].split()), done.stdout


def command_of(name):
    return cli.get_command(click.Context(cli), name)


@pytest.mark.parametrize("arguments", [["--help"], *([name, "--help"] for name in ENTRIES)])
def test_help_loads_no_driver(arguments):
    modules, text = loaded_by(arguments)
    assert text.startswith("Usage: voxdisplay")
    assert not modules & HEAVY
    assert not {
        name
        for name in modules
        if re.match(r"voxdisplay\.(?!cli\b|errors$|printable_text$|__main)", name)
    }


def test_completion_of_commands_loads_no_command():
    shell = {
        "_VOXDISPLAY_COMPLETE": "bash_complete",
        "COMP_WORDS": "voxdisplay p",
        "COMP_CWORD": "1",
    }
    modules, text = loaded_by([], **shell)
    assert text.split() == [
        "plain,push",
        "plain,play",
        "plain,ports",
        "plain,preview",
        "plain,plan",
        "plain,protocol",
    ]
    assert not modules & HEAVY
    assert "voxdisplay.cli.push" not in modules


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("voxdisplay push --ver", "--verify"),
        ("voxdisplay push x --fit ", "contain"),
        ("voxdisplay push x --baud 115", "115200"),
        ("voxdisplay push x --port s", "sim:"),
        ("voxdisplay preview x --format rgb5", "rgb565"),
        ("voxdisplay plan x --features line,o", "line,oct"),
    ],
)
@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_of_options(run, shell, words, offered):
    count = str(len(words.split(" ")) - 1)
    last = words.split(" ")[-1]
    environment = {
        "_VOXDISPLAY_COMPLETE": f"{shell}_complete",
        "COMP_WORDS": words,
        "COMP_CWORD": last if shell == "fish" else count,
    }
    assert offered in run(**environment).stdout


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_shell_has_a_script(run, shell):
    done = run(_VOXDISPLAY_COMPLETE=f"{shell}_source")
    assert done.returncode == 0
    assert "_VOXDISPLAY_COMPLETE" in done.stdout


@pytest.mark.skipif(not shutil.which("fish"), reason="needs fish")
def test_fish_completes_behind_a_comma(tmp_path):
    script = "_VOXDISPLAY_COMPLETE=fish_source voxdisplay | source\n"
    script += "complete -C 'voxdisplay plan x --features line,o'\n"
    script += "complete -C 'voxdisplay push --reconn'\n"
    here = Path(sys.executable).parent
    variables = {"PATH": f"{here}:/usr/bin:/bin", "HOME": str(tmp_path)}
    command = [shutil.which("fish"), "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, env=variables, check=True)
    first, second = done.stdout.splitlines()
    assert first == "line,oct"
    assert second.startswith(
        "--reconnect\tHow long to wait for a display that is not plugged in yet,"
    )


def test_a_summary_is_the_first_sentence_of_its_command_and_fits_a_line():
    for name, entry in ENTRIES.items():
        assert entry.summary.endswith(".")
        assert len(entry.summary) <= 60, name
        assert command_of(name).name == name


@pytest.mark.parametrize("name", ENTRIES)
def test_every_help_has_examples_and_every_option_a_text(run, name):
    command = command_of(name)
    text = run(name, "--help", COLUMNS="80").stdout
    assert re.search(
        rf"Examples?:\n(?:  +\S.*\n)*?  +(?:\S+ )?\"?(?:\$\()?voxdisplay {name}\b", text
    ), text
    assert text.isascii()
    assert max(map(len, text.splitlines())) <= 80
    for option in command.params:
        if isinstance(option, click.Option):
            assert option.help, option.name
            # What click itself writes of defaults and limits differs from release to release.
            assert not option.show_default
            assert not isinstance(option.type, click.IntRange | click.FloatRange)


def test_the_help_of_all_fits_eighty_columns(run):
    text = run("--help", COLUMNS="80").stdout
    assert "..." not in text.replace("[ARGS]...", "")
    for name, entry in ENTRIES.items():
        assert re.search(rf"^  {name} +{re.escape(entry.summary)}$", text, re.MULTILINE)


def test_what_is_written_twice_to_import_nothing_is_the_same():
    assert str(DEFAULT_BAUD) == options.DEFAULT_BAUD_TEXT
    assert set(param_types.PIXEL_FORMATS) == {kind.value for kind in PixelFormat}
    assert list(test_pattern.PATTERNS) == list(test_patterns.NAMES)


def test_without_a_command_the_help_is_an_error(run):
    done = run()
    assert done.returncode == 2
    assert done.stdout == ""
    assert "Usage: voxdisplay" in done.stderr

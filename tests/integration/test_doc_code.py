"""Code of the documents, as it stands there: commands on the emulator, Python, scenes."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from doc_blocks import CONTRACTS, DOCUMENTS, ROOT, blocks_of, python_blocks

import voxdisplay as vd
from voxdisplay.cli.command_table import ENTRIES

# Languages of blocks that hold nothing to run: output, settings, drawings, directives of Sphinx.
SHOWN = {"text", "toml", "mermaid", "{toctree}"}
# Figures of one run.
TIME = re.compile(r"\d+\.\d (m?s)\b")


@pytest.fixture(params=DOCUMENTS, ids=lambda path: path.name)
def document(request):
    if not request.param.exists():
        pytest.skip("docs are not installed")
    return request.param


def test_every_block_says_what_it_is(document):
    text = document.read_text(encoding="utf-8")
    blocks = blocks_of(document)
    assert len(blocks) == len(re.findall(r"^ *```", text, re.MULTILINE)) / 2
    for block in blocks:
        where = (document.name, block.line)
        if block.mark not in CONTRACTS:
            assert block.language in {"sh", "json", "python", *SHOWN}, where
            assert block.is_run or block.language in {"sh", "json"}, where


@pytest.mark.parametrize(
    ("name", "code"), python_blocks(), ids=[name for name, _ in python_blocks()]
)
def test_python(name, code, tmp_path, monkeypatch):
    pillow = pytest.importorskip("PIL.ImageShow", reason="needs the extra view")
    if "from scipy" in code:
        pytest.importorskip("scipy", reason="needs scipy, which is no part of any extra")
        np.seterr(under="ignore")  # the solver counts on it
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(pillow, "show", lambda _image: True)  # no window opens
    monkeypatch.chdir(tmp_path)
    exec(compile(code, name, "exec"), {"__name__": name})  # noqa: S102 - our own text


def test_scenes(document, tmp_path):
    for block in blocks_of(document):
        if block.language == "json" and block.is_run and not is_wrong(document, block):
            frame = vd.Frame((128, 128, 128))
            frame.draw(vd.read_scene(block.text, folder=tmp_path))
            assert len(frame.lit()[0]), (document.name, block.line)


def is_wrong(document, block):
    """Return whether a scene of a file is named by a command that fails."""
    return block.mark == "file" and any(
        other.mark == "fails" and block.value in other.text for other in blocks_of(document)
    )


@pytest.mark.skipif(not shutil.which("bash"), reason="needs bash")
def test_commands(document, tmp_path):
    """Run on the emulator, in a folder that has the examples; lines of output come as shown."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    programs = Path(sys.executable).parent
    environment = os.environ | {
        "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
        "VOXDISPLAY_PORT": "sim:",
    }
    blocks = blocks_of(document)
    for number, block in enumerate(blocks):
        if block.mark == "file":
            tmp_path.joinpath(block.value).write_text(block.text, encoding="utf-8")
        if block.language != "sh" or not block.is_run:
            continue
        done = subprocess.run(
            [shutil.which("bash"), "-euc", block.text], cwd=tmp_path, env=environment, check=False,
            capture_output=True, text=True, timeout=120,
        )  # fmt: skip
        output = done.stdout + done.stderr
        meant = int(block.value) if block.mark == "fails" else 0
        assert done.returncode == meant, (block.text, output)
        following = blocks[number + 1 : number + 2]
        shown = "".join(other.text for other in following if other.language == "text")
        lines = TIME.sub(r"0 \1", output).splitlines()
        for line in TIME.sub(r"0 \1", shown).splitlines():
            assert line in lines, (block.text, output)


def test_commands_and_options_exist(document, run):
    """Every command in a block or between backticks, also those that are not run."""
    text = document.read_text(encoding="utf-8")
    shell = "\n".join(block.text for block in blocks_of(document) if block.language == "sh")
    commands = re.findall(r"^voxdisplay ([a-z][a-z-]*)([^\n]*)", shell, re.MULTILINE)
    commands += re.findall(r"`voxdisplay ([a-z][a-z-]*)([^`\n]*)", text)
    assert {name for name, _ in commands} <= set(ENTRIES)
    for name in {name for name, _ in commands}:
        help_text = run(name, "--help").stdout
        if "Commands:" in help_text:
            continue
        for _, rest in (command for command in commands if command[0] == name):
            for option in re.findall(r" (--?[a-z-]+)(?= |$)", rest):
                assert f"{option} " in help_text.replace(",", " "), (name, rest)

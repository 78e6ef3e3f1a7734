"""Reports of type checkers on users' code: the documents' examples, and calls that must fail."""

import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from doc_blocks import python_blocks

# What scipy returns has no types for a checker, and it need not be installed.
EXAMPLES = [(name, code) for name, code in python_blocks() if "from scipy" not in code]

# Beside the examples: public names with the types that users rely on, and one mistake a line.
USES = """\
from pathlib import Path
from typing import assert_type

import numpy as np
import voxdisplay as vd

assert_type(vd.__version__, str)
assert_type(vd.voxelize(vd.Circle((5, 5, 5), 3)), vd.Sequence)
assert_type(vd.load_scene(Path("curve.json")), vd.Scene)
frame = vd.Frame((3, 5, 7), "index8")
assert_type(frame.draw(vd.Circle((5, 5, 5), 3), color=(255, 128, 0)), vd.Drawing)
frame.draw(vd.load_scene("curve.json"))
frame.draw([(1, 2, 3)], ["red", (0, 255, 0)])
frame.draw(np.zeros((4, 3), dtype=int), np.zeros((4, 3), dtype=np.uint8))
frame.save(Path("x.png"))
assert np.array_equal(frame, np.asarray(frame))
with vd.open() as display:
    assert_type(display, vd.Display)
    assert_type(display.present(frame), vd.Receipt)
    print(display.present(frame).elapsed_s)
    display.present(frame, wait=False)
    assert_type(display.present(frame), vd.Receipt)
    assert_type(display.present(frame, wait=True).elapsed_s, float)
    display.present(frame, wait=False)
    for wait in (True, False):
        assert_type(display.present(frame, wait=wait), vd.Receipt | None)
vd.open()
vd.open(Path("/dev/ttyUSB0"), no_reset=True).close(flush=False)
"""
MISTAKES = """\
import voxdisplay as vd

vd.Cirle((5, 5, 5), 3)
vd.Frame((3, 5, 7)).drow([(1, 2, 3)])
vd.Frame((3, 5, 7)).draw([(1, 2, 3)], color=3)
vd.voxelize()
vd.open().present(vd.Frame((3, 5, 7)), wait=False).elapsed_s
vd.open(3)
"""


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    folder = tmp_path_factory.mktemp("user")
    assert EXAMPLES
    for name, example in EXAMPLES:
        folder.joinpath(f"{name}.py").write_text(example, encoding="utf-8")
    folder.joinpath("uses.py").write_text(USES, encoding="utf-8")
    folder.joinpath("mistakes.py").write_text(MISTAKES, encoding="utf-8")
    return folder


def assert_only_mistakes(found):
    """``found``: pairs of a file's name and a line, from 1."""
    lines = range(3, MISTAKES.count("\n") + 1)
    assert sorted(set(found)) == [("mistakes.py", line) for line in lines], found


@pytest.mark.skipif(not find_spec("mypy"), reason="needs mypy, of the extra dev")
def test_mypy(sources):
    command = [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", "--config-file=",
               "--no-incremental", "."]  # fmt: skip
    run = subprocess.run(command, cwd=sources, capture_output=True, text=True, check=False)
    assert run.stderr == ""
    lines = [line.split(":") for line in run.stdout.splitlines() if ": error: " in line]
    assert_only_mistakes([(name, int(line)) for name, line, *_ in lines])


@pytest.mark.skipif(not find_spec("basedpyright"), reason="needs basedpyright, of the extra dev")
def test_pyright(sources):
    config = {"typeCheckingMode": "standard", "pythonVersion": "3.11"}
    sources.joinpath("pyrightconfig.json").write_text(json.dumps(config), encoding="utf-8")
    command = [sys.executable, "-m", "basedpyright", "--outputjson", "--pythonpath",
               sys.executable]  # fmt: skip
    run = subprocess.run(command, cwd=sources, capture_output=True, text=True, check=False)
    errors = [
        (Path(entry["file"]).name, entry["range"]["start"]["line"] + 1)
        for entry in json.loads(run.stdout)["generalDiagnostics"]
        if entry["severity"] == "error"
    ]
    assert_only_mistakes(errors)

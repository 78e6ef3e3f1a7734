"""Literals of both sides against the tables of protocol.md, name for name."""

import ast
from pathlib import Path

import document
import pytest

from firmware_sim import memory as device_memory
from firmware_sim import spec as device_spec
from voxdisplay.wire import spec as driver_spec

ROOT = Path(__file__).parents[2]
SPECS = pytest.mark.parametrize("spec", [driver_spec, device_spec], ids=["driver", "device"])
GROUPS = {name.split("_")[0] for name in document.literals()}


@SPECS
def test_literals_are_the_documents(spec):
    transcribed = {
        name: value
        for name, value in vars(spec).items()
        if name.split("_")[0] in GROUPS and isinstance(value, int)
    }
    assert transcribed == document.literals()


@SPECS
def test_layouts_are_the_documents(spec):
    transcribed = {
        name.removeprefix("LAYOUT_"): tuple(tuple(field) for field in value)
        for name, value in vars(spec).items()
        if name.startswith("LAYOUT_")
    }
    assert transcribed == document.layouts()


def test_pixels_have_the_documents_bytes():
    assert document.pixel_bytes() == driver_spec.PIXEL_BYTES
    device = {format_.code: format_.size for format_ in device_memory.FORMATS.values()}
    assert device == document.pixel_bytes()


@pytest.mark.parametrize(
    ("package", "forbidden"),
    [("voxdisplay", {"firmware_sim"}), ("firmware_sim", {"voxdisplay", "numpy", "cobs"})],
)
def test_the_two_sides_never_meet(package, forbidden):
    """Also not inside a function, nor by a name in quotes."""
    for path in (ROOT / package).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names = {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                names = {(node.module or "").split(".")[0]}
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                names = {node.value} if node.value in forbidden else set()
            else:
                continue
            assert not names & forbidden, f"{path}:{node.lineno}"

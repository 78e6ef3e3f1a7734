"""Import rules: arrows run one way, without circles, and nothing heavy is imported in vain."""

import ast
import graphlib
import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest


def folder_of(package):
    """Folder of an installed package, be it a checkout or a wheel."""
    return Path(importlib.util.find_spec(package).origin).parent


PACKAGE, EMULATOR = map(folder_of, ("voxdisplay", "firmware_sim"))

PICTURE = Path(__file__).parents[2] / "docs" / "architecture.md"
# What all may import, and who may import all.
EVERYWHERE = {"argument_checks", "errors", "printable_text"}
TOP = {"__init__", "__main__", "cli"}


def drawn_arrows():
    """Arrows of the picture: pairs of an importing room and a room, or one module of a room."""
    drawing = PICTURE.read_text(encoding="utf-8").split("```mermaid")[1].split("```")[0]
    for line in drawing.splitlines():
        if found := re.fullmatch(r"\s*(\w+) -->(?:\|(\w+)\|)? (\w+)", line):
            start, module, end = found.groups()
            yield start, f"{end}.{module}" if module else end


ARROWS = set(drawn_arrows())
ROOMS = {room for start, end in ARROWS for room in (start, end.split(".")[0])}


def imports_of(path):
    """Modules that a file imports, function-level imports included."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            for alias in node.names:
                inner = PACKAGE.parent.joinpath(*base.split("."), alias.name)
                is_module = inner.with_suffix(".py").exists() or inner.is_dir()
                yield f"{base}.{alias.name}" if is_module else base


def modules(package):
    """Dotted names and paths of the modules below the folder of a package."""
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package.parent).with_suffix("").parts
        yield ".".join(parts[:-1] if parts[-1] == "__init__" else parts), path


def crossings():
    """Imports from one room of the driver into another: the file, its room, what it imports."""
    for name, path in modules(PACKAGE):
        room = name.removeprefix("voxdisplay").removeprefix(".").split(".")[0] or "__init__"
        for other in imports_of(path):
            inner = other.removeprefix("voxdisplay.")
            if other.startswith("voxdisplay.") and inner.split(".")[0] != room and room not in TOP:
                yield path, room, inner


def test_imports_are_those_of_the_picture():
    used = set()
    for path, room, inner in crossings():
        if inner.split(".")[0] in EVERYWHERE:
            continue
        arrows = {
            (start, end)
            for start, end in ARROWS
            if start == room and f"{inner}.".startswith(f"{end}.")
        }
        assert arrows, f"{path.relative_to(PACKAGE)} imports {inner}"
        used |= arrows
    assert used == ARROWS


def test_what_all_may_import_imports_nothing_else():
    for path, room, inner in crossings():
        if room in EVERYWHERE:
            assert inner.split(".")[0] in EVERYWHERE, f"{path.relative_to(PACKAGE)}: {inner}"


def test_every_room_is_in_the_picture():
    parts = {
        path.stem
        for path in PACKAGE.iterdir()
        if path.suffix == ".py" or (path / "__init__.py").exists()
    }
    assert parts - TOP - EVERYWHERE == ROOMS - TOP


@pytest.mark.parametrize("package", [PACKAGE, EMULATOR], ids=lambda package: package.name)
def test_no_modules_import_each_other(package):
    paths = dict(modules(package))
    graph = {
        name: {other for other in imports_of(path) if other in paths and other != name}
        for name, path in paths.items()
    }
    graphlib.TopologicalSorter(graph).prepare()


# A backend of pyusb raises pyusb's exceptions. Who calls it has loaded them; so may it, then.
MAY_BE_LOADED = {("usb/backend.py", "usb.core")}


def test_the_emulator_needs_only_the_standard_library():
    for path in EMULATOR.rglob("*.py"):
        for name in imports_of(path):
            if (path.relative_to(EMULATOR).as_posix(), name) in MAY_BE_LOADED:
                continue
            top = name.split(".")[0]
            assert top in sys.stdlib_module_names or top == "firmware_sim", f"{path}: {name}"


def test_the_emulator_itself_loads_nothing_else():
    script = "import sys, firmware_sim.command_line, firmware_sim.usb; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in run.stdout.split()}
    assert not loaded & {"usb", "numpy", "serial", "voxdisplay"}


PUSH = """
import sys, numpy
from voxdisplay.__main__ import main
before = set(sys.modules)
sys.argv = ["voxdisplay", "push", *sys.argv[1:], "--port", "sim:"]
code = main()
print(code, *set(sys.modules) - before)
"""


def test_push_imports_nothing_heavy(tmp_path):
    scene = tmp_path / "scene.json"
    scene.write_text(
        '{"type": "torus_knot", "p": 2, "q": 3, "center": [64, 64, 64], "major": 40, "minor": 9}'
    )
    run = subprocess.run(
        [sys.executable, "-c", PUSH, scene], capture_output=True, text=True, check=True
    )
    code, *loaded = run.stdout.splitlines()[-1].split()
    assert code == "0", run.stderr
    assert "firmware_sim.device" in loaded
    heavy = {"PIL", "scipy", "numba", "jsonschema", "usb", "websockets", "trimesh", "nibabel"}
    heavy |= {"nrrd", "pydicom", "uharfbuzz", "cmap", "dask", "asyncio", "multiprocessing"}
    heavy |= {"anywidget", "ipywidgets", "traitlets", "IPython"}
    assert not heavy & {name.split(".")[0] for name in loaded}
    assert "tomllib" not in loaded
    assert "numpy.ma" not in loaded, "it takes as long to import as a small scene to draw"
    needless = re.compile(
        r"voxdisplay\.(view|files|conformance|annotation|shows|sinks|bodies|voxelization\.surfaces)\."
        r"|voxdisplay\.(display\.(profile|part_|tiled_|swap_)|raster\.(orientation|light|dither)|frame\.output)"
    )
    allowed = {"voxdisplay.bodies.body", "voxdisplay.files.suffixes", "voxdisplay.shows.show"}
    assert not {name for name in loaded if needless.match(name)} - allowed

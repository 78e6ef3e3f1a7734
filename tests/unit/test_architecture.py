"""The arrows of the house run one way; nothing heavy is imported where it is not needed."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "voxdisplay"

# What each part of the driver may import of the driver.
MAY_IMPORT = {
    "printable_text": set(),
    "errors": {"printable_text"},
    "compute": {"compute"},
    "expressions": {"compute", "errors", "expressions"},
    "curves": {"compute", "errors", "expressions", "curves"},
    "voxelization": {"compute", "errors", "curves", "raster.grid", "voxelization"},
    "raster": {"errors", "raster", "wire.spec"},
    "wire": {"errors", "raster", "wire"},
    "frame": {"curves", "errors", "raster", "view", "voxelization", "wire"},
    "scene": {"compute", "curves", "errors", "expressions", "raster", "scene"},
    "link": {"errors", "link", "wire"},
    "transport": {"errors", "printable_text", "transport", "wire.spec"},
    "conformance": {"conformance", "errors", "printable_text", "transport", "wire.spec"},
    "view": {"errors", "printable_text", "raster", "view"},
    "display": {"display", "errors", "frame", "link", "raster", "transport", "wire"},
}


def imports_of(path):
    """Modules of the driver that a file imports, function-level imports included."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            for alias in node.names:
                inner = Path(ROOT, *base.split("."), alias.name)
                is_module = inner.with_suffix(".py").exists() or inner.is_dir()
                yield f"{base}.{alias.name}" if is_module else base


@pytest.mark.parametrize("part", MAY_IMPORT)
def test_arrows_run_one_way(part):
    files = [PACKAGE / f"{part}.py", *(PACKAGE / part).rglob("*.py")]
    for path in (path for path in files if path.exists()):
        for name in imports_of(path):
            if name.startswith("voxdisplay."):
                inner = name.removeprefix("voxdisplay.")
                allowed = any(
                    inner == may or inner.startswith(f"{may}.") for may in MAY_IMPORT[part]
                )
                assert allowed, f"{path.relative_to(ROOT)} imports {name}"


def test_every_part_is_listed():
    parts = {
        path.stem
        for path in PACKAGE.iterdir()
        if path.suffix == ".py" or (path / "__init__.py").exists()
    }
    assert parts - {"__init__", "__main__", "cli"} == set(MAY_IMPORT)


# A backend of pyusb raises pyusb's exceptions. Who calls it has loaded them; so may it, then.
MAY_BE_LOADED = {("usb/backend.py", "usb.core")}


def test_the_emulator_needs_only_the_standard_library():
    emulator = ROOT / "firmware_sim"
    for path in emulator.rglob("*.py"):
        for name in imports_of(path):
            if (path.relative_to(emulator).as_posix(), name) in MAY_BE_LOADED:
                continue
            top = name.split(".")[0]
            assert top in sys.stdlib_module_names or top == "firmware_sim", f"{path}: {name}"


def test_the_emulator_itself_loads_nothing_else():
    script = "import sys, firmware_sim.__main__, firmware_sim.usb; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in run.stdout.split()}
    assert not loaded & {"usb", "numpy", "serial", "voxdisplay"}


def test_push_imports_nothing_heavy():
    script = "import sys, voxdisplay.cli.main; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in run.stdout.split()}
    assert not loaded & {"PIL", "scipy", "numba", "jsonschema", "usb", "websockets", "firmware_sim"}

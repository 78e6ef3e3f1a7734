"""Import rules: arrows run one way, without circles, and nothing heavy is imported in vain."""

import ast
import graphlib
import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest


def folder_of(package):
    """Folder of an installed package, be it a checkout or a wheel."""
    return Path(importlib.util.find_spec(package).origin).parent


PACKAGE, EMULATOR = map(folder_of, ("voxdisplay", "firmware_sim"))

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
    "display": {
        "display",
        "errors",
        "frame",
        "link",
        "printable_text",
        "raster",
        "transport",
        "wire",
    },
}


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
                assert allowed, f"{path.relative_to(PACKAGE)} imports {name}"


def test_every_part_is_listed():
    parts = {
        path.stem
        for path in PACKAGE.iterdir()
        if path.suffix == ".py" or (path / "__init__.py").exists()
    }
    assert parts - {"__init__", "__main__", "cli"} == set(MAY_IMPORT)


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
    script = "import sys, firmware_sim.__main__, firmware_sim.usb; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in run.stdout.split()}
    assert not loaded & {"usb", "numpy", "serial", "voxdisplay"}


def test_push_imports_nothing_heavy():
    script = "import sys, voxdisplay.cli.main; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in run.stdout.split()}
    assert not loaded & {"PIL", "scipy", "numba", "jsonschema", "usb", "websockets", "firmware_sim"}

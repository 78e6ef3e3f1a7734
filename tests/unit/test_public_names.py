"""Public names of the package: loaded lazily, complete, and plain for tools that inspect them."""

import ast
import inspect
import pydoc
import re
import subprocess
import sys
import types
from pathlib import Path

import pytest

import voxdisplay as vd

SOURCE = Path(vd.__file__)


def seen_by_type_checkers():
    """Public names by module, and ``__all__``, as they stand under ``if TYPE_CHECKING``."""
    (block,) = (
        node
        for node in ast.parse(SOURCE.read_text(encoding="utf-8")).body
        if isinstance(node, ast.If)
        and isinstance(node.test, ast.Name)
        and node.test.id == "TYPE_CHECKING"
    )
    imports = {
        node.module: [alias.name for alias in node.names]
        for node in block.body
        if isinstance(node, ast.ImportFrom)
    }
    (names,) = (
        ast.literal_eval(node.value)
        for node in block.body
        if isinstance(node, ast.Assign) and node.targets[0].id == "__all__"
    )
    return imports, names


def run(script, *options):
    """Standard output of a script that runs in a fresh interpreter."""
    command = [sys.executable, *options, "-c", script]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_table_imports_and_all_agree():
    imports, names = seen_by_type_checkers()
    assert imports == vd._MODULES
    assert names == vd.__all__ == sorted(vd._MODULE_OF)
    assert sum(map(len, vd._MODULES.values())) == len(names), "each name once"


@pytest.mark.parametrize("name", vd.__all__)
def test_a_name_is_that_of_its_module(name):
    value = getattr(vd, name)
    assert value is getattr(sys.modules[vd._MODULE_OF[name]], name)
    assert value.__name__ == name
    assert not isinstance(value, types.ModuleType)


def test_the_package_imports_nothing_heavy():
    loaded = run("import sys; before = set(sys.modules); import voxdisplay;"
                 "print(*set(sys.modules) - before)").split()  # fmt: skip
    assert loaded == ["voxdisplay"]


def test_the_entry_point_imports_only_what_has_loaded():
    loaded = run("import sys; before = set(sys.modules); import voxdisplay.__main__;"
                 "new = set(sys.modules) - before - set(sys.builtin_module_names);"
                 "print(*new)").split()  # fmt: skip
    assert set(loaded) == {"voxdisplay", "voxdisplay.__main__"}


def test_star_import_brings_all_names():
    names = run("from voxdisplay import *; import voxdisplay; print(*set(dir()) - {'voxdisplay'})")
    assert set(vd.__all__) <= set(names.split())


def test_dir_lists_names_before_their_first_use():
    names = run("import voxdisplay; print(*dir(voxdisplay))").split()
    assert {*vd.__all__, "__version__"} <= set(names)


def test_submodules_are_attributes_without_an_import():
    assert run("import voxdisplay as vd; print(vd.errors.SceneError is vd.SceneError)") == "True\n"


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'voxdisplay' has no attribute 'Cirle'"):
        _ = vd.Cirle
    with pytest.raises(ImportError, match="cannot import name 'Cirle'"):
        exec("from voxdisplay import Cirle")  # noqa: S102


def test_version_is_that_of_the_distribution():
    from importlib.metadata import version  # noqa: PLC0415

    assert vd.__version__ == version("voxdisplay")


def test_no_module_is_callable():
    for name, module in list(sys.modules.items()):
        if name.split(".")[0] == "voxdisplay":
            assert not callable(module), name


def without_blanks(text):
    """Text of pydoc on one line: newer ones break long signatures into lines."""
    return "".join(pydoc.plain(text).split())


def test_voxelize_has_its_own_signature_and_documentation():
    assert inspect.isfunction(vd.voxelize)
    parameters = inspect.signature(vd.voxelize).parameters
    assert list(parameters) == [
        "curve", "method", "variant", "tangent", "pitch", "reach", "certified", "clip",
    ]  # fmt: skip
    assert "voxelize(curve:'Curve|Body',*," in without_blanks(pydoc.render_doc(vd.voxelize))


def test_help_is_an_overview_of_every_name():
    text = pydoc.plain(pydoc.render_doc(vd))
    assert len(text.splitlines()) < 600
    for name in vd.__all__:
        assert re.search(rf"^ +{name} +[A-Z(].*\.$", text, re.MULTILINE), name
    for name in vd.__all__:
        if name.islower():
            signature = inspect.signature(getattr(vd, name))
            full = without_blanks(f"{name}{signature}")
            assert full in without_blanks(text), f"{name} is documented in full"


@pytest.mark.parametrize("name", vd.__all__)
def test_help_of_one_name_is_readable(name):
    text = pydoc.plain(pydoc.render_doc(getattr(vd, name)))
    # Newer versions of Python write long signatures with a line for each argument.
    assert len(text.splitlines()) < 400
    assert "ndarray(shape" not in text


def test_help_does_not_change_what_others_see():
    pydoc.render_doc(vd)
    assert "Circle" in vd.__all__
    assert run("import pydoc, voxdisplay as vd; pydoc.render_doc(vd); print(len(vd.__all__))") == (
        f"{len(vd.__all__)}\n"
    )

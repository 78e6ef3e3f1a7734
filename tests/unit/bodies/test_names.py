"""Names of the package of bodies: complete, and loaded when they are first used."""

import subprocess
import sys

import pytest

from voxdisplay import bodies


def test_every_name_has_its_module():
    assert sorted(bodies._MODULES) == sorted(bodies.__all__)
    for name in bodies.__all__:
        assert getattr(bodies, name).__module__ == f"voxdisplay.bodies.{bodies._MODULES[name]}"


def test_other_names_are_none():
    with pytest.raises(AttributeError, match="'Ball'"):
        _ = bodies.Ball


def test_a_frame_loads_no_body():
    script = "import sys, voxdisplay.frame; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    loaded = {name for name in run.stdout.split() if name.startswith("voxdisplay.bodies.")}
    assert not loaded & {f"voxdisplay.bodies.{each}" for each in ("text", "volume", "surface")}

"""``voxdisplay protocol`` and ``schema``: documents that come with the package."""

import json
import tomllib
from pathlib import Path

import click
import pytest
from conftest import ROOT

from voxdisplay.cli import document_paths


def test_protocol_is_the_document(run, tmp_path):
    path = Path(run("protocol", cwd=tmp_path).stdout.removesuffix("\n"))
    assert path.is_absolute()
    assert path.read_bytes() == (ROOT / "protocol.md").read_bytes()


def test_the_vectors_come_with_it(run, tmp_path):
    path = Path(run("protocol", "--vectors", cwd=tmp_path).stdout.removesuffix("\n"))
    assert path.read_bytes() == (ROOT / "vectors.json").read_bytes()
    both = run("protocol", "--vectors", "--recording")
    assert both.returncode == 2
    assert "give one of them" in both.stderr


def test_schema_is_a_json_schema(run, tmp_path):
    path = Path(run("schema", cwd=tmp_path).stdout.removesuffix("\n"))
    assert json.loads(path.read_text(encoding="utf-8"))["$schema"].startswith("https://json-schema")


def test_a_wheel_has_the_protocol_inside_the_package(tmp_path, monkeypatch):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    included = project["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    assert included["protocol.md"] == "voxdisplay/protocol.md"
    assert included["vectors.json"] == "voxdisplay/vectors.json"
    monkeypatch.setattr(document_paths, "_PACKAGE", tmp_path / "voxdisplay")
    (tmp_path / "voxdisplay").mkdir()
    (tmp_path / "voxdisplay" / "protocol.md").touch()
    assert document_paths.protocol_path() == tmp_path / "voxdisplay" / "protocol.md"


def test_an_installation_that_lacks_it_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(document_paths, "_PACKAGE", tmp_path / "voxdisplay")
    with pytest.raises(click.ClickException, match=r"protocol\.md is missing"):
        document_paths.protocol_path()

"""Hints for mistyped words: right, or absent."""

from __future__ import annotations

import pytest

from voxdisplay.cli.command_table import ENTRIES
from voxdisplay.errors import did_you_mean, similar_file
from voxdisplay.raster.color import NAMED

TYPES = ("segment", "polyline", "circle", "bspline", "catmull_rom", "points", "torus_knot")
KEYS = ("center", "radius", "closed", "color", "from", "to", "file", "axes", "knots", "t")


@pytest.mark.parametrize(
    ("word", "known", "meant"),
    [
        ("cricle", TYPES, "circle"),
        ("spline", TYPES, "bspline"),
        ("b-spline", TYPES, "bspline"),
        ("catmull", TYPES, "catmull_rom"),
        ("CatmullRom", TYPES, "catmull_rom"),
        ("lightgolenrodyelow", NAMED, "lightgoldenrodyellow"),
        ("colour", KEYS, "color"),
        ("centre", KEYS, "center"),
        ("knot", KEYS, "knots"),
        ("orang", NAMED, "orange"),
        ("lightgrene", NAMED, "lightgreen"),
        ("darkslategre", NAMED, "darkslategrey"),
        ("voxelise", ENTRIES, "voxelize"),
        ("pusj", ENTRIES, None),
        ("psuh", ENTRIES, "push"),
        ("testpattern", ENTRIES, "test-pattern"),
    ],
)
def test_slips_of_the_keys(word: str, known: tuple[str, ...], meant: str | None) -> None:
    assert did_you_mean(word, known) == (meant and f"did you mean {meant!r}?")


@pytest.mark.parametrize(
    ("word", "known"),
    [
        *((word, TYPES) for word in ("line", "lines", "plane", "wire", "polygon", "t", "")),
        *((word, KEYS) for word in ("note", "comment", "axis", "fill", "stop", "dt", "t0")),
        *((word, NAMED) for word in ("none", "lightred", "rose", "sand", "rainbow", "mint")),
        *((word, ENTRIES) for word in ("close", "import", "export", "delete", "blank", "upload")),
    ],
)
def test_other_words_are_not_slips(word: str, known: tuple[str, ...]) -> None:
    assert did_you_mean(word, known) is None


def test_two_words_that_are_as_near() -> None:
    assert did_you_mean("curve3", ["curve1", "curve2"]) is None


@pytest.mark.parametrize(
    ("name", "names", "meant"),
    [
        ("curv.json", ["curve.json", "other.json"], "curve.json"),
        ("curve.json", ["curve.csv"], "curve.csv"),
        ("curve.json", ["curve.csv", "curve.npy"], None),
        ("house.json", ["x.json", "flower.json"], None),
        ("a.json", ["b.json"], None),
        ("сцена.json", ["s.json"], None),
    ],
)
def test_files(name: str, names: list[str], meant: str | None) -> None:
    assert similar_file(name, names) == (meant and f"did you mean {meant!r}?")

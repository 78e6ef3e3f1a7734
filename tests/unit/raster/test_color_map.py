"""Colour maps by name, by a list of colours, and of the library cmap."""

import sys

import numpy as np
import pytest

from voxdisplay.errors import MissingExtra
from voxdisplay.raster.color_map import BUILT_IN, color_map


@pytest.mark.parametrize("name", BUILT_IN)
def test_every_built_in_map_has_256_colors_and_a_reverse(name):
    colors = color_map(name)
    assert colors.shape == (256, 3)
    assert colors.dtype == np.uint8
    assert not colors.flags.writeable
    assert np.array_equal(color_map(f"{name}_r"), colors[::-1])


@pytest.mark.parametrize("name", ["gray", "magma", "inferno", "plasma", "viridis"])
def test_built_in_maps_are_those_of_their_names(name):
    cmap = pytest.importorskip("cmap", reason="needs the extra maps")
    exact = np.asarray(cmap.Colormap(name)(np.linspace(0, 1, 256)))[:, :3] * 255
    difference = np.abs(color_map(name) - exact)
    assert difference.max() < 8.5
    assert difference.mean() < 1


def test_gray_is_the_ramp_itself():
    assert np.array_equal(color_map("gray"), np.repeat(np.arange(256)[:, None], 3, axis=1))
    assert np.array_equal(color_map(" Grey "), color_map("gray"))


def test_a_list_of_colors_is_spread_evenly():
    colors = color_map(["black", (255, 0, 0), "#fff"])
    assert colors[[0, 255]].tolist() == [[0, 0, 0], [255, 255, 255]]
    assert color_map(["lime"]).tolist() == [[0, 255, 0]] * 256


def test_other_names_are_those_of_cmap():
    pytest.importorskip("cmap", reason="needs the extra maps")
    assert color_map("batlow").shape == (256, 3)


@pytest.mark.parametrize(
    ("name", "hint"), [("magmaa", "'magma'"), ("batlwo", "batlow"), ("../x", "built in")]
)
def test_unknown_names_are_refused_with_the_nearest(name, hint):
    pytest.importorskip("cmap", reason="needs the extra maps")
    with pytest.raises(ValueError, match="no colour map") as caught:
        color_map(name)
    assert hint in str(caught.value)


def test_without_cmap_its_names_ask_for_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "cmap", None)
    with pytest.raises(MissingExtra, match="no colour map") as caught:
        color_map("oslo")
    assert "voxdisplay[maps]" in caught.value.hint
    assert "magma" in caught.value.hint
    with pytest.raises(ValueError, match="'viridis'"):
        color_map("virids")


@pytest.mark.parametrize("wrong", [3, None, b"gray", [], [1.5]])
def test_other_kinds_are_refused(wrong):
    with pytest.raises((TypeError, ValueError)):
        color_map(wrong)

"""Pictures of frames, scenes, sequences and displays: notebooks, files, the picture viewer."""

import io
import sys
import types

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.frame import Frame
from voxdisplay.view import rich_display

pytest.importorskip("PIL", reason="needs the extra view")

from PIL import Image, ImageShow

GRID = (8, 9, 10)
SCENE = '{"size": [8, 9, 10], "objects": [{"type": "segment", "from": [1, 1, 1], "to": [7, 8, 9]}]}'


@pytest.fixture
def frame():
    frame = Frame(GRID)
    frame.draw(vd.Segment((1, 1, 1), (7, 8, 9)))
    return frame


def pixels(png):
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))


def brightest(png):
    flat = pixels(png).reshape(-1, 3)
    return flat[flat.astype(int).sum(axis=1).argmax()].tolist()


def test_scene_and_frame_have_the_same_picture(frame):
    scene = vd.read_scene(SCENE)
    assert scene._repr_png_() == frame._repr_png_()
    assert frame._repr_png_() != Frame(GRID)._repr_png_()


def test_a_scene_without_a_size_has_a_picture():
    assert vd.read_scene('{"type": "segment", "from": [1, 1, 1], "to": [99, 8, 9]}')._repr_png_()


def test_a_display_has_the_picture_that_it_shows(frame):
    with vd.open("sim:?size=8x9x10") as display:
        assert display._repr_png_() is None, "it is not known what is on display"
        display.present(frame)
        assert display._repr_png_() == frame._repr_png_()


def test_a_sequence_has_a_picture_wherever_it_lies():
    here, there = (vd.voxelize(vd.Segment((a, a, a), (a + 9, a + 5, a + 3))) for a in (-4, 3000))
    assert here._repr_png_() == there._repr_png_()
    assert brightest(here._repr_png_())[1] > 150


def test_voxels_that_no_picture_can_show_have_none():
    assert rich_display.voxels_png(np.empty((0, 3), dtype=np.int32)) is None
    assert rich_display.voxels_png(np.array([[0, 0, 0], [70_000, 0, 0]])) is None
    assert rich_display.voxels_png(np.array([[5, 5, 5], [5, 5, 5]])) is not None


def test_the_picture_has_the_colours_of_an_own_palette():
    palette = Frame(GRID, "index8").palette
    palette[7] = 0, 255, 0
    frame = Frame(GRID, "index8", palette=palette)
    frame.set(np.full((10, 9, 8), 7, dtype=np.uint8))
    red, green, blue = brightest(frame._repr_png_())
    assert green > 150
    assert red < green
    assert blue < green


def test_save_writes_what_the_suffix_says(frame, tmp_path):
    frame.save(tmp_path / "a.PNG")
    frame.save(str(tmp_path / "a.html"))
    assert (tmp_path / "a.PNG").read_bytes() == frame._repr_png_()
    assert b"<html" in (tmp_path / "a.html").read_bytes()


def test_save_names_the_suffixes_that_there_are(frame, tmp_path):
    with pytest.raises(ValueError, match=r"'a\.jpg'.* \.png, \.gif, \.mp4, \.html"):
        frame.save(tmp_path / "a.jpg")
    with pytest.raises(TypeError, match="path: expected a str or path, found int"):
        frame.save(3)
    with pytest.raises(OSError, match="nowhere"):
        frame.save(tmp_path / "nowhere" / "a.png")
    assert list(tmp_path.iterdir()) == []


def test_show_opens_a_viewer(frame, monkeypatch):
    shown = []
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(ImageShow, "show", lambda image: shown.append(image) or True)
    frame.show()
    assert (np.asarray(shown[0]) == pixels(frame._repr_png_())).all()
    monkeypatch.setattr(ImageShow, "show", lambda _image: False)
    with pytest.raises(vd.VoxDisplayError, match="no picture viewer") as caught:
        frame.show()
    assert "frame.save" in caught.value.hint


@pytest.mark.parametrize("moves", [False, True])
def test_show_of_a_scene_is_that_of_its_first_frame(frame, monkeypatch, moves):
    shown = []
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(ImageShow, "show", lambda image: shown.append(image) or True)
    vd.read_scene(SCENE.replace("{", '{"duration": 9, ', 1) if moves else SCENE).show()
    assert (np.asarray(shown[0]) == pixels(frame._repr_png_())).all()


def test_show_without_a_screen_is_an_error(frame, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(ImageShow, "show", lambda _image: pytest.fail("a viewer was opened"))
    with pytest.raises(vd.VoxDisplayError, match="no screen") as caught:
        frame.show()
    assert "frame.save" in caught.value.hint


@pytest.mark.parametrize("in_kernel", [True, False])
def test_show_in_a_notebook_without_widgets_is_its_output(frame, monkeypatch, in_kernel):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    for name in [name for name in sys.modules if name.startswith("voxdisplay.view.notebook.")]:
        monkeypatch.delitem(sys.modules, name)
    shown = []
    shell = types.SimpleNamespace(kernel=None) if in_kernel else types.SimpleNamespace()
    ipython = types.ModuleType("IPython")
    ipython.get_ipython = lambda: shell
    ipython.display = types.ModuleType("IPython.display")
    ipython.display.display = shown.append
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    monkeypatch.setitem(sys.modules, "IPython.display", ipython.display)
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(ImageShow, "show", lambda _image: True)
    frame.show()
    assert len(shown) == in_kernel
    assert all((np.asarray(each) == pixels(frame._repr_png_())).all() for each in shown)

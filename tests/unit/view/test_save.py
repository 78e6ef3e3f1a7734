"""Files of pictures: replaced atomically or not at all."""

import os

import numpy as np
import pytest
from PIL import Image

from voxdisplay.cli.param_types import IMAGE_SUFFIXES
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.view.atomic_write import atomic_write
from voxdisplay.view.picture import RenderOptions, render_page
from voxdisplay.view.save import FILM_SUFFIXES, WRITERS, ExportJob, save

GRID = Grid(3, 5, 7)
PAGE = np.zeros((7, 5, 3, 3), np.uint8)
PAGE[6, 4, 2] = (255, 128, 0)
SHOT = ExportJob(
    PAGE, GRID, PixelFormat.RGB888, RenderOptions(size=(160, 120)), seconds=0.2, fps=20
)


def test_the_command_line_knows_what_can_be_written():
    assert tuple(WRITERS) == IMAGE_SUFFIXES
    assert set(FILM_SUFFIXES) < set(WRITERS)


def test_a_png_is_the_picture(tmp_path):
    path = tmp_path / "x.PNG"
    save(path, SHOT)
    image = Image.open(path)
    assert image.format == "PNG"
    meant = render_page(PAGE, GRID, PixelFormat.RGB888, RenderOptions(size=(160, 120)))
    assert image.convert("RGB").tobytes() == meant.tobytes()
    assert [each.name for each in tmp_path.iterdir()] == ["x.PNG"]


def test_a_gif_is_as_long_as_asked(tmp_path):
    save(tmp_path / "x.gif", SHOT)
    with Image.open(tmp_path / "x.gif") as film:
        assert film.n_frames == 4


def test_who_has_the_old_file_open_keeps_it_whole(tmp_path):
    path, old = tmp_path / "x.png", tmp_path / "old"
    path.write_bytes(b"old")
    os.link(path, old)
    save(path, SHOT)
    assert old.read_bytes() == b"old", "it was replaced, and not written over"
    assert path.read_bytes().startswith(b"\x89PNG")


def write_and_fail(path):
    with atomic_write(path) as unfinished:
        unfinished.write_bytes(b"half")
        raise OSError("no space left")


def test_what_fails_leaves_the_old_file_alone(tmp_path):
    path = tmp_path / "x.png"
    path.write_bytes(b"old")
    with pytest.raises(OSError, match="space"):
        write_and_fail(path)
    assert path.read_bytes() == b"old"
    assert [each.name for each in tmp_path.iterdir()] == ["x.png"]


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "real.png").write_bytes(b"old")
    (tmp_path / "link.png").symlink_to("real.png")
    with atomic_write(tmp_path / "link.png") as unfinished:
        unfinished.write_bytes(b"new")
    assert (tmp_path / "link.png").is_symlink()
    assert (tmp_path / "real.png").read_bytes() == b"new"


def test_what_is_no_ordinary_file_is_not_replaced(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with atomic_write(pipe) as unfinished:
        assert unfinished == pipe
    assert pipe.is_fifo()

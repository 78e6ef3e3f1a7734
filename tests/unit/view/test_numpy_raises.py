"""Pictures in a program that has numpy raise on every floating-point condition."""

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.view.camera import Camera
from voxdisplay.view.half_blocks import half_blocks
from voxdisplay.view.lit_voxels import lit_voxels
from voxdisplay.view.live.snapshot_message import Snapshot, encode
from voxdisplay.view.picture import RenderOptions, render_page
from voxdisplay.view.save import FILM_SUFFIXES, WRITERS, ExportJob, save

GRID = vd.Grid(3, 5, 7)
VOXELS = {"none": [], "one": [(1, 2, 3)], "ends": [(0, 0, 0), (2, 4, 6)], "all": None}
CAMERAS = [Camera(), Camera(yaw=1e-310, pitch=1e-310), Camera(pitch=np.pi / 2, distance=1.0)]


@pytest.fixture(autouse=True)
def numpy_raises():
    with np.errstate(all="raise"):
        yield


def page_of(name, format_):
    frame = vd.Frame(GRID, format_)
    voxels = VOXELS[name]
    if voxels is None:
        frame.set(np.ones_like(frame.array()))
    elif voxels:
        frame.draw(np.array(voxels), "#010203")  # next to nothing
    return frame.array()


@pytest.mark.parametrize("format_", list(vd.PixelFormat))
@pytest.mark.parametrize("name", VOXELS)
def test_pictures_of_all_kinds(name, format_, tmp_path):
    page = page_of(name, format_)
    for camera in CAMERAS:
        for size in ((40, 30), (640, 480)):
            options = RenderOptions(size=size, camera=camera)
            assert render_page(page, GRID, format_, options).size == size
    lines = half_blocks(lit_voxels(page, GRID, format_), GRID, 20, 5)
    assert len(lines) == 5
    assert encode(Snapshot(page, GRID, format_, 1, "title"))
    for suffix in WRITERS.keys() - FILM_SUFFIXES:
        save(tmp_path / f"x{suffix}", ExportJob(page, GRID, format_))


def test_films(tmp_path):
    options = RenderOptions(size=(40, 30))
    job = ExportJob(page_of("ends", "rgb888"), GRID, vd.PixelFormat.RGB888, options, seconds=0.1)
    save(tmp_path / "x.gif", job)

"""Films, decoded by other programs."""

import io
import shutil
import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest
from PIL import Image

from voxdisplay.errors import MissingExtra
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.view.animation import Turntable, save_gif, save_mp4
from voxdisplay.view.lit_voxels import lit_voxels
from voxdisplay.view.picture import RenderOptions, render_voxels

GRID = Grid(3, 5, 7)
SIZE = (161, 121)  # odd, which films do not like
COUNT = 9


@pytest.fixture
def turn():
    array = np.zeros((*GRID.array_shape, 3), np.uint8)
    array[0, 0, 0], array[0, 0, 2] = (255, 160, 0), (0, 200, 255)
    return Turntable(
        lit_voxels(array, GRID, PixelFormat.RGB888), GRID, RenderOptions(size=SIZE), COUNT
    )


def local_palettes(data):
    """Return how many pictures of a GIF have a palette of their own, by the format's own blocks."""
    at = 13 + (3 << (data[10] & 7) + 1)  # the header, and the palette of all
    assert data[10] & 0x80
    own = 0
    while data[at] != 0x3B:
        if data[at] == 0x21:
            at += 2
        else:
            assert data[at] == 0x2C
            flags = data[at + 9]
            own += flags >> 7
            at += 10 + (3 << (flags & 7) + 1 if flags & 0x80 else 0) + 1
        while data[at]:
            at += data[at] + 1
        at += 1
    return own


def test_a_gif_turns_once_with_one_palette(turn, tmp_path):
    save_gif(tmp_path / "x.gif", turn, fps=30)
    data = (tmp_path / "x.gif").read_bytes()
    assert local_palettes(data) == 0
    film = Image.open(io.BytesIO(data))
    assert film.n_frames == COUNT
    assert film.info["loop"] == 0
    durations = []
    for number in range(COUNT):
        film.seek(number)
        durations.append(film.info["duration"])
        shown = np.asarray(film.convert("RGB")).astype(int)
        apart = np.abs(shown - np.asarray(turn[number]))
        assert apart.mean() < 6, "a palette's colours are near enough"
    assert sum(durations) == 300
    assert set(durations) == {30, 40}


def test_the_turn_begins_where_the_camera_is_and_closes(turn):
    first = render_voxels(turn._lit, GRID, RenderOptions(size=SIZE), turn._exposure)
    assert turn[0].tobytes() == first.tobytes()
    assert len(turn) == COUNT
    assert len({picture.tobytes() for picture in turn}) == COUNT
    assert turn[-1].tobytes() == turn[COUNT - 1].tobytes()
    assert len(turn[2:4]) == 2
    with pytest.raises(IndexError):
        turn[COUNT]


def test_progress_is_told():
    told = []
    lit = lit_voxels(np.ones((7, 5, 3), np.uint8), GRID, PixelFormat.MONO1)
    list(Turntable(lit, GRID, RenderOptions(size=SIZE), 3, lambda *done: told.append(done)))
    assert told == [(1, 3), (2, 3), (3, 3)]


def test_nothing_lit_is_a_film_too(tmp_path):
    lit = lit_voxels(np.zeros((7, 5, 3), np.uint8), GRID, PixelFormat.MONO1)
    save_gif(tmp_path / "x.gif", Turntable(lit, GRID, RenderOptions(size=SIZE), 1), fps=20)
    with Image.open(tmp_path / "x.gif") as film:
        assert film.size == SIZE


@pytest.mark.skipif(find_spec("av") is None, reason="needs the extra mp4")
def test_mp4_by_pyav(turn, tmp_path):
    save_mp4(tmp_path / "x.mp4", turn, fps=20)
    assert b"ftyp" in (tmp_path / "x.mp4").read_bytes()[:16]
    import av  # noqa: PLC0415

    with av.open(str(tmp_path / "x.mp4")) as film:
        assert film.streams.video[0].average_rate == 20
        frames = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
    check_frames(frames, turn)


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="needs ffmpeg on the PATH")
def test_mp4_by_ffmpeg(turn, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    save_mp4(tmp_path / "x.mp4", turn, fps=20)
    command = ["ffmpeg", "-loglevel", "error", "-i", tmp_path / "x.mp4", "-f", "rawvideo"]
    raw = subprocess.run([*command, "-pix_fmt", "rgb24", "-"], capture_output=True, check=True)
    check_frames(np.frombuffer(raw.stdout, np.uint8).reshape(-1, 120, 160, 3), turn)


def check_frames(frames, turn):
    assert len(frames) == COUNT
    assert frames[0].shape == (120, 160, 3), "an odd side loses its last pixel"
    for frame, picture in zip(frames, turn, strict=True):
        apart = np.abs(frame.astype(int) - np.asarray(picture)[:120, :160])
        assert apart.mean() < 8


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="needs ffmpeg on the PATH")
def test_an_encoder_that_fails_says_why(turn, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(OSError, match="ffmpeg"):
        save_mp4(tmp_path / "nowhere" / "x.mp4", turn, fps=20)


def test_no_encoder_at_all(turn, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    monkeypatch.setattr(shutil, "which", lambda _: None)
    with pytest.raises(MissingExtra, match="PyAV or ffmpeg") as raised:
        save_mp4(tmp_path / "x.mp4", turn, fps=20)
    assert "voxdisplay[mp4]" in raised.value.hint

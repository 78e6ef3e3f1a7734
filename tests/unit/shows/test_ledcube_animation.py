"""Baked LED cube animations: archives written by hand after the published description."""

from __future__ import annotations

import json
import pickle
import zipfile

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.shows.ledcube_animation import LedCubeAnimation

SIZE = {"x": 3, "y": 5, "z": 7}
STRIDE = {"Binary": 14, "Grayscale": 105, "Rgb": 315}


def write(path, pool, **changes):
    manifest = {
        "formatVersion": 1, "name": "a", "size": SIZE, "ledFormat": "Rgb", "frameCount": 6,
        "frameTimeUs": 20_000, "loop": True, "unknown": {"kept": 1},
        "keyframes": [{"at": 0, "id": 1}, {"at": 2, "id": 0}, {"at": 5, "id": 1}],
    } | changes  # fmt: skip
    manifest = {key: value for key, value in manifest.items() if value is not None}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("manifest.json", json.dumps(manifest))
        archive.writestr("frames.bin", bytes(pool))
        archive.writestr("meta/audio", b"ignored")
    return path


@pytest.fixture
def path(tmp_path):
    return tmp_path / "cube.lcanimraw"


def test_key_frames_hold_until_the_next_one(path):
    pool = np.zeros((2, 7, 5, 3, 3), np.uint8)
    pool[0, 6, 4, 2] = 255, 0, 0
    pool[1, 0, 1, 2] = 0, 255, 0
    show = LedCubeAnimation(write(path, pool.tobytes()))
    assert (show.grid, show.pixel_format) == ((3, 5, 7), vd.PixelFormat.RGB888)
    assert (show.frame_count, show.fps, show.loop) == (6, 50.0, True)
    assert show.duration == pytest.approx(0.12)
    frames = [show.frame(number).array() for number in range(6)]
    ids = [1, 1, 0, 0, 0, 1]
    assert all(np.array_equal(frames[n], pool[ids[n]]) for n in range(6))
    again = pickle.loads(pickle.dumps(show))  # noqa: S301 - of our own
    assert np.array_equal(again.frame(3).array(), frames[3])
    with pytest.raises(IndexError):
        show.frame(6)


def test_linear_light_becomes_srgb(path):
    pool = np.zeros((1, 7, 5, 3), np.uint8)
    pool[0, 0, 0] = 1, 55, 188
    show = LedCubeAnimation(
        write(path, pool, ledFormat="Grayscale", keyframes=[{"at": 0, "id": 0}])
    )
    # A light of 55/255 is 128 in sRGB; of 188/255 it is 223, of 1/255 it is 13.
    assert show.frame(0).array()[0, 0, :, 0].tolist() == [13, 128, 223]
    assert show.frame(0).array()[0, 0, 1].tolist() == [128, 128, 128]


def test_bits_are_in_scan_order_lowest_first(path):
    lit = np.zeros((7, 5, 3), bool)
    lit[0, 0, 1] = lit[2, 3, 0] = lit[6, 4, 2] = True
    pool = np.packbits(lit.reshape(-1), bitorder="little")
    assert len(pool) == STRIDE["Binary"]
    show = LedCubeAnimation(write(path, pool, ledFormat="Binary", keyframes=[{"at": 0, "id": 0}]))
    assert show.pixel_format is vd.PixelFormat.MONO1
    assert np.array_equal(show.frame(5).array() != 0, lit)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"formatVersion": 2}, "version 2, not 1"),
        ({"formatVersion": None}, "formatVersion is None"),
        ({"size": [3, 5, 7]}, "size is no object"),
        ({"size": {"x": 3, "y": 5}}, "z is None"),
        ({"size": {"x": 1e5, "y": 5, "z": 7}}, "x is 100000.0"),
        ({"size": {"x": 100_000, "y": 5, "z": 7}}, "size: grid"),
        ({"size": {"x": 4096, "y": 4096, "z": 4096}}, "size: grid"),
        ({"ledFormat": "Rgba"}, "ledFormat is 'Rgba', none of Binary, Grayscale, Rgb"),
        ({"ledFormat": ["Rgb"]}, "ledFormat"),
        ({"ledFormat": "Binary"}, r"keyframes\[0\]: id is 45"),
        ({"size": {"x": 4, "y": 5, "z": 7}}, r"frames\.bin is 630 bytes long"),
        ({"frameCount": 0}, "frameCount is 0"),
        ({"frameCount": True}, "frameCount is True"),
        ({"frameCount": 10**9}, "frameCount is 1000000000"),
        ({"frameTimeUs": 0}, "frameTimeUs is 0"),
        ({"keyframes": []}, "keyframes is no list"),
        ({"keyframes": {}}, "keyframes is no list"),
        ({"keyframes": [7]}, r"keyframes\[0\] is no object"),
        ({"keyframes": [{"at": 1, "id": 0}]}, r"keyframes\[0\]: at is 1, must be 0"),
        ({"keyframes": [{"at": 0, "id": 0}, {"at": 0, "id": 1}]}, r"\[1\]: at is 0, must be above"),
        ({"keyframes": [{"at": 0, "id": 0}, {"at": 6, "id": 1}]}, r"\[1\]: at is 6"),
        ({"keyframes": [{"at": 0, "id": 2}]}, r"\[0\]: id is 2"),
        ({"keyframes": [{"at": 0, "id": -1}]}, r"\[0\]: id is -1"),
    ],
)
def test_what_is_wrong_is_named(path, changes, message):
    if "Binary" in changes.values():
        changes = changes | {"keyframes": [{"at": 0, "id": 45}]}
    with pytest.raises(vd.RecordingError, match=message):
        LedCubeAnimation(write(path, bytes(630), **changes))


@pytest.mark.parametrize("data", [b"", b"PK\3\4", b"\0" * 100])
def test_other_files(path, data):
    path.write_bytes(data)
    with pytest.raises(vd.RecordingError, match=r"damaged, or no \.lcanimraw file"):
        LedCubeAnimation(path)


@pytest.mark.parametrize("manifest", [b"{", b"[]", b"\xff", b"[" * 100_000])
def test_other_manifests(path, manifest):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("manifest.json", manifest)
        archive.writestr("frames.bin", b"")
    with pytest.raises(vd.RecordingError, match=r"manifest\.json is no"):
        LedCubeAnimation(path)


@pytest.mark.parametrize("missing", ["manifest.json", "frames.bin"])
def test_archives_of_something_else(path, missing):
    with zipfile.ZipFile(path, "w") as archive:
        for name in {"manifest.json", "frames.bin"} - {missing}:
            archive.writestr(name, b"{}")
    with pytest.raises(vd.RecordingError, match=f"has no {missing}"):
        LedCubeAnimation(path)


def test_bombs_are_not_unpacked(path):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("manifest.json", b"{}")
        archive.writestr("frames.bin", bytes((1 << 28) + 1))
    with pytest.raises(vd.RecordingError, match="268435457 bytes long"):
        LedCubeAnimation(path)


def test_any_bytes(path):
    whole = write(path, bytes(630)).read_bytes()
    chance = np.random.default_rng(5)
    for _ in range(100):
        data = bytearray(whole)
        for place in chance.integers(0, len(data), 3):
            data[place] = chance.integers(256)
        path.write_bytes(data[: chance.integers(len(data))] if chance.random() < 0.3 else data)
        try:
            show = LedCubeAnimation(path)
        except vd.RecordingError:
            continue
        show.frame(show.frame_count - 1)

"""Frames of MagicaVoxel files: key frames of models and transforms, and what is written."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from vox_chunks import attributes, chunk, group, model, shape, transform, vox

import voxdisplay as vd
from voxdisplay.files.vox_frames import VoxFrames, write_vox_frames


def keyed_shape(node, **models):
    """A shape whose model in frame n is m, by ``f<n>=m``."""
    listed = b"".join(
        struct.pack("<i", number) + attributes(f=name[1:]) for name, number in models.items()
    )
    return chunk(
        b"nSHP", struct.pack("<i", node) + attributes() + struct.pack("<i", len(models)) + listed
    )


def keyed_transform(node, child, *frames):
    """A transform with attributes for each frame."""
    head = struct.pack("<i", node) + attributes() + struct.pack("<4i", child, -1, 0, len(frames))
    return chunk(b"nTRN", head + b"".join(attributes(**each) for each in frames))


def lit(frames, number):
    voxels, _ = frames.frame(number)
    return sorted(map(tuple, voxels.tolist()))


def test_a_shape_shows_its_models_in_turn_and_each_until_the_next():
    data = vox(
        model((3, 5, 7), [(0, 0, 0, 1)]),
        model((3, 5, 7), [(2, 4, 6, 1)]),
        transform(0, 1),
        keyed_shape(1, f0=0, f3=1, f5=0),
    )
    frames = VoxFrames("a.vox", data)
    assert (frames.frame_count, frames.sides) == (6, (3, 5, 7))
    first, second = [(0, 0, 0)], [(2, 4, 6)]
    wanted = [first, first, first, second, second, first]
    assert [lit(frames, number) for number in range(6)] == wanted


def test_a_transform_moves_and_turns_its_model():
    data = vox(
        model((1, 1, 3), [(0, 0, 0, 1), (0, 0, 2, 1)]),
        keyed_transform(0, 1, {"t": "0 0 0"}, {"f": "2", "t": "4 0 0", "r": "6"}),
        shape(1, 0),
    )
    frames = VoxFrames("a.vox", data)
    assert frames.frame_count == 3
    before, after = lit(frames, 1), lit(frames, 2)
    assert before == lit(frames, 0)
    assert np.ptp(before, axis=0).tolist() == [0, 0, 2]
    assert np.ptp(after, axis=0).tolist() != [0, 0, 2], "turned"
    both = np.array(before + after)
    assert both.min(axis=0).tolist() == [0, 0, 0]
    assert (both.max(axis=0) < frames.sides).all()


def test_models_without_a_scene_are_frames():
    frames = VoxFrames(
        "a.vox", vox(model((2, 3, 1), [(0, 2, 0, 1)]), model((4, 1, 1), [(3, 0, 0, 1)]))
    )
    assert (frames.frame_count, frames.sides) == (2, (4, 3, 1))
    assert [lit(frames, 0), lit(frames, 1)] == [[(0, 2, 0)], [(3, 0, 0)]]


def test_hidden_parts_are_left_out():
    data = vox(
        model((1, 1, 1), [(0, 0, 0, 1)]), transform(0, 1), group(1, 2, 4),
        transform(2, 3, hidden="1"), shape(3, 0), transform(4, 5), shape(5, 0),
    )  # fmt: skip
    assert lit(VoxFrames("a.vox", data), 0) == [(0, 0, 0)]


@pytest.mark.parametrize(
    ("chunks", "message"),
    [
        ((transform(0, 1), keyed_shape(1, f0=0, f999999999=0)), "1000000000 frames"),
        ((transform(0, 1), keyed_shape(1, f0=0, f3=9)), "shows model 9 of 1"),
        ((transform(0, 1, hidden="1"), shape(1, 0)), "hidden or empty"),
        ((keyed_transform(0, 1, {"t": "0 0 0"}, {"f": "2", "t": "x"}), shape(1, 0)), "transl"),
        ((transform(0, 1, frames=1_000_000_000 // 400), shape(1, 0)), "attribute"),
    ],
)
def test_what_is_wrong_is_named(chunks, message):
    if message == "attribute":  # more frames are claimed than there are
        chunks = (chunk(b"nTRN", struct.pack("<i", 0) + attributes()
                        + struct.pack("<4i", 1, -1, -1, 1 << 30)), chunks[1])  # fmt: skip
    with pytest.raises(vd.BodyError, match=message):
        VoxFrames("a.vox", vox(model((1, 1, 1), [(0, 0, 0, 1)]), *chunks))


def moving(number):
    voxels = np.array([(number % 3, 1, number % 7), (2, 4, 6)])
    return voxels, np.array([(255, 128, number // 2), (0, 0, 255)], np.uint8)


@pytest.mark.parametrize("count", [1, 2, 9])
def test_what_is_written_is_read_again(tmp_path, count):
    path = tmp_path / "a.vox"
    assert write_vox_frames(path, (3, 5, 7), count, moving) is None
    frames = VoxFrames("a.vox", path.read_bytes())
    assert (frames.frame_count, frames.sides) == (count, (3, 5, 7))
    for number in range(count):
        for found, wanted in zip(frames.frame(number), moving(number), strict=True):
            assert np.array_equal(found, wanted)


def test_frames_that_stay_are_written_once(tmp_path):
    path = tmp_path / "a.vox"
    write_vox_frames(path, (3, 5, 7), 100, lambda number: moving(number // 50))
    frames = VoxFrames("a.vox", path.read_bytes())
    assert frames.frame_count == 100
    assert path.read_bytes().count(b"XYZI") == 3  # the last one says how long it is
    assert np.array_equal(frames.frame(49)[0], moving(0)[0])
    assert np.array_equal(frames.frame(50)[0], moving(1)[0])


def test_dark_frames(tmp_path):
    path, none = tmp_path / "a.vox", (np.empty((0, 3), int), np.empty((0, 3), np.uint8))
    write_vox_frames(path, (3, 5, 7), 3, lambda number: none if number != 1 else moving(1))
    frames = VoxFrames("a.vox", path.read_bytes())
    assert [len(frames.frame(number)[0]) for number in range(3)] == [0, 2, 0]


def test_limits_of_the_format(tmp_path):
    with pytest.raises(vd.BodyError, match="256 voxels a side at most, not 257"):
        write_vox_frames(tmp_path / "a.vox", (257, 1, 1), 1, moving)
    shades = np.stack([np.arange(256)] * 3, axis=1).astype(np.uint8)[None].repeat(2, 0)
    shades[1, :, 0] = 7
    places = np.column_stack((np.arange(256), np.zeros((256, 2), int)))
    remark = write_vox_frames(
        tmp_path / "a.vox", (256, 1, 1), 2, lambda number: (places, shades[number])
    )
    assert "255 colours, of 511" in remark
    frames = VoxFrames("a.vox", (tmp_path / "a.vox").read_bytes())
    error = np.abs(frames.frame(1)[1].astype(int) - shades[1])
    assert error.max() < 12

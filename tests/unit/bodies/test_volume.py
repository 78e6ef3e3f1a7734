"""Volumes and voxel models under maps: scaled, mirrored, turned and clipped."""

import itertools

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.bodies import VoxelModel
from voxdisplay.curves.arguments import ArgumentError
from voxdisplay.raster.color_map import color_map

VALUES = np.random.default_rng(3).integers(0, 100, size=(7, 5, 3)).astype(np.float64)
CUBE = np.argwhere(np.ones((3, 2, 4)))[:, ::-1]


def as_dict(voxels):
    """Voxels of a set with their colours."""
    colors = voxels.colors if voxels.colors is not None else np.zeros((len(voxels.voxels), 3))
    rows = zip(voxels.voxels.tolist(), colors.tolist(), strict=True)
    return {tuple(voxel): tuple(color) for voxel, color in rows}


def test_a_volume_lights_its_samples_by_the_map():
    found = vd.voxelize(vd.Volume(VALUES, window=(0, 99), map="viridis"))
    assert found.kind == "volume"
    lit = np.argwhere(VALUES > 0)[:, ::-1]
    assert np.array_equal(found.voxels, lit)
    x, y, z = lit.T
    assert np.allclose(found.parameters["value"], VALUES[z, y, x])
    entries = np.floor(VALUES[z, y, x] / 99 * 255 + 0.5).astype(int)
    assert np.array_equal(found.colors, color_map("viridis")[entries])


def test_it_agrees_with_volume_pixels():
    frame = vd.Frame((6, 10, 14))
    frame.draw(vd.Volume(VALUES, window=(5, 80), map="magma", spacing=(2, 2, 2)))
    assert np.array_equal(
        frame.array(), vd.volume_pixels(VALUES, window=(5, 80), map="magma", grid=(6, 10, 14))
    )


@pytest.mark.parametrize("labels", [False, True])
@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
@pytest.mark.parametrize("signs", list(itertools.product((1, -1), repeat=3)))
def test_axes_exchanged_and_mirrored_move_each_sample(order, signs, labels):
    matrix = np.eye(3)[list(order)] * np.array(signs)[:, None]
    body = vd.Volume(VALUES, window=(0, 99), labels=labels).transformed(matrix, (20, 30, 40))
    found = as_dict(vd.voxelize(body))
    plain = as_dict(vd.voxelize(vd.Volume(VALUES, window=(0, 99), labels=labels)))
    moved = {
        tuple(np.floor(matrix @ (np.array(voxel) + 0.5) + (20, 30, 40)).astype(int)): color
        for voxel, color in plain.items()
    }
    assert found == moved


def test_a_clip_shows_the_same_voxels_as_a_larger_one():
    body = vd.Volume(VALUES, spacing=(2.3, 1.7, 0.6), offset=(-1.2, 0.4, 0.7), threshold=40)
    whole = as_dict(vd.voxelize(body))
    clipped = as_dict(vd.voxelize(body, clip=(4, 6, 3)))
    expected = {
        key: value
        for key, value in whole.items()
        if all(0 <= each < side for each, side in zip(key, (4, 6, 3), strict=True))
    }
    assert clipped == expected
    assert 0 < len(clipped) < len(whole)


def test_a_turned_ball_stays_a_ball():
    z, y, x = np.indices((31, 31, 31)) - 15
    ball = np.sqrt(x**2 + y**2 + z**2)
    body = vd.Volume(20 - ball, threshold=10, window=(0, 20), offset=(-15.5, -15.5, -15.5))
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    for scale, slack in ((0.3, 0.3), (1.0, 0.1), (1.9, 0.1)):
        found = vd.voxelize(body.transformed(turn * scale)).voxels + 0.5
        radius = np.linalg.norm(found, axis=1)
        assert radius.max() < 10 * scale + 1
        assert len(found) == pytest.approx(4 / 3 * np.pi * (10 * scale) ** 3, rel=slack)


def test_labels_keep_their_values_when_turned():
    labels = (VALUES // 30).astype(np.uint8)
    turn = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]]) * 1.7
    found = vd.voxelize(vd.Volume(labels, labels=True).transformed(turn))
    assert set(found.parameters["value"]) == set(np.unique(labels)) - {0}


def test_what_is_missing_stays_dark():
    values = VALUES.copy()
    values[:, 2] = np.nan
    turn = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]])
    for body in (vd.Volume(values), vd.Volume(values).transformed(turn)):
        assert np.isfinite(vd.voxelize(body).parameters["value"]).all()
    assert not (vd.voxelize(vd.Volume(values)).voxels[:, 1] == 2).any()


def test_a_thousand_to_the_cube_takes_bounded_memory():
    body = vd.Volume(np.ones((2, 2, 2)), spacing=(1e6, 1e6, 1e6), threshold=2)
    assert not len(vd.voxelize(body, clip=(700, 700, 20)).voxels)


def test_a_model_shows_its_voxels():
    colors = np.arange(72, dtype=np.uint8).reshape(24, 3)
    found = vd.voxelize(vd.VoxelModel(CUBE, colors, offset=(5, 6, 7)))
    assert found.kind == "points"
    assert as_dict(found) == {
        tuple(voxel): tuple(color)
        for voxel, color in zip((CUBE + np.array([5, 6, 7])).tolist(), colors.tolist(), strict=True)
    }


def test_an_enlarged_model_is_made_of_boxes():
    found = vd.voxelize(vd.VoxelModel(CUBE).transformed(np.diag([2, 3, 1]), (1, 0, 0)))
    assert len(found.voxels) == len(CUBE) * 6
    assert found.voxels.min(axis=0).tolist() == [1, 0, 0]
    assert found.voxels.max(axis=0).tolist() == [8, 5, 2]


def test_nothing_of_a_reduced_model_vanishes():
    wall = np.argwhere(np.ones((1, 20, 20)))[:, ::-1]
    for scale in (0.9, 0.5, 0.31):
        found = vd.voxelize(vd.VoxelModel(wall).transformed(np.eye(3) * scale, (0.3, 0.2, 0.1)))
        sides = np.ptp(found.voxels, axis=0) + 1
        assert sides[2] == 1
        assert len(found.voxels) == sides[0] * sides[1]


def test_of_voxels_that_fall_into_one_the_nearest_gives_the_color():
    row = [(0, 0, 0), (1, 0, 0), (2, 0, 0)]
    colors = [(255, 0, 0), (0, 255, 0), (0, 0, 255)]
    third = np.eye(3) / 3
    for order in ([0, 1, 2], [1, 2, 0], [2, 0, 1]):
        body = vd.VoxelModel([row[i] for i in order], [colors[i] for i in order])
        found = vd.voxelize(body.transformed(third, (0, 1 / 3, 1 / 3)))
        assert found.colors.tolist() == [[0, 255, 0]]


def test_a_turned_model_has_no_holes():
    block = np.argwhere(np.ones((9, 9, 9)))[:, ::-1]
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    for scale in (0.7, 1.0, 1.4):
        found = vd.voxelize(vd.VoxelModel(block).transformed(turn * scale))
        assert len(found.voxels) >= (9 * scale) ** 3 * 0.98
        places = {tuple(voxel) for voxel in found.voxels.tolist()}
        inverse = np.linalg.inv(turn * scale)
        low, high = found.voxels.min(axis=0), found.voxels.max(axis=0)
        for voxel in itertools.product(*(range(a, b + 1) for a, b in zip(low, high, strict=True))):
            inner = inverse @ (np.array(voxel) + 0.5)
            if ((inner >= 0) & (inner < 9)).all():
                assert voxel in places


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: vd.VoxelModel(np.empty((0, 3), int)), "voxels"),
        (lambda: vd.VoxelModel([(0, 0, 1 << 40)]), "further"),
        (lambda: vd.VoxelModel([(0, 0, 0)], [(0, 0, 256)]), "colors"),
        (lambda: vd.VoxelModel([(0.5, 0, 0)]), "whole numbers"),
        (lambda: vd.Volume(np.zeros((3, 5))), "three axes"),
        (lambda: vd.Volume(VALUES, threshold=np.nan), "threshold"),
        (lambda: vd.Volume(VALUES).transformed(np.zeros((3, 3))), "determinant"),
    ],
)
def test_wrong_arguments_are_named(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_models_that_are_moved_alone_keep_their_voxels_and_order() -> None:
    voxels = np.array([(1, 2, 3), (4, 0, 6), (1, 2, 3)])
    colors = np.array([(9, 9, 9), (1, 2, 3), (4, 5, 6)], dtype=np.uint8)
    model = VoxelModel(voxels, colors, offset=(0.6, -0.4, 1))
    found = vd.voxelize(model, clip=(7, 7, 7))
    assert found.voxels.tolist() == [[2, 2, 4]]
    assert found.colors.tolist() == [[4, 5, 6]]  # of equal ones the last; one is outside
    assert model.colors is not colors
    with pytest.raises(ArgumentError, match="colors have the shape"):
        VoxelModel(voxels, colors[:2])

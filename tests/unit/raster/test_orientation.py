"""Orientations: their texts, and the same voxels in arrays, indices and rasters."""

import itertools

import numpy as np
import pytest

from voxdisplay.raster.grid import Grid
from voxdisplay.raster.orientation import UPRIGHT, Orientation

ALL = [
    Orientation.of([sign + axis for sign, axis in zip(signs, axes, strict=True)])
    for axes in itertools.permutations("xyz")
    for signs in itertools.product(("", "-"), repeat=3)
]
USER = Grid(3, 5, 7)


def test_texts_and_lists_name_the_same():
    wanted = Orientation((0, 2, 1), (False, True, False))
    assert Orientation.of("x,-z,y") == Orientation.of([" X", "-z", "+y "]) == wanted
    assert str(wanted) == "x,-z,y"
    assert Orientation.of("x,y,z") == UPRIGHT
    assert all(Orientation.of(str(each)) == each for each in ALL)


@pytest.mark.parametrize(
    ("axes", "message"),
    [
        ("x,-x,z", "x is named twice, and y is missing"),
        ("x,x,x", "x is named twice, and y, z is missing"),
        ("x,y", r"expected three, found 2 \(x, y\); write three axes"),
        ("x,y,w", "'w' is no axis"),
        ("", "expected three, found 1"),
        (["x", "y", "z", "x"], "expected three, found 4"),
    ],
)
def test_wrong_axes_are_explained(axes, message):
    with pytest.raises(ValueError, match=message):
        Orientation.of(axes)


@pytest.mark.parametrize("axes", [3, ["x", 1, "z"], None, {"x": 1}])
def test_other_kinds_are_no_axes(axes):
    with pytest.raises(TypeError, match="axes"):
        Orientation.of(axes)


def matrix_of(orientation):
    """Matrix from the user's directions to the memory's."""
    matrix = np.zeros((3, 3))
    for user, (axis, flips) in enumerate(zip(*orientation, strict=True)):
        matrix[axis, user] = -1 if flips else 1
    return matrix


def test_half_of_all_orientations_mirror_by_their_determinant():
    assert [each.mirrors for each in ALL] == [np.linalg.det(matrix_of(each)) < 0 for each in ALL]
    assert sum(each.mirrors for each in ALL) == 24


@pytest.mark.parametrize("orientation", ALL, ids=str)
def test_arrays_and_indices_go_to_the_same_voxels(orientation):
    memory = orientation.memory_grid(USER)
    assert orientation.user_grid(memory) == USER
    array = np.arange(USER.voxels * 2).reshape(*USER.array_shape, 2)
    turned = orientation.to_memory(array)
    assert turned.shape == (*memory.array_shape, 2)
    np.testing.assert_array_equal(orientation.to_user(turned), array)
    index = np.arange(USER.voxels)
    at = orientation.memory_index(index, USER)
    np.testing.assert_array_equal(turned.reshape(-1, 2)[at], array.reshape(-1, 2)[index])
    # Centres of voxels, about the middle of the grid, go where the matrix says.
    centred = USER.voxels_at(index) - (np.array(USER) - 1) / 2
    expected = centred @ matrix_of(orientation).T + (np.array(memory) - 1) / 2
    np.testing.assert_array_equal(memory.voxels_at(at), expected)

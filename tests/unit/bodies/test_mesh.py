"""Bodies of triangles: arguments, bounds, transforms."""

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.bodies.geometry import LitVoxels

TETRAHEDRON = [(1, 1, 1), (6, 1, 1), (1, 7, 1), (1, 1, 8)], [
    (0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3),
]  # fmt: skip


@pytest.mark.parametrize(
    ("faces", "message"),
    [
        ([(0, 1, 4)], r"faces\[0\]\[2\] is 4: indices are 0 to 3"),
        ([(0, 1, 2), (-1, 1, 2)], r"faces\[1\]\[0\] is -1"),
        ([(0, 1, 1.5)], "no whole number"),
        ([], "no triangle"),
        ([(0, 1)], r"shape \(1, 2\)"),
        (np.zeros((4, 4), dtype=int), r"shape \(4, 4\)"),
    ],
)
def test_wrong_faces(faces, message):
    with pytest.raises(vd.BodyError, match=message):
        vd.Mesh(TETRAHEDRON[0], faces)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e300])
def test_wrong_vertices(bad):
    with pytest.raises(vd.BodyError, match=r"vertices\[1\]\[2\] is"):
        vd.Mesh([(0, 0, 0), (1, 2, bad), (3, 3, 3)], [(0, 1, 2)])


def test_bounds_are_those_of_the_vertices_in_use():
    mesh = vd.Mesh([(1, 2, 3), (4, 5, 6), (7, 8, 10), (99, 99, 99)], [(0, 1, 2)])
    low, high = mesh.bounds()
    assert (low.tolist(), high.tolist()) == ([1, 2, 3], [7, 8, 10])


def test_a_flat_box_is_refused():
    with pytest.raises(vd.BodyError, match="same y as start"):
        vd.Box((1, 2, 3), (4, 2, 6))


def test_a_mirrored_mesh_is_still_oriented_outwards():
    mirrored = vd.Mesh(*TETRAHEDRON).transformed(np.diag([-1, 1, 1]), (9, 0, 0))
    a, b, c = (mirrored.vertices[mirrored.faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() > 0
    assert mirrored.bounds()[0].tolist() == [3, 1, 1]


def test_a_flattening_transform_is_refused():
    with pytest.raises(vd.BodyError, match="matrix flattens"):
        vd.Mesh(*TETRAHEDRON).transformed(np.diag([1, 1, 0]))


def test_lit_voxels_move_by_their_centres():
    turned = LitVoxels(np.array([(1, 2, 3)])).transformed(
        np.array([(0.0, -1, 0), (1, 0, 0), (0, 0, 1)]), np.array([9.0, 0, 0])
    )
    assert turned.voxels.tolist() == [[6, 1, 3]]

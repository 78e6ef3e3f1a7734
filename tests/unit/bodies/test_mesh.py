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


def test_too_many_triangles_are_refused_before_anything_is_copied():
    faces = np.broadcast_to(np.array([0, 1, 2]), (100_000_000, 3))
    with pytest.raises(vd.BodyError, match="has 100000000 triangles"):
        vd.Mesh(TETRAHEDRON[0], faces)


def star(count):
    angle = np.pi * np.arange(2 * count) / count
    radius = np.where(np.arange(2 * count) % 2, 7.0, 18.0)
    return np.stack((20 + radius * np.cos(angle), 20 + radius * np.sin(angle)), axis=1)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("axis", range(3))
def test_a_polygon_covers_what_is_inside_of_its_ring(axis, turned):
    ring = star(9)
    points = np.insert(ring, axis, 5.0, axis=1)
    polygon = vd.Polygon(points[::-1] if turned else points)
    found = np.delete(vd.voxelize(polygon).voxels, axis, axis=1)
    x, y = np.indices((40, 40)) + 0.5
    inside = np.zeros((40, 40), dtype=bool)
    for (ax, ay), (bx, by) in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        inside ^= ((ay > y) != (by > y)) & (x < (bx - ax) * (y - ay) / (by - ay) + ax)
    lit = np.zeros((40, 40), dtype=bool)
    lit[found[:, 0], found[:, 1]] = True
    assert lit[inside].all()
    near = np.zeros_like(inside)
    for shift in np.ndindex(3, 3):
        near |= np.roll(inside, np.array(shift) - 1, axis=(0, 1))
    # The tips are thinner than a voxel.
    assert np.count_nonzero(lit & ~near) <= 9


def test_a_polygon_has_no_more_triangles_than_corners():
    ring = [(0, 0, 1), (4, 0, 1), (8, 0, 1), (8, 8, 1), (4, 2, 1), (0, 8, 1)]  # one on a side
    assert len(vd.Polygon(ring)._mesh.faces) == 4


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([(0, 0, 0), (4, 4, 0), (4, 0, 0), (0, 4, 0)], "enclose nothing|cross each other"),
        ([(0, 0, 0), (9, 0, 0), (9, 9, 0), (4, -3, 0)], "cross each other"),
        ([(0, 0, 0), (4, 0, 0), (4, 4, 1), (0, 4, 0)], r"points\[\d\] is 0.\d+ voxels away"),
        ([(0, 0, 0), (1, 1, 1), (2, 2, 2)], "on one line"),
        ([(0, 0, 0), (1, 1, 1)], "has 2 points"),
    ],
)
def test_wrong_polygons(points, message):
    with pytest.raises(vd.BodyError, match=message):
        vd.Polygon(points)


@pytest.mark.parametrize(
    "body",
    [
        vd.Triangle([(1, 1, 1), (2, 4, 1), (1, 3, 6)]),
        vd.Polygon([(0, 0, 1), (2, 0, 1), (2, 4, 1), (0, 4, 1)]),
    ],
    ids=["triangle", "polygon"],
)
def test_what_is_flat_by_nature_is_not_called_open(body):
    assert vd.voxelize(body).notes == ()

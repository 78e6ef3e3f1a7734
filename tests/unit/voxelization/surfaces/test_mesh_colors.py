"""Colours and parameters of meshes: interpolated at the point nearest to each voxel's centre."""

import numpy as np
import pytest

import voxdisplay as vd

# A square at z = 2.4 over 8 x 8 voxels.
SQUARE = [(0, 0, 2.4), (8, 0, 2.4), (8, 8, 2.4), (0, 8, 2.4)]
FACES = [(0, 1, 2), (0, 2, 3)]


def draw(faces=FACES, fill="shell", clip=(8, 8, 5), **named):
    return vd.voxelize(vd.Mesh(SQUARE, faces, fill=fill, **named), clip=clip)


@pytest.mark.parametrize("faces", [FACES, [face[::-1] for face in FACES]])
def test_vertex_colors_and_parameters_are_those_of_the_centre(faces):
    found = draw(
        faces,
        vertex_colors=[(0, 0, 9), (160, 0, 9), (160, 80, 9), (0, 80, 9)],
        parameters={"u": [0, 8, 8, 0]},
    )
    x, y, _ = found.voxels.T
    assert len(found) == 64
    assert found.colors.tolist() == [
        [20 * i + 10, 10 * j + 5, 9] for i, j in zip(x, y, strict=True)
    ]
    np.testing.assert_allclose(found.parameters["u"], x + 0.5, atol=1e-12)


def test_face_colors_belong_to_the_lowest_triangle_at_an_edge():
    found = draw(face_colors=[(255, 0, 0), (0, 0, 255)])
    for (x, y, _), color in zip(found.voxels.tolist(), found.colors.tolist(), strict=True):
        assert color == ([255, 0, 0] if x >= y else [0, 0, 255])


def test_a_texture_is_read_at_the_voxels_centres():
    image = np.random.default_rng(1).integers(0, 256, (8, 8, 3)).astype(np.uint8)
    found = draw(uv=[(0, 0), (1, 0), (1, 1), (0, 1)], texture=image)
    x, y, _ = found.voxels.T
    assert np.array_equal(found.colors, image[7 - y, x])


def test_a_texture_repeats_and_colors_multiply():
    image = np.zeros((1, 2, 3), dtype=np.uint8)
    image[0, 1] = 255
    found = draw(
        uv=[(0, 0), (4, 0), (4, 1), (0, 1)],
        texture=[image],
        face_colors=[(51, 102, 255)] * 2,
        face_textures=[0, -1],
    )
    lower = found.voxels[:, 0] > found.voxels[:, 1]
    expected = [[51, 102, 255] if x % 2 else [0, 0, 0] for x in found.voxels[lower, 0]]
    assert found.colors[lower].tolist() == expected
    assert (found.colors[found.voxels[:, 0] < found.voxels[:, 1]] == (51, 102, 255)).all()


def test_voxels_of_thin_parts_have_colors():
    needle = vd.Mesh(
        [(1.1, 1.1, 0.5), (1.2, 1.1, 0.5), (1.1, 1.2, 20.5)],
        [(0, 1, 2)],
        vertex_colors=[(0, 0, 0), (0, 0, 0), (200, 200, 200)],
    )
    found = vd.voxelize(needle)
    z = found.voxels[:, 2]
    assert len(found) >= 20
    assert np.abs(found.colors[:, 0].astype(int) - 10 * z).max() <= 5


def test_a_solid_takes_the_color_of_the_surface_above_or_below():
    low, high = np.array([(1, 1, 1), (7, 7, 9)])
    box = vd.Box(low, high)._mesh
    colors = np.where(box.vertices[:, 2:] > 5, 200, 100) * np.ones(3)
    found = vd.voxelize(vd.Mesh(box.vertices, box.faces, vertex_colors=colors, fill="solid"))
    inner = ((found.voxels[:, :2] > 1) & (found.voxels[:, :2] < 6)).all(axis=1)
    z = found.voxels[inner, 2]
    assert ((found.colors[inner, 0] > 150) == (z > 4)).all()
    assert len(found) == 6 * 6 * 8 == len(found.colors)


def test_colors_survive_clipping_and_doubled_triangles():
    faces = [FACES[0], FACES[0], FACES[1]]
    found = draw(faces, face_colors=[(9, 9, 9), (8, 8, 8), (7, 7, 7)], clip=(5, 5, 3))
    assert found.box.sides == (5, 5, 3)
    assert len(found) == 25
    assert set(found.colors[:, 0].tolist()) == {9, 7}


def test_a_frame_shows_the_colors_of_a_mesh_unless_another_is_given():
    frame = vd.Frame((8, 8, 5))
    mesh = vd.Mesh(SQUARE, FACES, face_colors=[(255, 0, 0), (0, 0, 255)])
    frame.draw(mesh)
    assert frame.rgb()[2, 0, 7].tolist() == [255, 0, 0]
    assert frame.rgb()[2, 7, 0].tolist() == [0, 0, 255]
    frame.draw(mesh, "lime")
    assert frame.rgb()[2, 7, 0].tolist() == [0, 255, 0]

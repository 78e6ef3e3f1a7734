"""Figures of voxel sets: right where they are known, and bad for bad sets."""

import dataclasses
import json

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.cli import main
from voxdisplay.voxelization.flood_fill import count_enclosed
from voxdisplay.voxelization.measure_mesh import mesh_cover, mesh_distances, mesh_tunnels
from voxdisplay.voxelization.smallest_cover import MAX_LINES, smallest_cover

BOX = vd.Box((1.25, 1.5, 2), (9, 8, 9.75))
CLIP = (11, 10, 12)


def test_a_box():
    report = vd.voxelize(vd.Box((1, 1, 2), (9, 8, 9)), clip=CLIP).report
    assert (report.kind, report.voxels) == ("surface", 8 * 7 * 7 - 6 * 5 * 5)
    assert (report.e_max, report.e_av) == pytest.approx((0.5, 0.5))
    assert (report.tunnels, report.enclosed) == (0, 6 * 5 * 5)
    assert report.cover == pytest.approx(0.5)


def test_a_solid_is_judged_by_its_outer_layer():
    report = vd.voxelize(vd.Box((1, 1, 2), (9, 8, 9), fill="solid"), clip=CLIP).report
    assert (report.kind, report.voxels, report.tunnels) == ("solid", 8 * 7 * 7, 0)
    assert (report.e_max, report.enclosed) == (pytest.approx(0.5), 0)


@pytest.mark.parametrize(
    "body",
    [
        vd.Sphere((10, 10, 10), 7.3),
        vd.Ellipsoid((10, 10, 10), (8, 5, 6)),
        vd.Cylinder((4, 4, 4), (14, 12, 15), 3.5),
        vd.Cone((4, 4, 4), (14, 12, 15), 5),
        vd.Disc((10, 10, 10), 7, (1, 2, 3)),
        vd.Implicit("x**2 + y**2 + (z - 10)**2 - 90", box=((-10, -10, 0), (10, 10, 20))),
        vd.HeightField("10 + 3*sin(x/3)*cos(y/4)", x=(0, 19), y=(1, 18)),
    ],
    ids=lambda body: type(body).__name__,
)
def test_other_bodies(body):
    report = vd.voxelize(body).report
    assert 0.25 < report.e_max <= 0.501
    assert 0.1 < report.e_av < 0.3
    assert report.tunnels == 0


def test_a_missing_voxel_is_a_tunnel_and_a_voxel_too_many_an_error():
    found = vd.voxelize(BOX, clip=CLIP)
    mesh, voxels = BOX._mesh, found.voxels
    args = mesh.vertices, mesh.faces
    assert mesh_tunnels(voxels, *args, found.box) == 0
    middle = np.flatnonzero((voxels[:, :2] == (5, 4)).all(axis=1))
    holed = np.delete(voxels, middle[0], axis=0)
    assert mesh_tunnels(holed, *args, found.box) == 1
    assert count_enclosed(holed) == 0 < count_enclosed(voxels)
    assert mesh_distances(voxels, *args).max() <= 0.5
    assert mesh_distances(np.append(voxels, [(5, 4, 5)], axis=0), *args)[-1] == np.inf
    assert mesh_distances(np.append(voxels, [(5, 4, 3)], axis=0), *args)[-1] == 1.5
    near = np.delete(voxels, np.flatnonzero(np.abs(voxels - (5, 4, 2)).max(axis=1) <= 1), axis=0)
    assert mesh_cover(near, *args) > 1


def test_distances_are_those_of_points_from_triangles():
    chance = np.random.default_rng(5)
    vertices = chance.uniform(2, 8, (9, 3))
    faces = np.arange(9).reshape(3, 3)
    voxels = np.array(list(np.ndindex(10, 10, 10)))
    found = mesh_distances(voxels, vertices, faces)
    i, j = np.indices((201, 201)).reshape(2, -1) / 200
    weights = np.stack((i, j, 1 - i - j))[:, i + j <= 1]
    points = np.einsum("fcx,cp->fpx", vertices[faces], weights).reshape(-1, 3)
    for voxel, distance in zip(voxels[::37], found[::37], strict=True):
        expected = np.sqrt(((points - voxel - 0.5) ** 2).sum(axis=1).min())
        assert distance == (pytest.approx(expected, abs=2e-3) if distance < np.inf else np.inf)
        assert (distance < np.inf) == (expected <= 1.5) or abs(expected - 1.5) < 2e-3


def test_what_a_snake_of_dark_voxels_reaches_is_not_enclosed():
    lit = np.ones((9, 8, 7), dtype=bool)
    path = [(0, 4, 3), (1, 4, 3), (2, 4, 3), (2, 5, 3), (2, 6, 3), (3, 6, 3), (3, 6, 4), (4, 6, 4)]
    for voxel in path:
        lit[voxel] = False
    lit[6, 2, 2] = lit[6, 3, 2] = False
    assert count_enclosed(np.argwhere(lit)) == 2
    assert count_enclosed(np.empty((0, 3), dtype=int)) == 0


def matching(even, odd):
    """The size of the largest matching, by one augmenting path after the other."""
    others, mate = {}, {}
    for one, other in zip(even, odd, strict=True):
        others.setdefault(one, []).append(other)

    def augment(one, seen):
        for other in set(others[one]) - seen:
            seen.add(other)
            if other not in mate or augment(mate[other], seen):
                mate[other] = one
                return True
        return False

    return sum(augment(one, set()) for one in others)


def test_the_smallest_cover_is_as_large_as_the_largest_matching():
    chance = np.random.default_rng(0)
    for _ in range(200):
        count, size = chance.integers(0, 40), chance.integers(2, 14)
        even, odd = chance.integers(0, size, (2, count))
        assert smallest_cover(even, odd) == matching(even.tolist(), odd.tolist())
    assert smallest_cover(*np.zeros((2, MAX_LINES + 1), dtype=np.int64)) is None


def test_shells_are_nearly_as_thin_as_can_be():
    flat = vd.voxelize(vd.Mesh([(0, 0, 3.2), (9, 0, 3.2), (9, 9, 3.2)], [(0, 1, 2)]), clip=CLIP)
    assert (flat.report.minimum, flat.report.thickness) == (len(flat), 1)
    u, v = np.meshgrid(np.linspace(0, np.pi, 40), np.linspace(0, 2 * np.pi, 80, endpoint=False))
    points = np.stack((np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)), axis=-1)
    i, j = np.indices((80, 39)).reshape(2, -1)
    a, b, c, d = i * 40 + j, i * 40 + j + 1, (i + 1) % 80 * 40 + j + 1, (i + 1) % 80 * 40 + j
    faces = np.concatenate((np.stack((a, b, c), axis=1), np.stack((a, c, d), axis=1)))
    ball = vd.voxelize(vd.Mesh(points.reshape(-1, 3) * 12 + 14, faces), clip=(28, 28, 28))
    assert 1 < ball.report.thickness < 1.1
    assert vd.voxelize(BOX, clip=CLIP).report.thickness == 1


def test_points_and_empty_sets_have_no_distances():
    scatter = vd.voxelize(vd.Scatter([(1, 1, 1), (5, 5, 5)]), clip=(9, 9, 9)).report
    assert (scatter.kind, scatter.e_max, scatter.tunnels) == ("points", None, None)
    empty = vd.voxelize(vd.Box((20, 20, 20), (30, 30, 30)), clip=(9, 9, 9)).report
    assert (empty.voxels, empty.e_max, empty.tunnels, empty.enclosed) == (0, None, 0, 0)


def test_the_command_prints_the_figures(tmp_path, capsys):
    scene = tmp_path / "scene.json"

    def voxelize(*options):
        assert main(["voxelize", str(scene), "--json", *options]) == 0
        said = capsys.readouterr()
        (facts,) = json.loads(said.out)["objects"]
        return facts, said.err

    scene.write_text('{"size": [20, 20, 20], "objects": [{"type": "sphere", "center": [10, 10, 10],'
                     ' "radius": 7}]}')  # fmt: skip
    facts, _ = voxelize()
    assert (facts["kind"], facts["tunnels"]) == ("surface", 0)
    assert 0 < facts["e_av"] < facts["e_max"] <= 0.5
    assert facts["enclosed"] > 0
    assert facts["certified"] is False
    facts, said = voxelize("--certified")
    assert facts["certified"] is True
    assert "certified" not in said
    scene.write_text('{"type": "height_field", "z": "5 + 9*exp(-900*((x - 4.3)**2 + y**2))", '
                     '"x": [0, 9], "y": [-5, 5]}')  # fmt: skip
    facts, said = voxelize("--certified")
    assert facts["certified"] is False
    assert "not proven" in facts["notes"][0]
    assert "object 0 (height_field) is not certified: not proven: " in said
    assert dataclasses.is_dataclass(vd.voxelize(BOX).report)


WAVES = "6 + 3*sin(x/3)*cos(y/4)"


@pytest.mark.parametrize(
    ("body", "is_proven"),
    [
        (BOX, True),
        (vd.Sphere((6, 6, 6), 4), True),
        (vd.Cylinder((4, 4, 4), (4, 4, 8), 0.5), True),
        (vd.Scatter([(1, 1, 1)]), True),
        (vd.Torus((6, 6, 6), 3, 1), True),
        (vd.Implicit("x**2 + y**2 + (z - 10)**2 - 90"), True),
        (vd.Implicit(lambda x, y, z: x + y - z), False),
        (vd.Surface("u", "v", "6 + sin(u)", u=(0, 9), v=(0, 9)), True),
        (vd.Surface(lambda u, v: (u, v, u), u=(0, 9), v=(0, 9)), False),
        (vd.HeightField(WAVES, x=(0.3, 9), y=(0, 9.8)), True),
        (vd.HeightField(WAVES, x=(0, 9), y=(0, 9)).transformed(-np.eye(3), (9, 9, 9)), True),
        (vd.HeightField("x + 3*floor(y/3)", x=(0, 9), y=(0, 9)), False),
        (vd.HeightField(lambda x, y: x + y, x=(0, 9), y=(0, 9)), False),
        (vd.HeightField("x", x=(80, 90), y=(0, 9)), True),
    ],
    ids=repr,
)
def test_certified_means_asked_for_and_proven(body, is_proven):
    found = vd.voxelize(body, clip=CLIP, certified=True)
    assert found.certified is found.report.certified is is_proven
    assert is_proven or any("proven" in note for note in found.notes)
    assert not vd.voxelize(body, clip=CLIP).certified


def test_certified_bodies_are_in_boxes_that_hold_them():
    needle = "5 + 9*exp(-900*((u - 4.3)**2 + (v - 0.21)**2))"
    surface = vd.Surface("u", "v", needle, u=(0, 9), v=(-5, 5))
    field = vd.HeightField(needle.replace("u", "x").replace("v", "y"), x=(0, 9), y=(-5, 5))
    for body, top in ((surface, 12), (field, 13), (field.transformed(np.eye(3)), 13)):
        assert body.bounds()[1][2] < top <= body.proven_bounds()[1][2]
    assert vd.voxelize(surface, certified=True).voxels[:, 2].max() == 13
    pole = vd.HeightField("1/x", x=(-1, 1), y=(0, 3))
    assert np.equal(pole.bounds(), pole.proven_bounds()).all()

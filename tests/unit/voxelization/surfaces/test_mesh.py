"""Voxels of meshes: equal to the rules in rational numbers, and to themselves under symmetries."""

import itertools
import random
from contextlib import contextmanager
from fractions import Fraction

import mesh_reference as reference
import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.compute import kernel_backend

SIDES = (7, 6, 5)


def voxels(vertices, faces, fill="shell", clip=SIDES):
    mesh = vd.Mesh(np.array(vertices, dtype=float), faces, fill=fill)
    return set(map(tuple, vd.voxelize(mesh, clip=clip).voxels.tolist()))


def lattice_meshes(count, seed, **options):
    chance = random.Random(seed)
    for _ in range(count):
        yield reference.random_closed_mesh(chance, **options)


def inside(found, sides=SIDES):
    return {
        voxel for voxel in found if all(0 <= k < side for k, side in zip(voxel, sides, strict=True))
    }


def tube(count=60, around=12, radius=0.45, turns=3):
    """A closed tube about a torus knot, in a cube of side 1."""
    t = 2 * np.pi * np.arange(count * turns) / (count * turns)
    q = 2 + np.cos(3 * t)
    spine = np.stack((q * np.cos(2 * t), q * np.sin(2 * t), -np.sin(3 * t)), axis=1)
    along = np.roll(spine, -1, axis=0) - np.roll(spine, 1, axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    up = np.cross(along, np.stack((np.cos(2 * t), np.sin(2 * t), np.zeros_like(t)), axis=1))
    up /= np.linalg.norm(up, axis=1)[:, None]
    side = np.cross(along, up)
    s = 2 * np.pi * np.arange(around)[:, None] / around
    points = spine[:, None] + radius * (np.cos(s) * up[:, None] + np.sin(s) * side[:, None])
    n, m = len(t), around
    i, j = np.indices((n, m)).reshape(2, -1)
    a, b = i * m + j, (i + 1) % n * m + j
    c, d = (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
    faces = np.concatenate((np.stack((a, b, c), axis=1), np.stack((a, c, d), axis=1)))
    points = points.reshape(-1, 3)
    low, high = points.min(axis=0), points.max(axis=0)
    return (points - (low + high) / 2) / (high - low).max() + 0.5, faces


def ball(count=20):
    """A closed sphere of diameter 1, in a cube of side 1."""
    u, v = np.pi * np.arange(1, count) / count, 2 * np.pi * np.arange(2 * count) / (2 * count)
    u, v = np.meshgrid(u, v, indexing="ij")
    ring = np.stack((np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)), axis=-1)
    points = np.concatenate((ring.reshape(-1, 3), [(0, 0, 1), (0, 0, -1)])) / 2 + 0.5
    n, m = count - 1, 2 * count
    faces = []
    for j in range(m):
        k = (j + 1) % m
        faces += [(n * m, j, k), (n * m + 1, (n - 1) * m + k, (n - 1) * m + j)]
        for i in range(n - 1):
            faces += [(i * m + j, (i + 1) * m + j, (i + 1) * m + k)]
            faces += [(i * m + j, (i + 1) * m + k, i * m + k)]
    return points, np.array(faces)


@pytest.mark.parametrize("seed", range(6))
def test_shells_are_those_of_the_rules_in_rational_numbers(seed):
    for vertices, faces in lattice_meshes(6, seed):
        _, expected = reference.reference_shell(vertices, faces, SIDES)
        assert voxels(vertices, faces) == inside(expected)


@pytest.mark.parametrize("seed", range(4))
def test_open_shells_are_those_of_the_rules_in_rational_numbers(seed):
    chance = random.Random(100 + seed)
    for vertices, faces in lattice_meshes(6, seed):
        part = chance.sample(faces, len(faces) // 2)
        _, expected = reference.reference_shell(vertices, part, SIDES)
        assert voxels(vertices, part) == inside(expected)


@pytest.mark.parametrize("seed", range(4))
def test_solids_are_those_of_the_winding_number(seed):
    for vertices, faces in lattice_meshes(4, seed):
        expected = {
            voxel
            for voxel in itertools.product(*map(range, SIDES))
            if reference.winding(vertices, faces, voxel)
        }
        assert voxels(vertices, faces, "solid") == expected


@pytest.mark.parametrize("seed", range(3))
def test_no_path_of_dark_voxels_leads_through(seed):
    for vertices, faces in lattice_meshes(4, 50 + seed, thin=0):
        lit = voxels(vertices, faces)
        number = {
            voxel: reference.winding(vertices, faces, voxel)
            for voxel in set(itertools.product(*map(range, SIDES))) - lit
        }
        for voxel, own in number.items():
            for step in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
                other = tuple(a + b for a, b in zip(voxel, step, strict=True))
                assert number.get(other, own) == own


def permuted(points, order):
    return [tuple(point[k] for k in order) for point in points]


@pytest.mark.parametrize("order", list(itertools.permutations(range(3)))[1:])
def test_permuted_axes_permute_the_voxels(order):
    odd = order in {(0, 2, 1), (1, 0, 2), (2, 1, 0)}
    for vertices, faces in lattice_meshes(40, 7):
        turned = [face[::-1] for face in faces] if odd else faces
        sides = tuple(SIDES[k] for k in order)
        found = voxels(permuted(vertices, order), turned, clip=sides)
        assert found == set(permuted(voxels(vertices, faces), order))


@pytest.mark.parametrize("axis", range(3))
def test_mirrored_meshes_have_mirrored_voxels(axis):
    for vertices, faces in lattice_meshes(80, 8):
        mirrored = [
            tuple(SIDES[k] - c if k == axis else c for k, c in enumerate(point))
            for point in vertices
        ]
        found = voxels(mirrored, [face[::-1] for face in faces])
        expected = {
            tuple(SIDES[k] - 1 - c if k == axis else c for k, c in enumerate(voxel))
            for voxel in voxels(vertices, faces)
        }
        assert found == expected or not reference.volume_sign(reference.corners_of(vertices, faces))


@pytest.mark.parametrize("fill", ["shell", "solid"])
def test_meshes_moved_by_whole_voxels_have_moved_voxels(fill):
    for vertices, faces in lattice_meshes(40, 9):
        whole = vd.Mesh(np.array(vertices, dtype=float), faces, fill=fill)
        there = vd.voxelize(whole.transformed(np.eye(3), (300, -200, 1000))).voxels
        assert (there - (300, -200, 1000)).tolist() == vd.voxelize(whole).voxels.tolist()
        assert set(map(tuple, vd.voxelize(whole).voxels.tolist())) & set(
            itertools.product(*map(range, SIDES))
        ) == inside(voxels(vertices, faces, fill, clip=(8, 8, 8)))


@pytest.mark.parametrize("fill", ["shell", "solid"])
def test_split_and_shuffled_triangles_have_the_same_voxels(fill):
    chance = random.Random(10)
    for vertices, faces in lattice_meshes(40, 10):
        points, parts = list(vertices), []
        for a, b, c in faces:
            shares = [Fraction(chance.randrange(9), 8) for _ in range(2)]
            p, q, r = (points[k] for k in (a, b, c))
            points.append(
                tuple(
                    x + shares[0] * (y - x) + (1 - shares[0]) * shares[1] * (z - x)
                    for x, y, z in zip(p, q, r, strict=True)
                )
            )
            new = len(points) - 1
            parts += [(a, b, new), (b, c, new), (c, a, new)]
        chance.shuffle(parts)
        assert voxels(points, parts, fill) == voxels(vertices, faces, fill)


def test_a_soup_of_triangles_is_the_same_as_a_mesh_with_shared_vertices():
    points, faces = tube()
    soup = vd.Mesh(points[faces].reshape(-1, 3) * 40, np.arange(3 * len(faces)).reshape(-1, 3))
    found, mesh = vd.voxelize(soup), vd.voxelize(vd.Mesh(points * 40, faces))
    assert found.notes == mesh.notes == ()
    assert np.array_equal(found.voxels, mesh.voxels)


def test_the_shell_of_a_box_on_voxels_is_the_outer_layer_of_its_solid():
    shell = vd.voxelize(vd.Box((4, 4, 4), (28, 28, 28)), clip=(32, 32, 32)).voxels
    solid = vd.voxelize(vd.Box((4, 4, 4), (28, 28, 28), fill="solid"), clip=(32, 32, 32)).voxels
    assert len(shell) == 3176
    assert len(solid) == 24**3
    outer = solid[((solid == 4) | (solid == 27)).any(axis=1)]
    assert np.array_equal(shell, outer)


def test_a_silhouette_on_a_voxels_face_lights_both_sides_of_it():
    # A wedge upon the plane z = 3, whose slanted side begins at the mid-line x = 1.5.
    points = [(x, y, z) for y in (1, 4) for x, z in ((1.5, 3), (4.5, 3), (4.5, 4.5))]
    faces = [(0, 1, 2), (3, 5, 4), (0, 3, 4), (0, 4, 1), (1, 4, 5), (1, 5, 2), (0, 2, 5), (0, 5, 3)]
    found = voxels(points, faces)
    assert {voxel for voxel in found if voxel[2] < 3} == {(1, y, 2) for y in (1, 2, 3)}
    assert {(1, y, 3) for y in (1, 2, 3)} <= found


def test_a_box_that_fills_the_grid_loses_nothing():
    shell = vd.voxelize(vd.Box((0, 0, 0), SIDES), clip=SIDES).voxels
    assert len(shell) == 7 * 6 * 5 - 5 * 4 * 3


@pytest.mark.parametrize("axis", range(3))
def test_an_open_surface_on_a_voxels_face_lights_the_upper_one_but_at_the_upper_wall(axis):
    corners = [(0, 0), (9, 0), (9, 9), (0, 9)]
    for level, lit in ((0, 0), (3, 3), (SIDES[axis], SIDES[axis] - 1)):
        points = [tuple(np.insert(np.array(corner), axis, level)) for corner in corners]
        found = voxels(points, [(0, 1, 2), (0, 2, 3)])
        assert {voxel[axis] for voxel in found} == {lit}
        assert len(found) == 7 * 6 * 5 // SIDES[axis]


def test_boxes_that_tile_space_have_voxels_that_tile():
    chance = np.random.default_rng(3)
    for _ in range(10):
        cuts = [np.sort(np.append(chance.integers(0, 25, 3) / 2, (-1, 13))) for _ in range(3)]
        count = np.zeros((12, 12, 12), dtype=int)
        for cell in itertools.product(range(4), repeat=3):
            low = [cuts[k][cell[k]] for k in range(3)]
            high = [cuts[k][cell[k] + 1] for k in range(3)]
            if all(a < b for a, b in zip(low, high, strict=True)):
                x, y, z = vd.voxelize(vd.Box(low, high, fill="solid"), clip=(12, 12, 12)).voxels.T
                count[z, y, x] += 1
        assert (count == 1).all()


def test_thin_tubes_stay_in_one_piece():
    points, faces = tube(radius=0.02)
    found = vd.voxelize(vd.Mesh(points * 40, faces)).voxels
    lit = set(map(tuple, found.tolist()))
    todo, reached = [next(iter(lit))], {next(iter(lit))}
    while todo:
        x, y, z = todo.pop()
        for dx, dy, dz in itertools.product((-1, 0, 1), repeat=3):
            other = x + dx, y + dy, z + dz
            if other in lit and other not in reached:
                reached.add(other)
                todo.append(other)
    assert reached == lit
    near = np.abs((points * 40)[:, None] - (found + 0.5)[None]).max(axis=2).min(axis=1)
    assert near.max() <= 1


def test_what_is_inside_one_voxel_lights_one():
    for low, size in (((3.2, 4.3, 2.1), 0.1), ((3.6, 4.6, 2.6), 0.2), ((3.9, 4.9, 2.9), 0.15)):
        high = tuple(c + size for c in low)
        middle = tuple(int(c + size / 2) for c in low)
        assert vd.voxelize(vd.Box(low, high), clip=(8, 8, 8)).voxels.tolist() == [list(middle)]


def test_clipping_leaves_out_what_is_outside_and_changes_nothing_else():
    for vertices, faces in lattice_meshes(40, 12, thin=0.6):
        whole = vd.voxelize(vd.Mesh(np.array(vertices, dtype=float) + 2, faces)).voxels - 2
        kept = set(map(tuple, whole[((whole >= 0) & (whole < (5, 4, 3))).all(axis=1)].tolist()))
        assert voxels(vertices, faces, clip=(5, 4, 3)) == kept


def broken(faces, kind, chance):
    faces = np.array(faces)
    if kind == "flipped":
        rows = chance.random(len(faces)) < 0.1
        faces[rows] = faces[rows][:, ::-1]
    elif kind == "doubled":
        faces = np.concatenate((faces, faces[chance.random(len(faces)) < 0.05]))
    elif kind == "two-sided":
        faces = np.concatenate((faces, faces[:, ::-1]))
    elif kind == "missing":
        faces = faces[chance.random(len(faces)) >= 0.01]
    return chance.permutation(faces)


@pytest.mark.parametrize("shape", [tube, ball])
@pytest.mark.parametrize(
    ("kind", "note", "limit"),
    [
        ("flipped", "do not agree on an outside", 0),
        ("doubled", "occur more than once", 0),
        ("two-sided", "occur more than once", 0),
        ("missing", "open edges", 1e-3),
    ],
)
def test_solids_of_broken_meshes(shape, kind, note, limit):
    points, faces = shape(60)
    expected = vd.voxelize(vd.Mesh(points * 64, faces, fill="solid"), clip=(64, 64, 64))
    for seed in range(5):
        mesh = vd.Mesh(points * 64, broken(faces, kind, np.random.default_rng(seed)), fill="solid")
        found = vd.voxelize(mesh, clip=(64, 64, 64))
        assert any(note in each for each in found.notes)
        wrong = np.setxor1d(found.index, expected.index)
        assert len(wrong) <= limit * len(expected)


def test_a_large_box_is_kept_in_bricks_and_has_the_same_voxels():
    points, faces = tube()
    mesh = vd.Mesh(points * 60 + 5, faces)
    small, large = vd.voxelize(mesh, clip=(70, 70, 70)), vd.voxelize(mesh, clip=(900, 800, 700))
    assert np.array_equal(small.voxels, large.voxels)


def test_far_vertices_are_refused():
    with pytest.raises(vd.BodyError, match=r"vertex 2 at \(0, 0, 20000\) is more than"):
        vd.voxelize(vd.Mesh([(0, 0, 0), (1, 0, 0), (0, 0, 2e4)], [(0, 1, 2)]), clip=SIDES)


def test_triangles_without_an_area_light_nothing():
    assert not voxels([(1, 1, 1), (4, 4, 4), (2, 2, 2)], [(0, 1, 2)])


@contextmanager
def kernels(choice):
    before = kernel_backend.set_enabled(choice)
    try:
        yield
    finally:
        kernel_backend.set_enabled(before)


def same_compiled(mesh, clip):
    with kernels(False):
        plain = vd.voxelize(mesh, clip=clip)
    with kernels(True):
        fast = vd.voxelize(mesh, clip=clip)
    assert plain.index.tobytes() == fast.index.tobytes()
    assert plain.notes == fast.notes


@pytest.mark.parametrize("fill", ["shell", "solid"])
def test_compiled_kernels_light_the_same_voxels(fill):
    pytest.importorskip("numba")
    for vertices, faces in lattice_meshes(60, 20):
        points = np.array(vertices, dtype=float)
        same_compiled(vd.Mesh(points, faces, fill=fill), SIDES)
        same_compiled(vd.Mesh(points, faces[::2], fill=fill), SIDES)
    for points, faces in (tube(), tube(radius=0.02), ball()):
        for size, clip in ((3, (2, 3, 2)), (40, (41, 39, 43)), (300, (700, 300, 301))):
            same_compiled(vd.Mesh(points * size, faces, fill=fill), clip)
            turned = points @ np.array([(0.6, 0.8, 0), (-0.8, 0.6, 0), (0, 0, 1)])
            same_compiled(vd.Mesh(turned * size + 0.5, faces, fill=fill), clip)

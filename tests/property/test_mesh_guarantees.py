"""Guarantees of the voxels of random meshes, judged by what shares no code with their voxeliser."""

import itertools
from importlib.util import find_spec

import numpy as np
import pytest
from random_meshes import SIDES, RandomMesh, random_mesh

import voxdisplay as vd
from voxdisplay.compute import kernel_backend
from voxdisplay.voxelization.measure_mesh import mesh_cover, mesh_distances, mesh_tunnels
from voxdisplay.voxelization.surfaces import mesh as mesh_voxeliser

# Voxels of triangles, and those of thin parts: nearest corners of dual faces and of dual cells.
ERROR, THIN_ERROR = 0.5 + 2**-15, 0.8661
COVER = 1 + 2**-15
FEW, MANY, CHUNKS = 42, 1000, 20
ORDERS = list(itertools.permutations(range(3)))[1:]
WITHOUT = [False, True] if find_spec("numba") else [False]


def voxels(mesh: RandomMesh, clip=SIDES, fill="shell"):
    body = vd.Mesh(mesh.vertices, mesh.faces, fill=fill)
    return vd.voxelize(body, clip=clip)


def key_of(points):
    return {tuple(voxel) for voxel in points.tolist()}


def key(found):
    return key_of(found.voxels)


@pytest.fixture(autouse=True)
def _numpy_alone():
    before = kernel_backend.set_enabled(False)
    yield
    kernel_backend.set_enabled(before)


def check(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = random_mesh(seed)
    chance = np.random.default_rng(seed + 1_000_000)
    found = voxels(mesh)
    check_distances(mesh, found, monkeypatch)
    for fill in ("shell", "solid"):
        check_compiled(mesh, fill)
    plain = key(found)
    order = ORDERS[seed % 5]
    turned = mesh.moved(mesh.vertices[:, order], turned=order in {(0, 2, 1), (1, 0, 2), (2, 1, 0)})
    expected = {tuple(voxel[k] for k in order) for voxel in plain}
    assert key(voxels(turned, tuple(SIDES[k] for k in order))) == expected, (seed, "permuted")
    if mesh.closed:
        check_mirrored(mesh, plain, seed % 3)
    check_shifted(mesh, chance.integers(-4, 5, 3))
    parts = mesh.split(chance)
    if mesh.kind == "smooth" or not (has_doubles(mesh) or has_doubles(parts)):
        assert key(voxels(parts)) == plain, (seed, "split")


def check_distances(mesh: RandomMesh, found, monkeypatch: pytest.MonkeyPatch) -> None:
    box = (0, 0, 0), SIDES
    if not len(found):
        return
    points = found.voxels.astype(np.int64)
    assert mesh_tunnels(points, mesh.vertices, mesh.faces, box) == 0
    assert mesh_distances(points, mesh.vertices, mesh.faces).max() <= THIN_ERROR
    if mesh.kind != "part":
        solid = mesh.faces[_has_area(mesh)]
        assert mesh_cover(points, mesh.vertices, solid) <= COVER
    with monkeypatch.context() as patch:
        patch.setattr(mesh_voxeliser, "mark_thin_parts", lambda *_args, **_named: [])
        bare = voxels(mesh).voxels.astype(np.int64)
    if len(bare):
        assert mesh_distances(bare, mesh.vertices, mesh.faces).max() <= ERROR


def _has_area(mesh: RandomMesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return (np.cross(b - a, c - a) != 0).any(axis=1)


def check_compiled(mesh: RandomMesh, fill: str) -> None:
    results = []
    for compiled in WITHOUT:
        kernel_backend.set_enabled(compiled)
        found = voxels(mesh, fill=fill)
        results.append((found.index.tobytes(), found.notes))
    kernel_backend.set_enabled(False)
    assert results[0] == results[-1]


def check_shifted(mesh: RandomMesh, shift) -> None:
    away = tuple(side + 24 for side in SIDES)  # further than any vertex
    before, after = (
        voxels(mesh.moved(mesh.vertices + 10 + each), away).voxels for each in (0, shift)
    )
    assert ((before + shift) == after).all()
    inner = key_of(before - 10) & set(itertools.product(*map(range, SIDES)))
    if has_inside(mesh):  # others light the voxel below the upper wall
        assert inner == key(voxels(mesh))


def has_inside(mesh: RandomMesh) -> bool:
    scaled = np.rint(mesh.vertices * (1 << 16)).astype(object)
    a, b, c = (scaled[mesh.faces[:, k]] for k in range(3))
    volume = (a * np.cross(b, c)).sum()
    return bool(volume) and not voxels(mesh, fill="solid").notes


def has_doubles(mesh: RandomMesh) -> bool:
    """Two sides that coincide count once as long as they are the same triangles."""
    return any("more than once" in note for note in voxels(mesh, fill="solid").notes)


def check_mirrored(mesh: RandomMesh, plain, axis: int) -> None:
    points = mesh.vertices.copy()
    points[:, axis] = SIDES[axis] - points[:, axis]
    if not has_inside(mesh):  # ties go up
        return
    mirrored = key(voxels(mesh.moved(points, turned=True)))
    expected = {
        tuple(SIDES[k] - 1 - c if k == axis else c for k, c in enumerate(voxel)) for voxel in plain
    }
    assert mirrored == expected


def check_tiling(seed: int) -> None:
    """Tetrahedra that fill a box, some of them turned inside out, count each voxel once."""
    chance = np.random.default_rng(seed)
    count = 3
    step = chance.choice([2, 4, 64])
    nodes = np.stack(np.indices((count + 1,) * 3), axis=-1).astype(float)
    inner = ((nodes > 0) & (nodes < count)).all(axis=-1)
    nodes *= np.array(SIDES) / count
    nodes[inner] += np.rint(chance.uniform(-2, 2, (int(inner.sum()), 3)) * step) / step
    total = np.zeros(SIDES[::-1], dtype=int)
    for corner in np.ndindex((count,) * 3):
        for order in itertools.permutations(range(3)):
            path = [np.array(corner)]
            for axis in order:
                path.append(path[-1] + (np.arange(3) == axis))
            points = np.rint(np.array([nodes[tuple(each)] for each in path]) * 65536) / 65536
            volume = np.linalg.det(points[1:] - points[0])
            if volume == 0:
                continue
            faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
            solid = vd.voxelize(vd.Mesh(points, faces, fill="solid"), clip=SIDES)
            x, y, z = solid.voxels.T
            even = order in {(0, 1, 2), (1, 2, 0), (2, 0, 1)}
            total[z, y, x] += 1 if (volume > 0) == even else -1
    assert (total == 1).all()


@pytest.mark.parametrize("seed", range(FEW))
def test_guarantees(seed, monkeypatch):
    check(seed, monkeypatch)


@pytest.mark.parametrize("seed", range(3))
def test_solids_that_tile(seed):
    check_tiling(seed)


@pytest.mark.slow
@pytest.mark.parametrize("chunk", range(CHUNKS))
def test_guarantees_of_twenty_thousand(chunk, monkeypatch):
    for seed in range(chunk * MANY, (chunk + 1) * MANY):
        check(seed, monkeypatch)
    for seed in range(chunk * 10, chunk * 10 + 10):
        check_tiling(seed)

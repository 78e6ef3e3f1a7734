"""Benchmark of mesh voxelisation: this package beside other ways, the same meshes in one run.

Shells by this engine in numpy and compiled, by trimesh's three methods and by Open3D; solids by
this engine, by trimesh with filling and by PyVista. Others take a pitch in mesh units and place
voxels themselves: a pitch of 1 and, where they allow it, the grid's corner are given. All sets are
judged by the same measure: lines between dark neighbours that cross the mesh, voxels beside those
of the smallest set without such lines, distances of centres, voxels that are not those of this
engine. What is not installed is left out; DGtal's bindings for Python have no voxeliser of meshes.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

import voxdisplay as vd
from voxdisplay.compute import kernel_backend
from voxdisplay.voxelization.measure_mesh import mesh_distances, mesh_minimum, mesh_tunnels

Vertices = NDArray[np.float64]
Faces = NDArray[np.int64]
Voxels = NDArray[np.int64]
Method = Callable[[Vertices, Faces, int], Callable[[], Any]]

# Larger sets are timed, but not judged.
JUDGED = 400_000
# Methods that took this long once are not repeated.
PATIENCE_S = 4.0


def knot_tube(rings: int, around: int, size: int) -> tuple[Vertices, Faces]:
    """Return a closed tube about a trefoil knot that fits into a cube, but for one voxel."""
    t = 2 * np.pi * np.arange(rings) / rings
    radius = 2 + np.cos(3 * t)
    spine = np.stack((radius * np.cos(2 * t), radius * np.sin(2 * t), -np.sin(3 * t)), axis=1)
    along = np.roll(spine, -1, axis=0) - np.roll(spine, 1, axis=0)
    outward = np.stack((np.cos(2 * t), np.sin(2 * t), np.zeros(rings)), axis=1)
    up = np.cross(along, outward)
    side = np.cross(along, up)
    up /= np.linalg.norm(up, axis=1)[:, None]
    side /= np.linalg.norm(side, axis=1)[:, None]
    s = 2 * np.pi * np.arange(around)[:, None] / around
    points = spine[:, None] + 0.45 * (np.cos(s) * up[:, None] + np.sin(s) * side[:, None])
    i, j = np.indices((rings, around)).reshape(2, -1)
    after, beside = (i + 1) % rings * around, (j + 1) % around
    a, b, c, d = i * around + j, after + j, after + beside, i * around + beside
    faces = np.concatenate((np.stack((a, b, c), axis=1), np.stack((a, c, d), axis=1)))
    return fitted(points.reshape(-1, 3), size), faces


def ball(rings: int, size: int) -> tuple[Vertices, Faces]:
    """Return a closed sphere that fits into a cube, but for one voxel."""
    u = np.pi * (np.arange(rings) + 1) / (rings + 1)
    v = np.pi * np.arange(2 * rings) / rings
    u, v = (each.reshape(-1) for each in np.meshgrid(u, v, indexing="ij"))
    points = np.stack((np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)), axis=1)
    points = np.concatenate((points, [(0, 0, 1), (0, 0, -1)]))
    i, j = np.indices((rings - 1, 2 * rings)).reshape(2, -1)
    a, b = i * 2 * rings + j, i * 2 * rings + (j + 1) % (2 * rings)
    c, d = a + 2 * rings, b + 2 * rings
    top, last = np.arange(2 * rings), (rings - 1) * 2 * rings
    turn = (top + 1) % (2 * rings)
    north, south = np.full_like(top, len(points) - 2), np.full_like(top, len(points) - 1)
    quads = ((a, c, d), (a, d, b), (north, top, turn), (south, last + turn, last + top))
    return fitted(points, size), np.concatenate([np.stack(each, axis=1) for each in quads])


def fitted(points: Vertices, size: int) -> Vertices:
    """Return points, scaled and moved into a cube less a margin of half a voxel."""
    low, high = points.min(axis=0), points.max(axis=0)
    moved = (points - (low + high) / 2) * ((size - 1) / (high - low).max()) + size / 2
    return np.asarray(moved)


def engine(fill: Any, *, compiled: bool) -> Method:
    """Return this engine."""

    def prepare(vertices: Vertices, faces: Faces, size: int) -> Callable[[], Any]:
        mesh = vd.Mesh(vertices, faces, fill=fill)

        def run() -> NDArray[np.int32]:
            kernel_backend.set_enabled(compiled)
            return vd.voxelize(mesh, clip=(size, size, size)).voxels

        return run

    return prepare


def with_trimesh(method: str, *, fill: bool = False) -> Method:
    """Return a method of trimesh, at a pitch of 1; its voxels are around whole numbers."""

    def prepare(vertices: Vertices, faces: Faces, _size: int) -> Callable[[], Any]:
        import trimesh  # noqa: PLC0415

        mesh = trimesh.Trimesh(vertices - 0.5, faces, process=False)
        options = {"binvox": {}, "subdivide": {"max_iter": 20}}.get(method, {})

        def run() -> Any:
            grid = mesh.voxelized(1.0, method=method, **options)
            if fill:
                grid = grid.fill()
            return np.rint(grid.points).astype(np.int64)

        return run

    return prepare


def with_open3d(vertices: Vertices, faces: Faces, size: int) -> Callable[[], Any]:
    """Return Open3D's voxel grid."""
    import open3d  # noqa: PLC0415

    shape = open3d.utility
    mesh = open3d.geometry.TriangleMesh(
        shape.Vector3dVector(vertices), shape.Vector3iVector(faces.astype(np.int32))
    )
    make = open3d.geometry.VoxelGrid.create_from_triangle_mesh_within_bounds

    def run() -> Any:
        grid = make(mesh, 1.0, np.zeros(3), np.full(3, float(size)))
        return np.array([voxel.grid_index for voxel in grid.get_voxels()])

    return run


def with_pyvista(vertices: Vertices, faces: Faces, size: int) -> Callable[[], Any]:
    """Return PyVista's mask of voxel centres inside of a mesh."""
    import pyvista  # noqa: PLC0415

    rows = np.concatenate((np.full((len(faces), 1), 3), faces), axis=1)
    mesh = pyvista.PolyData(vertices, rows.reshape(-1))
    centers = pyvista.ImageData(dimensions=(size,) * 3, origin=(0.5,) * 3, spacing=(1.0,) * 3)

    def run() -> Any:
        found = mesh.voxelize_binary_mask(reference_volume=centers)
        inside = np.asarray(found["mask"]).reshape((size,) * 3)
        return np.argwhere(inside)[:, ::-1]

    return run


SHELLS: dict[str, tuple[str, Method]] = {
    "this": ("numpy", engine("shell", compiled=False)),
    "extra fast": ("numba", engine("shell", compiled=True)),
    "trimesh subdivide": ("trimesh", with_trimesh("subdivide")),
    "trimesh ray": ("rtree", with_trimesh("ray")),
    "trimesh binvox": ("trimesh", with_trimesh("binvox")),
    "Open3D": ("open3d", with_open3d),
}
SOLIDS: dict[str, tuple[str, Method]] = {
    "this": ("numpy", engine("solid", compiled=False)),
    "extra fast": ("numba", engine("solid", compiled=True)),
    "trimesh fill": ("trimesh", with_trimesh("subdivide", fill=True)),
    "PyVista": ("pyvista", with_pyvista),
}


def jobs(*, quick: bool) -> Iterator[tuple[str, Vertices, Faces, int]]:
    """Yield the meshes and the sides of their grids."""
    if quick:
        yield "tube 5 k", *knot_tube(200, 12, 32), 32
        return
    for size in (128, 256):
        yield "tube 77 k", *knot_tube(1600, 24, size), size
    yield "ball 80 k", *ball(142, 256), 256
    yield "tube 1 M", *knot_tube(10_000, 50, 256), 256


def timed(run: Callable[[], Any], repeats: int) -> tuple[float, Voxels]:
    """Return the median time of a function, in ms, and its voxels."""
    times = []
    found = run()  # warm
    for _ in range(repeats):
        began_s = time.perf_counter()
        found = run()
        times.append(time.perf_counter() - began_s)
        if times[-1] > PATIENCE_S:
            break
    return statistics.median(times) * 1000, np.asarray(found, dtype=np.int64).reshape(-1, 3)


def bench_bodies(repeats: int, *, quick: bool = False) -> None:
    """Print the table."""
    head = f"{'mesh':<11}{'grid':>5}  {'':<7}{'tool':<19}{'N':>9}{'thick':>7}{'tunnels':>9}"
    print(f"{head}{'e_max':>7}{'e_av':>7}{'others':>8}{'ms':>10}{'ratio':>8}")
    before = kernel_backend.set_enabled(False)
    try:
        for name, vertices, faces, size in jobs(quick=quick):
            for kind, tools in (("shell", SHELLS), ("solid", SOLIDS)):
                bench_job(f"{name:<11}{size:5}  {kind:<7}", tools, (vertices, faces, size), repeats)
    finally:
        kernel_backend.set_enabled(before)
    print(
        "thick: voxels per voxel of the smallest set without tunnels. tunnels: lines between dark\n"
        "neighbours that cross the mesh. Others: voxels that are not those of this engine.\n"
        "ms: median, with the voxels as an array; ratio: to this engine."
    )


def bench_job(
    head: str,
    tools: dict[str, tuple[str, Method]],
    mesh: tuple[Vertices, Faces, int],
    repeats: int,
) -> None:
    """Print the lines of one mesh."""
    vertices, faces, size = mesh
    own_ms, own = 0.0, set[int]()
    for name, (package, method) in tools.items():
        if not find_spec(package):
            print(f"{head}{name:<19} is left out: {package} is not installed")
            continue
        try:
            elapsed_ms, voxels = timed(method(vertices, faces, size), repeats)
        except Exception as error:  # noqa: BLE001 - of any library
            print(f"{head}{name:<19} failed: {type(error).__name__}: {str(error)[:60]}")
            continue
        index = set((voxels @ (1, size, size**2)).tolist())
        own, own_ms = (index, elapsed_ms) if name == "this" else (own, own_ms)
        figures = f"{'-':>7}{'-':>9}{'-':>7}{'-':>7}"
        if len(voxels) <= JUDGED and "shell" in head:
            box = (0, 0, 0), (size, size, size)
            apart = mesh_distances(voxels, vertices, faces)
            tunnels = mesh_tunnels(voxels, vertices, faces, box)
            minimum = mesh_minimum(vertices, faces, box)
            thick = f"{len(voxels) / minimum:7.3f}" if minimum else f"{'-':>7}"
            figures = f"{thick}{tunnels:9d}{apart.max():7.3f}{apart.mean():7.3f}"
        print(
            f"{head}{name:<19}{len(voxels):9d}{figures}{len(index ^ own):8d}"
            f"{elapsed_ms:10.1f}{elapsed_ms / own_ms:8.2f}"
        )

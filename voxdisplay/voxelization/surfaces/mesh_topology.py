"""Topology of snapped meshes: doubled triangles, closedness, orientation, open edges.

Vertices are the same where their snapped coordinates are, whatever their indices: a soup of
triangles needs no welding. Must not know which voxels are lit.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Bools, Ints
from voxdisplay.compute.kernel_backend import with_kernel
from voxdisplay.voxelization.surfaces.snapped_mesh import SnappedMesh

Hashes = NDArray[np.uint64]

# Odd numbers with half of their bits set, from the fractions of the golden ratio, e and pi.
_ONE, _TWO, _THREE = (
    np.uint64(0x9E3779B97F4A7C15),
    np.uint64(0xB7E151628AED2A6B),
    np.uint64(0x243F6A8885A308D3),
)
# Sums of volumes are right to this fraction of the sum of magnitudes.
_VOLUME_ERROR = 1e-9


@dataclass(frozen=True, eq=False)
class Topology:
    """Incidence of the triangles of a mesh.

    Attributes
    ----------
    mesh : SnappedMesh
        Each triangle once.
    triangles : (F,) int64 array or None
        Where these triangles stood in the mesh as it was given; None if all are left.
    doubled : int
        Number of triangles that were dropped because another has the same corners.
    closed : bool
        Whether every edge belongs to an even number of triangles.
    oriented : bool
        Whether triangles at an edge run along it in opposite directions.
    open_edges : int
        Number of edges that belong to an odd number of triangles.

    """

    mesh: SnappedMesh
    triangles: Ints | None
    doubled: int
    closed: bool
    oriented: bool
    open_edges: int

    @property
    def has_inside(self) -> bool:
        """True if each edge is run along as often in either direction."""
        return self.closed and self.oriented

    @cached_property
    def outward(self) -> int:
        """1 if normals point outwards, -1 if inwards, 0 if the mesh has no inside and outside."""
        if not self.has_inside:
            return 0
        return _volume_sign(self.mesh)


def analyse(mesh: SnappedMesh) -> Topology:
    """Return the topology of a mesh, with doubled triangles dropped."""
    one, two = vertex_hashes(mesh.points)
    closed, is_doubled = chain_and_doubles(mesh.faces, one, two)
    if closed and not is_doubled:
        return Topology(mesh, None, 0, True, True, 0)
    triangles, doubled, ambiguous = None, 0, False
    if is_doubled:
        dropped, ambiguous = _doubled_triangles(mesh, one)
        triangles = np.flatnonzero(~dropped)
        mesh = mesh.without(dropped)
        closed, _ = chain_and_doubles(mesh.faces, one, two)
        doubled = int(dropped.sum())
    if closed:
        return Topology(mesh, triangles, doubled, True, not ambiguous, 0)
    open_edges, oriented = _open_edges(mesh, one)
    return Topology(
        mesh, triangles, doubled, not open_edges, oriented and not ambiguous, open_edges
    )


@with_kernel
def vertex_hashes(points: NDArray[np.int32]) -> tuple[Hashes, Hashes]:
    """Return two independent random numbers for each place that vertices have, (V,) each."""
    x, y, z = points.view(np.uint32).astype(np.uint64)
    x |= y << np.uint64(32)
    one = _scrambled(_scrambled(x * _ONE) + z * _TWO)
    return one, _scrambled(one * _THREE + _ONE)


def _scrambled(value: Hashes) -> Hashes:
    """Return the finaliser of SplitMix64 (Steele et al. 2014): a bijection of 64 bits."""
    value = (value ^ (value >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    value = (value ^ (value >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray(value ^ (value >> np.uint64(31)))


@with_kernel
def chain_and_doubles(faces: Ints, one: Hashes, two: Hashes) -> tuple[bool, bool]:
    """Return whether the edges of all triangles cancel, and whether two have the same corners.

    Edges cancel if each is run along as often in one direction as in the other. Then the areas of
    any projection sum up to 0, and only then those of a random one: the vertices' hashes are the
    coordinates of one, modulo 2^64. Errs with a probability of about 2^-60.
    """
    total = np.uint64(0)
    sums = np.empty(len(faces), dtype=np.uint64)  # equal for the same corners
    block = 1 << 15
    with np.errstate(over="ignore"):
        for begin in range(0, len(faces), block):
            a, b, c = faces[begin : begin + block].T
            x, y, p, q = one.take(a), two.take(a), one.take(b), one.take(c)
            np.add(x + p, q, out=sums[begin : begin + block])
            area = (p - x) * (two.take(c) - y) - (q - x) * (two.take(b) - y)
            total += area.sum(dtype=np.uint64)
    sums.sort()
    return bool(total == 0), bool((sums[1:] == sums[:-1]).any())


def _doubled_triangles(mesh: SnappedMesh, one: Hashes) -> tuple[Bools, bool]:
    """Return which triangles to drop, and whether an orientation is left open.

    Of triangles with the same corners one is kept, of the orientation of most of them. If as many
    have either, that is no orientation. Those without an area are kept: they light nothing, and may
    fill a gap between edges.
    """
    rows = np.flatnonzero(~zero_area(mesh))
    dropped = np.zeros(len(mesh.faces), dtype=bool)
    if not len(rows):
        return dropped, False
    a, b, c = (one.take(mesh.faces[rows, k]) for k in range(3))
    sums = a + b + c
    order = np.argsort(sums, kind="stable")
    first = np.append(True, sums[order][1:] != sums[order][:-1])
    group = np.cumsum(first) - 1
    even = ((a < b).astype(np.int8) + (b < c) + (c < a) == 2)[order]
    net = np.bincount(group, np.where(even, 1, -1))
    size = np.bincount(group)
    ambiguous = bool(((net == 0) & (size > 1)).any())
    wanted = np.where((net == 0)[group], even, even == (net > 0)[group])
    # Stable: the first of those wanted has the lowest number.
    candidates = np.flatnonzero(wanted)
    leads = np.append(True, group[candidates][1:] != group[candidates][:-1])
    dropped[rows] = True
    dropped[rows[order[candidates[leads]]]] = False
    return dropped, ambiguous


def zero_area(mesh: SnappedMesh) -> Bools:
    """Return which triangles, (F,), have no area."""
    flat = np.ones(len(mesh.faces), dtype=bool)
    for axis in range(3):
        u, v = (
            mesh.points[k][mesh.faces].astype(np.int64) for k in ((axis + 1) % 3, (axis + 2) % 3)
        )
        flat &= (u[:, 1] - u[:, 0]) * (v[:, 2] - v[:, 0]) == (u[:, 2] - u[:, 0]) * (
            v[:, 1] - v[:, 0]
        )
    return flat


def _open_edges(mesh: SnappedMesh, one: Hashes) -> tuple[int, bool]:
    """Return the number of edges of an odd number of triangles, and whether others cancel."""
    faces = mesh.faces[~zero_area(mesh)]
    start = one.take(faces).reshape(-1)
    end = one.take(np.roll(faces, -1, axis=1)).reshape(-1)
    edge = start + end
    order = np.argsort(edge)
    edge = edge[order]
    first = np.flatnonzero(np.append(np.ones(len(edge[:1]), dtype=bool), edge[1:] != edge[:-1]))
    count = np.diff(np.append(first, len(edge)))
    forward = (start < end)[order].astype(np.int64)
    net = 2 * np.add.reduceat(forward, first) - count if len(first) else count
    odd = count & 1
    return int(odd.sum()), bool((np.abs(net) == odd).all())


def _volume_sign(mesh: SnappedMesh) -> int:
    """Return the sign of the enclosed volume, exactly."""
    total, magnitude = 0.0, 0.0
    low = mesh.points.min(axis=1)
    for _, corners in mesh.blocks():
        a, b, c = (
            (mesh.points.take(corners[k], axis=1) - low[:, None]).astype(np.float64)
            for k in range(3)
        )
        volume = a[0] * (b[1] * c[2] - b[2] * c[1])
        volume += a[1] * (b[2] * c[0] - b[0] * c[2])
        volume += a[2] * (b[0] * c[1] - b[1] * c[0])
        total += float(volume.sum())
        magnitude += float(
            (np.abs(a).max(axis=0) * np.abs(b).max(axis=0) * np.abs(c).max(axis=0)).sum()
        )
    if abs(total) > _VOLUME_ERROR * magnitude:
        return 1 if total > 0 else -1
    exact = 0
    for _, corners in mesh.blocks():
        a, b, c = (mesh.points.take(corners[k], axis=1).astype(object) for k in range(3))
        exact += int(
            (
                a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0])
            ).sum()
        )
    return (exact > 0) - (exact < 0)

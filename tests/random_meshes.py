"""Random small meshes of many kinds, on a lattice of voxels' fractions where that is harder."""

from __future__ import annotations

from dataclasses import dataclass

import mesh_reference
import numpy as np
from numpy.typing import NDArray

SIDES = (9, 8, 7)
KINDS = ("lattice", "halves", "smooth", "needle", "sliver", "open", "part")
LATTICE = 1 << 16

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class RandomMesh:
    """Vertices, (V, 3), on the lattice of 2^-16 voxel, faces, (F, 3), and what is known of them."""

    kind: str
    vertices: Floats
    faces: Ints

    @property
    def closed(self) -> bool:
        return self.kind not in {"open", "part"}

    def moved(self, vertices: Floats, *, turned: bool = False) -> RandomMesh:
        """Return the mesh with other vertices, and perhaps the other orientation."""
        return RandomMesh(self.kind, vertices, self.faces[:, ::-1] if turned else self.faces)

    def split(self, chance: np.random.Generator) -> RandomMesh:
        """Return the mesh, with triangles cut at points that are on the lattice, and shuffled."""
        scaled = np.rint(self.vertices * LATTICE).astype(np.int64)
        points, faces = list(self.vertices), []
        for face in self.faces:
            a, b, c = scaled[face]
            # Of the segments from a to b and from there to c.
            s, t = chance.integers(1, 4, 2).tolist()
            along = 4 * a + s * (b - a)
            inner = 4 * along + t * (4 * c - along)
            if (inner % 16).any():
                faces.append(face)
                continue
            points.append(inner / 16 / LATTICE)
            p, q, r = face
            new = len(points) - 1
            faces += [(p, q, new), (q, r, new), (r, p, new)]
        return RandomMesh(self.kind, np.array(points), chance.permutation(np.array(faces)))


def random_mesh(seed: int) -> RandomMesh:
    """Return the mesh of a number; kinds take turns."""
    chance = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    if chance.random() < 0.25 and kind in {"smooth", "lattice", "part"}:
        vertices, faces = _bumpy_ball(chance)
    else:
        count, given = mesh_reference.SURFACES[chance.integers(len(mesh_reference.SURFACES))]
        vertices, faces = _somewhere(chance, count, kind), np.array(given)
        if count == 8 and chance.random() < 0.5:  # a box
            ends = np.sort(vertices[:2], axis=0)
            vertices = np.array([[ends[i >> k & 1, k] for k in range(3)] for i in range(8)])
    step = {"lattice": 4, "halves": 2, "open": 4}.get(kind, LATTICE)
    if kind == "open":
        faces = chance.permutation(faces)[: max(1, len(faces) // 2)]
    if kind == "part":  # reaches beyond the grid
        vertices = vertices * 1.5 - 2
        step = 4
    if kind == "smooth" and chance.random() < 0.3:
        faces = np.concatenate((faces, faces[: len(faces) // 3]))  # doubled triangles
    return RandomMesh(kind, np.rint(vertices * step) / step, faces)


def _somewhere(chance: np.random.Generator, count: int, kind: str) -> Floats:
    points = chance.uniform(0.0, 1.0, (count, 3))
    low, size = np.zeros(3), np.array(SIDES, dtype=float)
    if kind == "needle":
        thin = chance.permutation(3)[:2]
        size[thin] = chance.uniform(0.02, 0.9, 2)
        low[thin] = chance.uniform(0, np.array(SIDES)[thin] - size[thin])
        if chance.random() < 0.7:  # not along an axis
            along = 3 - thin.sum()
            points = low + points * size
            for k in thin:
                lean = chance.uniform(-0.7, 0.7)
                points[:, k] += lean * (points[:, along] - SIDES[along] / 2)
            return np.clip(points, 0, SIDES)
    if kind == "sliver":  # nearly on one line
        ends = chance.uniform(0, 1, (2, 3)) * size
        share = chance.uniform(0, 1, (count, 1))
        off = chance.integers(-3, 4, (count, 3)) / LATTICE * chance.choice([1, 100, 8000])
        return np.clip(ends[0] + share * (ends[1] - ends[0]) + off, 0, SIDES)
    if chance.random() < 0.3:
        axis = chance.integers(3)
        size[axis] = chance.choice([0.25, 0.5, 1, 1.5])
        low[axis] = chance.uniform(0, SIDES[axis] - size[axis])
    return low + points * size


def _bumpy_ball(chance: np.random.Generator) -> tuple[Floats, Ints]:
    n, m = 5, 8
    u = np.pi * (np.arange(n) + 1)[:, None] / (n + 1)
    v = 2 * np.pi * np.arange(m) / m
    ring = np.stack((np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u) * np.ones(m)), axis=-1)
    points = np.concatenate((ring.reshape(-1, 3), [(0, 0, 1), (0, 0, -1)]))
    points *= chance.uniform(0.6, 1.0, (len(points), 1))
    faces = []
    for j in range(m):
        k = (j + 1) % m
        faces += [(n * m, j, k), (n * m + 1, (n - 1) * m + k, (n - 1) * m + j)]
        for i in range(n - 1):
            faces += [(i * m + j, (i + 1) * m + j, (i + 1) * m + k)]
            faces += [(i * m + j, (i + 1) * m + k, i * m + k)]
    half = np.array(SIDES) / 2
    return half + points * half * chance.uniform(0.3, 1, 3), np.array(faces)

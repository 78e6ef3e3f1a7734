"""Conforming triangulation of a parameter rectangle, refined edge by edge.

Edges decide, never triangles: an edge is split for all triangles around it, so that no vertex lies
inside of a side of another triangle. Sides of the rectangle that are one line of the surface, as
the seam of a cylinder is, are split together and have the same positions. Must not know formulas.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from voxdisplay.compute.array_types import Bools, Floats, Ints

CELLS = 16
"""Cells of the first grid along u and v."""


@dataclass
class Triangulation:
    """Vertices, edges and triangles of a rectangle of parameters.

    Attributes
    ----------
    uv : (V, 2) float64 array
        Parameters of vertices.
    position : (V, 3) float64 array
        Their positions, in voxels.
    ends : (E, 2) int64 array
        Vertices of edges.
    master : (E,) int64 array
        The edge with which an edge is one line of the surface, -1 for most; it comes before it.
    middle : (E, 3) float64 array
        Position of the middles; nan until it is known.
    reference : (E,) float64 array
        Length of the edge that it was once half of: lengths that do not shrink show jumps.
    stuck : (E,) int64 array
        How often in turn it did not shrink when it was halved.
    level : (E,) int64 array
        How often the first grid was halved there.
    triangles : (F, 3) int64 array
        Vertices.
    sides : (F, 3) int64 array
        Edges: side k joins vertices k and k + 1.
    settled : (F,) bool array
        For the caller: triangles made by splits have False.

    """

    uv: Floats
    position: Floats
    ends: Ints
    master: Ints
    middle: Floats
    reference: Floats
    stuck: Ints
    level: Ints
    triangles: Ints
    sides: Ints
    settled: Bools

    def split(self, chosen: Bools, length: Floats) -> None:
        """Split edges at their middles, and the triangles around them.

        Parameters
        ----------
        chosen : (E,) bool array
            The same for edges that are one line.
        length : (E,) float64 array
            Lengths of edges; needed where they are chosen.

        """
        edges = np.flatnonzero(chosen)
        middle = np.full(len(chosen), -1)
        middle[edges] = len(self.uv) + np.arange(edges.size)
        child = np.full(len(chosen), -1)
        child[edges] = len(self.ends) + 2 * np.arange(edges.size)
        a, b = self.ends[edges].T
        m = middle[edges]
        masters = self.master[edges]
        masters = np.where(masters < 0, -1, child[masters])
        self.uv = np.concatenate((self.uv, (self.uv[a] + self.uv[b]) / 2))
        self.position = np.concatenate((self.position, self.middle[edges]))
        old_ends = self.ends
        self._add_edges(
            np.stack((a, m, m, b), axis=1).reshape(-1, 2),
            np.stack((masters, np.where(masters < 0, -1, masters + 1)), axis=1).reshape(-1),
            length[edges].repeat(2),
            self.stuck[edges].repeat(2),
            self.level[edges].repeat(2) + 1,
        )
        halves = chosen[self.sides]
        count = halves.sum(axis=1)
        kept = count == 0
        parts = [(self.triangles[kept], self.sides[kept], self.settled[kept])]
        for number, cut in ((1, self._cut_one), (2, self._cut_two), (3, self._cut_three)):
            which = np.flatnonzero(count == number)
            if which.size:
                # Turned so that side 0 is the one that is split, or side 2 the one that is not.
                turn = {1: halves[which].argmax(axis=1), 2: (~halves[which]).argmax(axis=1) + 1}
                order = (turn.get(number, np.zeros(which.size, dtype=int))[:, None] + _THREE) % 3
                v = np.take_along_axis(self.triangles[which], order, axis=1).T
                e = np.take_along_axis(self.sides[which], order, axis=1).T
                near = _Near(old_ends, child, length, self.stuck, self.level)
                pieces, sides = cut(v, e, middle[e], near)
                parts.append((pieces, sides, np.zeros(len(pieces), dtype=bool)))
        self.triangles = np.concatenate([part[0] for part in parts])
        self.sides = np.concatenate([part[1] for part in parts])
        self.settled = np.concatenate([part[2] for part in parts])

    def _add_edges(
        self, ends: Ints, master: Ints, reference: Floats, stuck: Ints, level: Ints
    ) -> None:
        self.ends = np.concatenate((self.ends, ends))
        self.master = np.concatenate((self.master, master))
        self.middle = np.concatenate((self.middle, np.full((len(ends), 3), np.nan)))
        self.reference = np.concatenate((self.reference, reference))
        self.stuck = np.concatenate((self.stuck, stuck))
        self.level = np.concatenate((self.level, level))

    def _inner(self, a: Ints, b: Ints, e: Ints, split: int, near: _Near) -> Ints:
        """Add edges inside of triangles with sides ``e``, (3, n), the first of which are split.

        Return their numbers.
        """
        first = len(self.ends)
        self._add_edges(
            np.stack((a, b), axis=1),
            np.full(a.size, -1),
            np.fmax.reduce(near.length[e[:split]], axis=0),
            near.stuck[e].max(axis=0),
            near.level[e].max(axis=0) + 1,
        )
        return np.arange(first, first + a.size)

    def _cut_one(self, v: Ints, e: Ints, m: Ints, near: _Near) -> tuple[Ints, Ints]:
        inner = self._inner(m[0], v[2], e, 1, near)
        return _stacked(
            ((v[0], m[0], v[2]), (near(e[0], v[0]), inner, e[2])),
            ((m[0], v[1], v[2]), (near(e[0], v[1]), e[1], inner)),
        )

    def _cut_two(self, v: Ints, e: Ints, m: Ints, near: _Near) -> tuple[Ints, Ints]:
        corner = self._inner(m[1], m[0], e, 2, near)
        gap = self.position[v[0]] - self.position[m[1]], self.position[m[0]] - self.position[v[2]]
        shorter = (gap[0] ** 2).sum(axis=1) <= (gap[1] ** 2).sum(axis=1)
        diagonal = self._inner(
            np.where(shorter, v[0], m[0]), np.where(shorter, m[1], v[2]), e, 2, near
        )
        start, end = near(e[0], v[0]), near(e[1], v[2])
        return _stacked(
            ((m[0], v[1], m[1]), (near(e[0], v[1]), near(e[1], v[1]), corner)),
            (
                (v[0], m[0], np.where(shorter, m[1], v[2])),
                (start, np.where(shorter, corner, diagonal), np.where(shorter, diagonal, e[2])),
            ),
            (
                (np.where(shorter, v[0], m[0]), m[1], v[2]),
                (np.where(shorter, diagonal, corner), end, np.where(shorter, e[2], diagonal)),
            ),
        )

    def _cut_three(self, v: Ints, e: Ints, m: Ints, near: _Near) -> tuple[Ints, Ints]:
        inner = [self._inner(m[k], m[(k + 1) % 3], e, 3, near) for k in range(3)]
        return _stacked(
            ((v[0], m[0], m[2]), (near(e[0], v[0]), inner[2], near(e[2], v[0]))),
            ((m[0], v[1], m[1]), (near(e[0], v[1]), near(e[1], v[1]), inner[0])),
            ((m[1], v[2], m[2]), (near(e[1], v[2]), near(e[2], v[2]), inner[1])),
            ((m[0], m[1], m[2]), (inner[0], inner[1], inner[2])),
        )


_THREE = np.arange(3)


@dataclass
class _Near:
    """Finds the half of a split edge at one of its ends."""

    ends: Ints
    child: Ints
    length: Floats
    stuck: Ints
    level: Ints

    def __call__(self, edge: Ints, vertex: Ints) -> Ints:
        return np.asarray(self.child[edge] + (self.ends[edge, 0] != vertex))


def _stacked(*parts: tuple[tuple[Ints, ...], tuple[Ints, ...]]) -> tuple[Ints, Ints]:
    vertices = np.concatenate([np.stack(vertices, axis=1) for vertices, _ in parts])
    return vertices, np.concatenate([np.stack(sides, axis=1) for _, sides in parts])


def first_grid(u: Floats, v: Floats, position: Floats, seam_u: int, seam_v: int) -> Triangulation:
    """Return a grid of triangles whose diagonals alternate.

    Parameters
    ----------
    u, v : (n + 1,), (m + 1,) float64 arrays
        Parameters of the lines.
    position : (n + 1, m + 1, 3) float64 array
        Changed where sides are one line: both get the same positions.
    seam_u, seam_v : {0, 1, -1}
        1 if the first and the last line of u (or v) are one, -1 if they are in reverse.

    """
    n, m = len(u) - 1, len(v) - 1
    vertex = np.arange((n + 1) * (m + 1)).reshape(n + 1, m + 1)
    along_u = np.stack((vertex[:-1], vertex[1:]), axis=-1)
    along_v = np.stack((vertex[:, :-1], vertex[:, 1:]), axis=-1)
    rising = np.indices((n, m)).sum(axis=0) % 2 == 0
    diagonal = np.where(
        rising[..., None],
        np.stack((vertex[:-1, :-1], vertex[1:, 1:]), axis=-1),
        np.stack((vertex[1:, :-1], vertex[:-1, 1:]), axis=-1),
    )
    number_u = np.arange(n * (m + 1)).reshape(n, m + 1)
    number_v = number_u.size + np.arange((n + 1) * m).reshape(n + 1, m)
    number_d = number_u.size + number_v.size + np.arange(n * m).reshape(n, m)
    master = np.full(number_u.size + number_v.size + number_d.size, -1)
    if seam_u:
        position[-1] = position[0, ::seam_u]
        master[number_v[-1]] = number_v[0, ::seam_u]
        along_v[-1] = along_v[-1, :, ::seam_u]
    if seam_v:
        position[:, -1] = position[::seam_v, 0]
        master[number_u[:, -1]] = number_u[::seam_v, 0]
        along_u[:, -1] = along_u[:, -1, ::seam_v]
    a, b, c, d = vertex[:-1, :-1], vertex[1:, :-1], vertex[1:, 1:], vertex[:-1, 1:]
    south, north = number_u[:, :-1], number_u[:, 1:]
    west, east = number_v[:-1], number_v[1:]
    triangles = np.where(rising[..., None, None], [[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]])
    corner = np.stack((a, b, c, d), axis=-1)
    sides = np.where(
        rising[..., None],
        np.stack((south, east, number_d, number_d, north, west), axis=-1),
        np.stack((south, number_d, west, east, north, number_d), axis=-1),
    )
    ends = np.concatenate([each.reshape(-1, 2) for each in (along_u, along_v, diagonal)])
    grid = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
    faces = np.take_along_axis(corner, triangles.reshape(n, m, 6), axis=-1).reshape(-1, 3)
    return Triangulation(
        grid,
        position.reshape(-1, 3),
        ends,
        master,
        np.full((len(ends), 3), np.nan),
        np.full(len(ends), np.inf),
        np.zeros(len(ends), dtype=np.int64),
        np.zeros(len(ends), dtype=np.int64),
        faces,
        sides.reshape(-1, 3),
        np.zeros(len(faces), dtype=bool),
    )

"""Tessellation of parametric surfaces: triangles within a tolerance of them.

An edge is halved while its middle is off the surface's by more than 3/4 of the tolerance (the
deviation inside of a triangle of a quadratic patch is at most 4/3 of that at the middles of its
edges), or while it is long. With bounds of the derivatives it is proven (`_unproven`). Must not
know voxels, nor how a surface is given.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from voxdisplay.bodies.conforming_triangulation import CELLS, first_grid
from voxdisplay.errors import BodyError
from voxdisplay.expressions.interval import Interval

if TYPE_CHECKING:
    from voxdisplay.bodies.geometry import Bounds
    from voxdisplay.compute.array_types import Bools, Floats, Ints

TOLERANCE = 0.02
"""Greatest distance between triangles and surface, in voxels."""
MAX_TRIANGLES = 1 << 20
_LONGEST = 4.0  # edges, in voxels
_LONG, _FAR = 24.0, 0.25  # edges of the first grid, and their middles off the surface, in voxels
_GRID = 1 << 13  # points of the first grid, at most
_DEEP, _SHORT = 9, 0.3  # edges halved so often, and so short, in voxels, are left: there is an end
_SHRINKS = 0.75  # of its length is what is left of an edge that was halved, at most
_STUCK = 8  # halvings in turn that did not shrink it: the surface may jump
_BISECTIONS = 40
_PROBED = 4  # levels at which edges are looked at in one more place
_PROBE = 0.318
_LONGER = 1.5  # than both others is the longest edge of a flat triangle
_SMALLEST = 2.0**-16  # of a range: smaller triangles are not proven
_ALIKE = 1e-9


class Enclosure(NamedTuple):
    """Bounds of a surface over boxes of parameters: of x, y, z and their derivatives."""

    position: tuple[Interval, Interval, Interval]
    by_u: tuple[Interval, Interval, Interval]
    by_v: tuple[Interval, Interval, Interval]


class SurfaceFunction(Protocol):
    """A map of two parameters into space."""

    def __call__(self, u: Floats, v: Floats, /) -> Floats:
        """Return the points, (3, n), at (n,) float64 arrays; not finite where there is none."""

    def enclosure(self, u: Interval, v: Interval, /) -> Enclosure | None:
        """Return bounds over boxes, nan where nothing is known; None if there are none at all."""


class Tessellation(NamedTuple):
    """Triangles of a surface.

    Attributes
    ----------
    vertices : (V, 3) float64 array
    parameters : (V, 2) float64 array
        u and v.
    faces : (F, 3) int64 array
    notes : tuple of str
        What was left out, or could not be proven.
    is_proven : bool
        Whether it is proven that they follow the surface.

    """

    vertices: Floats
    parameters: Floats
    faces: Ints
    notes: tuple[str, ...]
    is_proven: bool


def tessellate(
    surface: SurfaceFunction,
    u: tuple[float, float],
    v: tuple[float, float],
    bounds: Bounds,
    *,
    certified: bool = False,
) -> Tessellation:
    """Return triangles within `TOLERANCE` of what of a surface is in a box.

    Parameters
    ----------
    surface : SurfaceFunction
    u, v : (float, float)
        Ranges of the parameters.
    bounds : Bounds
        The box; triangles wholly outside are left out.
    certified : bool
        Prove that each point of the surface in the box is within sqrt(3) times the tolerance of
        the triangles, and they of it, by bounds of the derivatives.

    Raises
    ------
    BodyError
        If it has no point, or is too rough to be followed.

    """
    with np.errstate(all="ignore"):
        refinement = _Refinement(surface, u, v, bounds)
        refinement.follow()
        if certified:
            refinement.certify()
        return refinement.result()


class _Refinement:
    def __init__(
        self,
        surface: SurfaceFunction,
        u: tuple[float, float],
        v: tuple[float, float],
        bounds: Bounds,
    ) -> None:
        self.surface = surface
        self.ranges = u, v
        self.low, self.high = bounds
        lines = [np.linspace(*ends, CELLS + 1) for ends in (u, v)]
        position = self._halve_lines(lines)
        seams = self._seam(0), self._seam(1)
        self.lines = lines
        self.mesh = first_grid(lines[0], lines[1], position, *seams)
        self.mesh.level += int(np.log2(min(each.size - 1 for each in lines) // CELLS))
        self.length = np.zeros(0)
        self.broken = np.zeros(0, dtype=bool)
        self.seen = 0  # edges before are decided
        self.unproven = 0
        self.is_proven = False
        self.notes: list[str] = []

    def _halve_lines(self, lines: list[Floats]) -> Floats:
        """Add lines to a grid where its edges are long, or far off; return its points, (n, m, 3).

        What bends along one parameter only, or jumps along a line of the grid, needs many lines
        across, where triangles would be halved in both directions.
        """
        smallest = [_SMALLEST * (end - begin) for begin, end in self.ranges]
        while True:
            points = self._grid(lines[0], lines[1])
            finer = list(lines)
            for axis in (0, 1):
                steps = np.diff(lines[axis])
                middles = lines[axis][:-1] + steps / 2
                at = [middles if k == axis else lines[k] for k in (0, 1)]
                between = np.moveaxis(self._grid(at[0], at[1]), axis, 0)
                a, b = (np.moveaxis(points, axis, 0)[part] for part in (np.s_[:-1], np.s_[1:]))
                length = np.sqrt(((b - a) ** 2).sum(axis=-1))
                off = np.sqrt(((between - (a + b) / 2) ** 2).sum(axis=-1))
                wanted = ((length > _LONG) | (off > _FAR)) & ~self._beyond(a, between, b)
                halved = wanted.any(axis=1) & (steps > smallest[axis])
                finer[axis] = np.sort(np.append(lines[axis], middles[halved]))
            sizes = [each.size for each in finer]
            if sizes == [each.size for each in lines] or sizes[0] * sizes[1] > _GRID:
                return points
            lines[:] = finer

    def _grid(self, u: Floats, v: Floats) -> Floats:
        at = np.meshgrid(u, v, indexing="ij")
        points = self.surface(at[0].reshape(-1), at[1].reshape(-1))
        return np.asarray(points.T.reshape(u.size, v.size, 3))

    def _beyond(self, a: Floats, middle: Floats, b: Floats) -> Bools:
        """Return which edges, (..., 3) ends and middles, are so far outside that they stay out."""
        length = np.sqrt(((b - a) ** 2).sum(axis=-1))
        off = np.sqrt(((middle - (a + b) / 2) ** 2).sum(axis=-1))
        reach = (length + 2 * off + 1)[..., None]
        low, high = np.minimum(np.minimum(a, b), middle), np.maximum(np.maximum(a, b), middle)
        return np.asarray(((high < self.low - reach) | (low > self.high + reach)).any(axis=-1))

    def _seam(self, axis: int) -> int:
        """Return 1 if the ends of a parameter are one line of the surface, -1 if in reverse."""
        along = np.linspace(*self.ranges[1 - axis], 4 * CELLS + 1)
        first, last = (
            self.surface(*((np.full_like(along, end), along)[:: 1 - 2 * axis]))
            for end in self.ranges[axis]
        )
        size = _ALIKE * (1 + np.abs(first).max())
        for step in (1, -1):
            if (np.abs(first - last[:, ::step]) <= size).all():
                return step
        return 0

    # ------------------------------------------------------------------ sampling

    def follow(self) -> None:
        """Split edges until all follow the surface."""
        while self.seen < len(self.mesh.ends):
            chosen = self._look()
            if chosen.any():
                self._split(chosen)

    def _split(self, chosen: Bools) -> None:
        self._choose_longer(chosen)
        growth = int(chosen[self.mesh.sides].sum())
        if len(self.mesh.triangles) + growth > MAX_TRIANGLES:
            raise BodyError(
                f"the surface is too rough or too large: it needs more than {MAX_TRIANGLES} "
                "triangles",
                hint="narrow the ranges of u and v, or scale it down",
            )
        self.mesh.split(chosen, self.length)

    def _choose_longer(self, chosen: Bools) -> None:
        """Choose the longest edges of flat triangles of which another edge is chosen.

        Otherwise halving could go on for ever beside an edge that happens to follow the surface in
        its middle, with ever flatter triangles. Lengths are those in the plane of parameters, in
        which all cells of the first grid are squares.
        """
        mesh = self.mesh
        at = np.stack(
            [
                np.interp(mesh.uv[:, k], line, np.linspace(0.0, 1.0, line.size))
                for k, line in enumerate(self.lines)
            ],
            axis=1,
        )
        touched = np.flatnonzero(chosen[mesh.sides].any(axis=1))
        while touched.size:
            sides = mesh.sides[touched]
            a, b = (at[mesh.ends[sides, k]] for k in (0, 1))
            length = np.hypot(*np.moveaxis(b - a, -1, 0))
            order = np.sort(length, axis=1)
            flat = order[:, 2] > _LONGER * order[:, 1]
            longest = sides[np.arange(touched.size), length.argmax(axis=1)]
            more = np.unique(longest[flat & ~chosen[longest] & ~self.broken[longest]])
            if not more.size:
                return
            chosen[more] = True
            self._join_seams(chosen)
            fresh = np.zeros(len(chosen), dtype=bool)
            fresh[more] = True
            self._join_seams(fresh)
            touched = np.flatnonzero(fresh[mesh.sides].any(axis=1))

    def _join_seams(self, chosen: Bools) -> None:
        """Choose both of two edges that are one line of the surface."""
        slaves = np.flatnonzero(self.mesh.master >= 0)
        masters = self.mesh.master[slaves]
        chosen[masters[chosen[slaves]]] = True
        chosen[slaves] = chosen[masters]

    def _look(self) -> Bools:
        """Evaluate the middles of new edges; return which edges are to be split."""
        mesh = self.mesh
        fresh = np.arange(self.seen, len(mesh.ends))
        self.seen = len(mesh.ends)
        own = fresh[mesh.master[fresh] < 0]
        a, b = mesh.ends[own].T
        start, end = mesh.position[a], mesh.position[b]
        middle = self._at(own, 0.5)
        mesh.middle[own] = middle
        length = np.sqrt(((end - start) ** 2).sum(axis=1))
        off = np.sqrt(((middle - (start + end) / 2) ** 2).sum(axis=1))
        probed = np.flatnonzero(mesh.level[own] < _PROBED)
        chord = start[probed] * (1 - _PROBE) + end[probed] * _PROBE
        aside = np.sqrt(((self._at(own[probed], _PROBE) - chord) ** 2).sum(axis=1))
        off[probed] = np.fmax(off[probed], aside)
        # Not finite where the surface has no point, or ends.
        points = np.isfinite(start).all(axis=1) * 1 + np.isfinite(end).all(axis=1)
        points += np.isfinite(middle).all(axis=1)
        stuck = ~(length <= _SHRINKS * mesh.reference[own]) & (mesh.reference[own] < np.inf)
        stuck |= (points < 3) & (mesh.level[own] > 0)
        mesh.stuck[own] = np.where(stuck & ~(length < 1), mesh.stuck[own] + 1, 0)
        wanted = ~((off <= 0.75 * TOLERANCE) & (length <= _LONGEST))
        wanted &= ~((mesh.level[own] >= _DEEP) & (length < _SHORT))
        wanted &= ~((points == 3) & self._beyond(start, middle, end))
        wanted &= (points > 0) | (mesh.level[own] < _PROBED)
        broken = wanted & (mesh.stuck[own] >= _STUCK)
        if broken.any():
            ends_here = points == 3
            broken[broken] = self._jumps(own[broken]) | ~ends_here[broken]
            mesh.stuck[own[wanted & ~broken & (mesh.stuck[own] >= _STUCK)]] = 0
        chosen = np.zeros(len(mesh.ends), dtype=bool)
        chosen[own] = wanted & ~broken
        self.broken = np.append(self.broken, np.zeros(fresh.size, dtype=bool))
        self.broken[own] = broken
        self.length = np.append(self.length, np.zeros(fresh.size))
        self.length[own] = length
        self._copy_to_seams(fresh, chosen)
        return chosen

    def _jumps(self, edges: Ints) -> Bools:
        """Return along which edges the surface jumps.

        There, the part with the greatest change stays long when it is halved again and again.
        """
        mesh = self.mesh
        low, high = np.zeros(edges.size), np.ones(edges.size)
        start, end = (mesh.position[mesh.ends[edges, k]] for k in (0, 1))
        for _ in range(_BISECTIONS):
            share = (low + high) / 2
            middle = self._at(edges, share[:, None])
            before, after = (((middle - each) ** 2).sum(axis=1) for each in (start, end))
            first = ~(before <= after)  # where there is no point, the change is the greatest
            low, high = np.where(first, low, share), np.where(first, share, high)
            start = np.where(first[:, None], start, middle)
            end = np.where(first[:, None], middle, end)
        return np.asarray(~(((end - start) ** 2).sum(axis=1) <= 1.0))

    def _copy_to_seams(self, edges: Ints, chosen: Bools) -> None:
        mesh = self.mesh
        slaves = edges[mesh.master[edges] >= 0]
        masters = mesh.master[slaves]
        mesh.middle[slaves] = mesh.middle[masters]
        chosen[slaves] = chosen[masters]
        self.broken[slaves], self.length[slaves] = self.broken[masters], self.length[masters]
        mesh.stuck[slaves] = mesh.stuck[masters]

    def _at(self, edges: Ints, share: float | Floats) -> Floats:
        """Return the points of the surface part of the way along edges, (n, 3)."""
        a, b = self.mesh.ends[edges].T
        u, v = (self.mesh.uv[a] * (1 - share) + self.mesh.uv[b] * share).T
        return self.surface(u, v).T

    # ------------------------------------------------------------------ proof

    def certify(self) -> None:
        """Split edges until all triangles are proven to follow the surface."""
        while not self.mesh.settled.all():
            chosen = self._unproven()
            if chosen is None:
                self.notes.append("nothing is proven: a callable has no bounds")
                return
            if not chosen.any():
                self.unproven += int((~self.mesh.settled).sum())
                break
            try:
                self._split(chosen)
                self.follow()
            except BodyError:
                self.notes.append(f"not proven: it would take more than {MAX_TRIANGLES} triangles")
                return
        self.is_proven = not self.unproven
        if self.unproven:
            self.notes.append(f"not proven: the formulas have no bounds at {self.unproven} places")

    def _unproven(self) -> Bools | None:
        """Settle triangles that bounds prove; return the edges to be split for the others.

        For a triangle in a box of parameters with sides p and q, the surface is off its linear
        interpolation by at most (w_u p + w_v q) / 4 along each axis, where w_u is the width of
        the bounds of the derivative by u: by the mean value theorem, and because the mean absolute
        deviation of numbers is at most half their range.
        """
        mesh = self.mesh
        which = np.flatnonzero(~mesh.settled)
        corners = mesh.uv[mesh.triangles[which]]
        low, high = corners.min(axis=1), corners.max(axis=1)
        bounds = self.surface.enclosure(*(Interval(low[:, k], high[:, k]) for k in (0, 1)))
        if bounds is None:
            return None
        size = high - low
        part_u = _widest(bounds.by_u) * size[:, 0]
        part_v = _widest(bounds.by_v) * size[:, 1]
        beyond = np.zeros(len(which), dtype=bool)
        for axis, value in enumerate(bounds.position):
            beyond |= (value.hi < self.low[axis] - 1) | (value.lo > self.high[axis] + 1)
        proven = beyond | ((part_u + part_v) / 4 <= TOLERANCE)
        whole = np.array([end - begin for begin, end in self.ranges])
        lost = ~proven & (size <= _SMALLEST * whole).all(axis=1)
        self.unproven += int(lost.sum())
        mesh.settled[which[proven | lost]] = True
        rest = ~(proven | lost)
        by_u = ~(part_u[rest] < part_v[rest]) & (size[rest, 0] > _SMALLEST * whole[0])
        by_v = ~(part_v[rest] < part_u[rest]) & (size[rest, 1] > _SMALLEST * whole[1])
        sides = mesh.sides[which[rest]]
        span = np.abs(mesh.uv[mesh.ends[sides, 0]] - mesh.uv[mesh.ends[sides, 1]])
        full = span >= 0.75 * size[rest][:, None]
        chosen = np.zeros(len(mesh.ends), dtype=bool)
        chosen[sides[full[:, :, 0] & by_u[:, None]]] = True
        chosen[sides[full[:, :, 1] & by_v[:, None]]] = True
        self._join_seams(chosen)
        return chosen & ~self.broken

    # ------------------------------------------------------------------ result

    def result(self) -> Tessellation:
        """Return the triangles that are there."""
        mesh = self.mesh
        corners = mesh.position[mesh.triangles]
        finite = np.isfinite(corners).all(axis=(1, 2))
        if not finite.any():
            raise self._nowhere()
        torn = self.broken[mesh.sides].any(axis=1)
        if (finite & torn).any():
            self.notes.append("the surface jumps, or has poles: nothing is drawn across")
        if not finite.all():
            self.notes.append("the surface has no point at some u and v")
        near = (corners.max(axis=1) >= self.low - 1) & (corners.min(axis=1) <= self.high + 1)
        faces = mesh.triangles[finite & ~torn & near.all(axis=1)]
        used = np.zeros(len(mesh.uv), dtype=bool)
        used[faces] = True
        number = np.cumsum(used) - 1
        return Tessellation(
            mesh.position[used], mesh.uv[used], number[faces], tuple(self.notes), self.is_proven
        )

    def _nowhere(self) -> BodyError:
        row = int(np.argmin(np.isfinite(self.mesh.position).sum(axis=1)))
        axis = "xyz"[int(np.argmin(np.isfinite(self.mesh.position[row])))]
        u, v = self.mesh.uv[row].tolist()
        return BodyError(
            f"the surface has no point: {axis} is not finite at u = {u:g}, v = {v:g}",
            hint="x, y and z are numbers for u and v in their ranges",
        )


def _widest(bounds: tuple[Interval, Interval, Interval]) -> Floats:
    """Return the greatest width of three intervals, nan where nothing is known of one."""
    widths = [each.hi - each.lo for each in bounds]
    return np.maximum(np.maximum(widths[0], widths[1]), widths[2])

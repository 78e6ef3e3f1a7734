"""Planes, discs, balls, ellipsoids, cylinders, cones and spherical triangles, in closed form."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, SupportsFloat

import numpy as np

from voxdisplay.bodies.body import Body, Fill, check_fill
from voxdisplay.bodies.body_parameters import (
    Basis,
    BodyParameters,
    Cylindrical,
    Planar,
    Polar,
    Spherical,
)
from voxdisplay.bodies.geometry import Bounds
from voxdisplay.bodies.quadrics import Quadric, QuadricPatch, QuadricPatches, half_space
from voxdisplay.curves import arguments
from voxdisplay.curves.arguments import ArgumentError
from voxdisplay.curves.orthonormal_basis import orthonormal_basis

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from voxdisplay.compute.array_types import Floats

_THIN = 0.8661
"""Solids of a smaller radius, in voxels, may pass between the mid-lines: their axes are covered."""
_EXACT = 2.0**40  # products of radii below this have exact squares
_ANYWHERE = np.full(3, -np.inf), np.full(3, np.inf)


class QuadricBody(Body):
    """Base class of bodies that are patches of quadrics.

    Parameters
    ----------
    patches : QuadricPatches
    parameters : BodyParameters
        Its u and v.
    fill : {"shell", "solid"}

    """

    def __init__(
        self, patches: QuadricPatches, parameters: BodyParameters, fill: Fill = "shell"
    ) -> None:
        self.fill = check_fill(fill)
        self._patches = patches
        self._parameters = parameters

    def values_at(self, points: Floats) -> Mapping[str, Floats]:
        """Return u and v: `Body.values_at`."""
        return self._parameters(points)

    def bounds(self) -> Bounds:
        """Return a box that holds all patches, infinite for planes."""
        bounds = [patch.bounds for patch in self._patches.patches]
        return np.min([low for low, _ in bounds], axis=0), np.max([b for _, b in bounds], axis=0)

    def geometry(self, bounds: Bounds, *, certified: bool = False) -> QuadricPatches:  # noqa: ARG002 - exact anyway
        """Return all patches: `Body.geometry`."""
        return self._patches


class Plane(QuadricBody):
    """A plane, as far as the display goes.

    Its voxels have the values u and v, in voxels from ``point``: `body_parameters.Planar`.

    Parameters
    ----------
    point : (3,) array
        Any point of it.
    normal : (3,) array
        Of any length but 0.

    """

    def __init__(self, point: ArrayLike, normal: ArrayLike) -> None:
        at = arguments.vector("point", point)
        u, v, n = orthonormal_basis("normal", normal)
        patch = QuadricPatch(half_space(at, n), (), _ANYWHERE)
        super().__init__(QuadricPatches((patch,), closed=False), Planar(at, (u, v, n)))
        self._arguments = {"point": at, "normal": n}


class Disc(QuadricBody):
    """A flat disc.

    Its voxels have the values u, the angle, and v, from 0 in the middle to 1 on the rim.

    Parameters
    ----------
    center : (3,) array
    radius : float
        In voxels.
    normal : (3,) array
        Of any length but 0.

    """

    def __init__(
        self, center: ArrayLike, radius: SupportsFloat, normal: ArrayLike = (0, 0, 1)
    ) -> None:
        at, r = arguments.vector("center", center), arguments.positive("radius", radius)
        u, v, n = orthonormal_basis("normal", normal)
        patch = QuadricPatch(half_space(at, n), (_ball(at, r),), _disc_bounds(at, r, n))
        patches = QuadricPatches((patch,), closed=False, wires=(_ring(at, r, u, v),))
        super().__init__(patches, Polar(at, (u, v, n), r))
        self._arguments = {"center": at, "radius": r, "normal": n}


class Ellipsoid(QuadricBody):
    """An ellipsoid whose axes are those of the coordinates; `Body.transformed` turns it.

    Its voxels have the values u, the longitude, and v, the latitude: `body_parameters.Spherical`.

    Parameters
    ----------
    center : (3,) array
    radii : (3,) array
        Half lengths along x, y and z, in voxels.
    fill : {"shell", "solid"}

    """

    def __init__(self, center: ArrayLike, radii: ArrayLike, *, fill: Fill = "shell") -> None:
        at, half = arguments.vector("center", center), arguments.vector("radii", radii)
        for axis, radius in enumerate(half.tolist()):
            arguments.positive(f"radii[{axis}]", radius)
        super().__init__(_ellipsoid(at, half), Spherical(at, half), fill)
        self._arguments = {"center": at, "radii": half, "fill": fill}


class Sphere(QuadricBody):
    """A sphere; with ``fill="solid"``, a ball.

    Its voxels have the values u, the longitude, and v, the latitude: `body_parameters.Spherical`.

    Parameters
    ----------
    center : (3,) array
    radius : float
        In voxels.
    fill : {"shell", "solid"}

    """

    def __init__(self, center: ArrayLike, radius: SupportsFloat, *, fill: Fill = "shell") -> None:
        at, r = arguments.vector("center", center), arguments.positive("radius", radius)
        radii = np.full(3, r)
        super().__init__(_ellipsoid(at, radii), Spherical(at, radii), fill)
        self._arguments = {"center": at, "radius": r, "fill": fill}


class SphericalTriangle(QuadricBody):
    """A triangle on a sphere whose sides are arcs of great circles.

    Its voxels have the values u, the longitude, and v, the latitude: `body_parameters.Spherical`.

    Parameters
    ----------
    center : (3,) array
        Of the sphere.
    radius : float
        Of the sphere, in voxels.
    corners : (3, 3) array
        Three points, taken as directions from the centre. Each side is the shorter arc between
        two of them.

    """

    def __init__(self, center: ArrayLike, radius: SupportsFloat, corners: ArrayLike) -> None:
        at, r = arguments.vector("center", center), arguments.positive("radius", radius)
        points = arguments.array("corners", corners, (3, 3))
        directions = np.stack(
            [
                orthonormal_basis(f"corners[{i}] less center", point - at)[2]
                for i, point in enumerate(points)
            ]
        )
        volume = np.linalg.det(directions)
        sides = [np.cross(directions[i], directions[(i + 1) % 3]) for i in range(3)]
        lengths = [float(np.linalg.norm(side)) for side in sides]
        if abs(volume) < 1e-12 or min(lengths) < 1e-9:
            raise ArgumentError(
                "corners",
                "are in one plane with the center: they enclose nothing",
                hint="a great circle is a circle, its arcs are arcs",
            )
        clips = tuple(
            half_space(at, -np.sign(volume) * side / length)
            for side, length in zip(sides, lengths, strict=True)
        )
        arcs = tuple(at + r * _arc(directions[i], directions[(i + 1) % 3], r) for i in range(3))
        bounds = _triangle_bounds(at, r, directions, clips)
        patch = QuadricPatch(_ball(at, r), clips, bounds)
        patches = QuadricPatches((patch,), closed=False, wires=arcs)
        super().__init__(patches, Spherical(at, np.full(3, r)))
        self._arguments = {"center": at, "radius": r, "corners": points}


class Cylinder(QuadricBody):
    """A circular cylinder with both its end faces.

    Its voxels have the values u, the angle about the axis, and v, from 0 at ``start`` to 1.

    Parameters
    ----------
    start, end : (3,) array
        Centres of the end faces.
    radius : float
        In voxels.
    fill : {"shell", "solid"}

    """

    def __init__(
        self,
        start: ArrayLike,
        end: ArrayLike,
        radius: SupportsFloat,
        *,
        fill: Fill = "shell",
    ) -> None:
        begin, stop, basis = _axis(start, end)
        n = basis[2]
        r = arguments.positive("radius", radius)
        side = Quadric(np.eye(3) - np.outer(n, n), np.zeros(3), -r * r, begin)
        caps = half_space(stop, n), half_space(begin, -n)
        ends = _disc_bounds(stop, r, n), _disc_bounds(begin, r, n)
        patches = (
            QuadricPatch(side, caps, _hull(*ends)),
            QuadricPatch(caps[0], (side,), ends[0]),
            QuadricPatch(caps[1], (side,), ends[1]),
        )
        wires = (np.stack((begin, stop)),) if r < _THIN else ()
        around = Cylindrical(begin, basis, float(np.linalg.norm(stop - begin)))
        super().__init__(QuadricPatches(patches, closed=True, wires=wires), around, fill)
        self._arguments = {"start": begin, "end": stop, "radius": r, "fill": fill}


class Cone(QuadricBody):
    """A circular cone with its base.

    Its voxels have the values u, the angle about the axis, and v, from 0 at the base to 1.

    Parameters
    ----------
    start : (3,) array
        Centre of the base.
    end : (3,) array
        The apex.
    radius : float
        Of the base, in voxels.
    fill : {"shell", "solid"}

    """

    def __init__(
        self,
        start: ArrayLike,
        end: ArrayLike,
        radius: SupportsFloat,
        *,
        fill: Fill = "shell",
    ) -> None:
        foot, apex, basis = _axis(start, end)
        n = basis[2]
        r, height = arguments.positive("radius", radius), float(np.linalg.norm(apex - foot))
        # |d|^2 less the square of its part along the axis is (r / height)^2 times the latter.
        widening = 1.0 + (r / height) ** 2
        side = Quadric(np.eye(3) - widening * np.outer(n, n), np.zeros(3), 0.0, apex)
        base, nappe = half_space(foot, -n), half_space(apex, n)
        ends = _disc_bounds(foot, r, n)
        patches = (
            QuadricPatch(side, (base, nappe), _hull(ends, (apex, apex))),
            QuadricPatch(base, (_ball(foot, r),), ends),
        )
        # The tip of a shell is always there; a solid has the centres inside, like all others.
        wires = (np.stack((foot, apex)),) if r < _THIN or check_fill(fill) == "shell" else ()
        around = Cylindrical(foot, basis, height)
        super().__init__(QuadricPatches(patches, closed=True, wires=wires), around, fill)
        self._arguments = {"start": foot, "end": apex, "radius": r, "fill": fill}


def _axis(start: ArrayLike, end: ArrayLike) -> tuple[Floats, Floats, Basis]:
    begin, stop = arguments.vector("start", start), arguments.vector("end", end)
    if (begin == stop).all():
        raise ArgumentError("end", "is start: the axis has no direction")
    return begin, stop, orthonormal_basis("end less start", stop - begin)


def _ball(center: Floats, radius: float) -> Quadric:
    return Quadric(np.eye(3), np.zeros(3), -radius * radius, center)


def _ellipsoid(center: Floats, radii: Floats) -> QuadricPatches:
    # Multiplied by squares, not divided: whole radii have exact coefficients.
    unit = radii.max() if (radii == radii[0]).all() or radii.prod() > _EXACT else radii.prod()
    q = Quadric(np.diag((unit / radii) ** 2), np.zeros(3), float(-unit * unit), center)
    patch = QuadricPatch(q, (), (center - radii, center + radii))
    axes = tuple(
        np.stack((center - radius * along, center + radius * along))
        for radius, along in zip(radii - radii.min(), np.eye(3), strict=True)
    )
    return QuadricPatches((patch,), closed=True, wires=axes if radii.min() < _THIN else ())


def _disc_bounds(center: Floats, radius: float, normal: Floats) -> Bounds:
    half = radius * np.sqrt(np.maximum(1.0 - normal * normal, 0.0))
    return center - half, center + half


def _hull(*bounds: Bounds) -> Bounds:
    lows, highs = zip(*bounds, strict=True)
    return np.min(lows, axis=0), np.max(highs, axis=0)


def _ring(center: Floats, radius: float, u: Floats, v: Floats) -> Floats:
    """Return a circle as a polyline, (n, 3), within 0.01 voxels."""
    angle = np.linspace(0.0, 2 * np.pi, 8 + int(25 * np.sqrt(min(radius, 1e6))))
    return np.asarray(center + radius * (np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v))


def _arc(begin: Floats, end: Floats, radius: float) -> Floats:
    """Return the shorter arc between two unit vectors, (n, 3), within 0.01 / radius."""
    angle = np.arctan2(np.linalg.norm(np.cross(begin, end)), begin @ end)
    share = np.linspace(0.0, 1.0, 2 + int(4 * angle * np.sqrt(min(radius, 1e6))))[:, None]
    return np.asarray(
        (np.sin((1 - share) * angle) * begin + np.sin(share * angle) * end) / np.sin(angle)
    )


def _triangle_bounds(
    center: Floats, radius: float, corners: Floats, clips: tuple[Quadric, ...]
) -> Bounds:
    """Return the bounding box of a spherical triangle: of its corners, sides, and poles inside."""

    def extremes() -> Iterator[Floats]:
        yield from corners
        for axis in np.eye(3):
            for clip in clips:  # where the great circle of a side turns
                n = clip.vector
                along = axis - (axis @ n) * n
                if np.linalg.norm(along) > 1e-12:
                    yield along / np.linalg.norm(along)
                    yield -along / np.linalg.norm(along)
            yield axis
            yield -axis

    inside = [each for each in extremes() if all(each @ clip.vector <= 1e-9 for clip in clips)]
    reach = radius * np.stack(inside)
    return center + reach.min(axis=0), center + reach.max(axis=0)

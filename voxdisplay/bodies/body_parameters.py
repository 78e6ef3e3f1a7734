"""Parameters u and v of points of primitives: angles in radians, shares from 0 to 1, or voxels.

Angles run from 0 to tau, counter-clockwise as seen against the axis, from the direction at which
those of a circle about that axis begin (`voxdisplay.curves.orthonormal_basis`). Must not know
bodies or voxels.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from voxdisplay.compute.array_types import Floats

Basis = tuple[Floats, Floats, Floats]
"""Right-handed unit vectors, the last along the axis."""


class BodyParameters(Protocol):
    """Parameters of a body as functions of space."""

    def __call__(self, points: Floats, /) -> dict[str, Floats]:
        """Return u and v, (n,) each, at points, (n, 3)."""


@dataclass(frozen=True, slots=True, eq=False)
class Spherical:
    """Longitude u, and latitude v from -pi/2 to pi/2, of an ellipsoid with axes x, y, z.

    Its points are center + radii * (cos u cos v, sin u cos v, sin v).
    """

    center: Floats
    radii: Floats

    def __call__(self, points: Floats, /) -> dict[str, Floats]:
        """Return u and v: `BodyParameters`."""
        x, y, z = ((points - self.center) / self.radii).T
        return {"u": _angle(x, y), "v": np.arctan2(z, np.hypot(x, y))}


@dataclass(frozen=True, slots=True, eq=False)
class Cylindrical:
    """Angle u about an axis, and share v of the height above its start."""

    start: Floats
    basis: Basis
    height: float

    def __call__(self, points: Floats, /) -> dict[str, Floats]:
        """Return u and v: `BodyParameters`."""
        a, b, h = _along(points - self.start, self.basis)
        return {"u": _angle(a, b), "v": h / self.height}


@dataclass(frozen=True, slots=True, eq=False)
class Polar:
    """Angle u about the centre of a disc, and share v of its radius."""

    center: Floats
    basis: Basis
    radius: float

    def __call__(self, points: Floats, /) -> dict[str, Floats]:
        """Return u and v: `BodyParameters`."""
        a, b, _ = _along(points - self.center, self.basis)
        return {"u": _angle(a, b), "v": np.hypot(a, b) / self.radius}


@dataclass(frozen=True, slots=True, eq=False)
class Planar:
    """Distances u and v, in voxels, from a point of a plane along two directions in it."""

    point: Floats
    basis: Basis

    def __call__(self, points: Floats, /) -> dict[str, Floats]:
        """Return u and v: `BodyParameters`."""
        a, b, _ = _along(points - self.point, self.basis)
        return {"u": a, "v": b}


@dataclass(frozen=True, slots=True, eq=False)
class Toroidal:
    """Angle u about the normal of a torus, and v about its tube, from the outermost circle."""

    center: Floats
    basis: Basis
    major: float

    def __call__(self, points: Floats, /) -> dict[str, Floats]:
        """Return u and v: `BodyParameters`."""
        a, b, h = _along(points - self.center, self.basis)
        return {"u": _angle(a, b), "v": _angle(np.hypot(a, b) - self.major, h)}


def _along(offset: Floats, basis: Basis) -> Basis:
    """Return the parts of offsets, (n, 3), along the vectors of a basis, (n,) each."""
    a, b, h = (offset @ axis for axis in basis)
    return a, b, h


def _angle(x: Floats, y: Floats) -> Floats:
    return np.asarray(np.arctan2(y, x) % (2 * np.pi))

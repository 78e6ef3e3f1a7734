"""Quadrics, and patches of them: the geometry of planes, balls, cylinders and cones.

Must not know voxelisation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from voxdisplay.bodies.body import transform_bounds
from voxdisplay.bodies.geometry import Bounds, Geometry
from voxdisplay.compute.array_types import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Quadric:
    """The function q(p) = d.A d + 2 b.d + c of d = p - origin; q < 0 is its inside.

    Attributes
    ----------
    matrix : (3, 3) float64 array
        A, symmetric.
    vector : (3,) float64 array
        b.
    constant : float
        c.
    origin : (3,) float64 array
        Near what is drawn, so that little cancels.

    """

    matrix: Floats
    vector: Floats
    constant: float
    origin: Floats

    def __call__(self, points: Floats) -> Floats:
        """Return q at points, (n, 3): (n,)."""
        d = points - self.origin
        values = ((d @ self.matrix) * d).sum(axis=1) + d @ (2 * self.vector) + self.constant
        return np.asarray(values)

    def transformed(self, matrix: Floats, offset: Floats) -> Quadric:
        """Return the quadric of the points ``matrix @ p + offset``."""
        inverse = np.linalg.inv(matrix)
        return Quadric(
            inverse.T @ self.matrix @ inverse,
            inverse.T @ self.vector,
            self.constant,
            matrix @ self.origin + offset,
        )


def half_space(point: Floats, normal: Floats) -> Quadric:
    """Return the function 2 n.(p - point), negative below the plane; n is a unit normal."""
    return Quadric(np.zeros((3, 3)), normal, 0.0, point)


@dataclass(frozen=True, slots=True, eq=False)
class QuadricPatch:
    """The part of a quadric surface q = 0 where all clips are <= 0.

    Attributes
    ----------
    surface : Quadric
    clips : tuple of Quadric
    bounds : Bounds
        A box that holds the patch, possibly infinite.

    """

    surface: Quadric
    clips: tuple[Quadric, ...]
    bounds: Bounds

    def transformed(self, matrix: Floats, offset: Floats) -> QuadricPatch:
        """Return the patch of the points ``matrix @ p + offset``."""
        return QuadricPatch(
            self.surface.transformed(matrix, offset),
            tuple(clip.transformed(matrix, offset) for clip in self.clips),
            transform_bounds(self.bounds, matrix, offset),
        )


@dataclass(frozen=True, slots=True, eq=False)
class QuadricPatches(Geometry):
    """Patches of quadrics that together are one surface.

    Attributes
    ----------
    patches : tuple of QuadricPatch
    closed : bool
        Whether they enclose a convex solid, where all their quadrics are negative.
    wires : tuple of (n, 3) float64 arrays
        Polylines near which there must be voxels, however thin the surface is: edges of open
        patches, and axes of thin solids. One of a single point is that point.

    """

    patches: tuple[QuadricPatch, ...]
    closed: bool
    wires: tuple[Floats, ...] = ()

    def transformed(self, matrix: Floats, offset: Floats) -> QuadricPatches:
        """Return the patches of the points ``matrix @ p + offset``."""
        return replace(
            self,
            patches=tuple(patch.transformed(matrix, offset) for patch in self.patches),
            wires=tuple(wire @ matrix.T + offset for wire in self.wires),
        )

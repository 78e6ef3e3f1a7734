"""Geometries: the few forms to which all bodies reduce, and which are voxelised.

Plain frozen records of arrays and callables, in voxel space. Each has one voxeliser, which
`voxdisplay.voxelization.body_voxelization` finds by the class. Must not know voxelisation.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Floats, Ints

Bounds: TypeAlias = tuple[Floats, Floats]
"""Low and high corner of a box, (3,) float64 each, in voxels; may be infinite."""


class Geometry(ABC):
    """A canonical form of bodies."""

    @abstractmethod
    def transformed(self, matrix: Floats, offset: Floats) -> Geometry:
        """Return the geometry of the points ``matrix @ p + offset``, matrix (3, 3), invertible."""


@dataclass(frozen=True, slots=True, eq=False)
class TriangleMesh(Geometry):
    """Triangles with what is interpolated over them.

    Attributes
    ----------
    vertices : (V, 3) float64 array
        In voxels, finite.
    faces : (F, 3) int64 array
        Indices of vertices, counter-clockwise as seen from outside.
    parameters : mapping of str to (V,) float64 array
        Numbers at vertices, such as u and v.
    vertex_colors : (V, 3) float64 array, optional
        Red, green and blue at vertices, 0 to 255.
    face_colors : (F, 3) float64 array, optional
        Red, green and blue of triangles, 0 to 255. They multiply other colours as fractions of 255.
    uv : (V, 2) float64 array, optional
        Texture coordinates: (0, 0) is the lower left corner of an image, (1, 1) the upper right.
    textures : tuple of (h, w, 3) uint8 array
        Images, the top row first; repeated outside of 0 to 1.
    face_textures : (F,) int64 array, optional
        Index of each triangle's texture, -1 for none. Without it all take the first.
    notes : tuple of str
        What was wrong with the body or left out, for people.
    is_sheet : bool
        Whether it may have a boundary, and no outside, without anything being wrong.
    follows_body : bool
        Whether the triangles are the body, or proven to follow it within a tolerance.

    """

    vertices: Floats
    faces: Ints
    parameters: Mapping[str, Floats] = field(default_factory=dict)
    vertex_colors: Floats | None = None
    face_colors: Floats | None = None
    uv: Floats | None = None
    textures: tuple[NDArray[np.uint8], ...] = ()
    face_textures: Ints | None = None
    notes: tuple[str, ...] = ()
    is_sheet: bool = False
    follows_body: bool = True

    def transformed(self, matrix: Floats, offset: Floats) -> TriangleMesh:
        """Return the transformed mesh; a map that mirrors turns the triangles round."""
        faces = self.faces[:, ::-1] if np.linalg.det(matrix) < 0 else self.faces
        return replace(self, vertices=self.vertices @ matrix.T + offset, faces=faces)


@dataclass(frozen=True, slots=True, eq=False)
class LitVoxels(Geometry):
    """Voxels that are lit already: points, volumes, voxel models.

    Attributes
    ----------
    voxels : (N, 3) integer array
        Columns x, y, z, in any order; of equal ones the last is taken.
    colors : (N, 3) uint8 array, optional
    parameters : mapping of str to (N,) float64 array
        Numbers at voxels, such as value.

    """

    voxels: NDArray[np.integer]
    colors: NDArray[np.uint8] | None = None
    parameters: Mapping[str, Floats] = field(default_factory=dict)

    def transformed(self, matrix: Floats, offset: Floats) -> LitVoxels:
        """Return the voxels that hold the transformed centres."""
        centers = (self.voxels + 0.5) @ matrix.T + offset
        return replace(self, voxels=np.floor(centers).astype(np.int64))

"""Colours and numbers of meshes at points of their triangles: interpolation and textures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.bodies.geometry import TriangleMesh
from voxdisplay.compute.array_types import Floats, Ints
from voxdisplay.voxelization.surfaces.surface_samples import SurfaceSamples

_WHITE = 255.0


def has_attributes(mesh: TriangleMesh) -> bool:
    """Return whether a mesh has colours or numbers of its own."""
    colored = (mesh.vertex_colors, mesh.face_colors, mesh.uv)
    return bool(mesh.parameters) or any(each is not None for each in colored)


def interpolate(
    mesh: TriangleMesh, samples: SurfaceSamples
) -> tuple[NDArray[np.uint8] | None, dict[str, Floats]]:
    """Return the colours, (N, 3) or None, and the parameters, (N,) each, at samples."""
    corners = mesh.faces[samples.triangle].T
    parameters = {
        name: np.asarray((values[corners] * samples.weights).sum(axis=0))
        for name, values in mesh.parameters.items()
    }
    colors: Floats | None = None
    for part in (
        _vertex_colors(mesh, corners, samples),
        None if mesh.face_colors is None else mesh.face_colors[samples.triangle],
        _texture_colors(mesh, corners, samples),
    ):
        if part is not None:
            colors = part if colors is None else colors * (part / _WHITE)
    if colors is None:
        return None, parameters
    return np.floor(np.clip(colors, 0, _WHITE) + 0.5).astype(np.uint8), parameters


def _vertex_colors(mesh: TriangleMesh, corners: Ints, samples: SurfaceSamples) -> Floats | None:
    if mesh.vertex_colors is None:
        return None
    return np.asarray((mesh.vertex_colors[corners] * samples.weights[..., None]).sum(axis=0))


def _texture_colors(mesh: TriangleMesh, corners: Ints, samples: SurfaceSamples) -> Floats | None:
    """Return the colours of textures, white where a triangle has none."""
    if mesh.uv is None or not mesh.textures:
        return None
    uv = (mesh.uv[corners] * samples.weights[..., None]).sum(axis=0)
    which = np.zeros(len(uv), dtype=np.int64)
    if mesh.face_textures is not None:
        which = mesh.face_textures[samples.triangle]
    colors = np.full((len(uv), 3), _WHITE)
    for number, image in enumerate(mesh.textures):
        rows = np.flatnonzero(which == number)
        if len(rows):
            colors[rows] = _bilinear(image, uv[rows])
    return colors


def _bilinear(image: NDArray[np.uint8], uv: Floats) -> Floats:
    """Return the colours of an image between its pixels' centres, repeated beyond its borders."""
    height, width, _ = image.shape
    x, y = uv[:, 0] * width - 0.5, (1 - uv[:, 1]) * height - 0.5
    left, top = np.floor(x), np.floor(y)
    s, t = (x - left)[:, None], (y - top)[:, None]
    column, row = (left % width).astype(np.int64), (top % height).astype(np.int64)
    right, below = (column + 1) % width, (row + 1) % height
    upper = image[row, column] * (1 - s) + image[row, right] * s
    lower = image[below, column] * (1 - s) + image[below, right] * s
    return np.asarray(upper * (1 - t) + lower * t)

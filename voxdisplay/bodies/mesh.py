"""Bodies of triangles: meshes, boxes, single triangles and flat polygons."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.argument_checks import instance
from voxdisplay.bodies.body import Body, Fill, check_fill, invertible
from voxdisplay.bodies.ear_clipping import clip_ears
from voxdisplay.bodies.geometry import Bounds, TriangleMesh
from voxdisplay.curves import arguments
from voxdisplay.curves.arguments import ArgumentError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from voxdisplay.compute.array_types import Floats, Ints


MAX_TRIANGLES = 1 << 25
"""Meshes of more triangles are refused, before their arrays are copied."""
_MAX_RING = 10_000
_LATTICE = 1 << 16
# A ring is flat if its points are this close to a plane, in voxels, or in parts of its size.
_FLAT, _FLAT_PARTS = 1e-3, 1e-6


class TriangulatedBody(Body):
    """Base class of bodies that are triangles from the start.

    Parameters
    ----------
    mesh : TriangleMesh
    fill : {"shell", "solid"}

    """

    def __init__(self, mesh: TriangleMesh, fill: Fill) -> None:
        self.fill = check_fill(fill)
        self._mesh = mesh
        self._arguments = {"vertices": mesh.vertices, "faces": mesh.faces, "fill": self.fill}

    def bounds(self) -> Bounds:
        """Return the bounding box of the vertices that triangles use."""
        used = self._mesh.vertices[self._mesh.faces.reshape(-1)]
        return used.min(axis=0), used.max(axis=0)

    def geometry(self, bounds: Bounds, *, certified: bool = False) -> TriangleMesh:  # noqa: ARG002 - exact anyway
        """Return all triangles: `Body.geometry`."""
        return self._mesh

    def transformed(self, matrix: ArrayLike, offset: ArrayLike = (0, 0, 0)) -> Body:
        """Return the transformed triangles as a `Mesh`: `Body.transformed`."""
        by = invertible("matrix", matrix), arguments.vector("offset", offset)
        return Mesh.from_geometry(self._mesh.transformed(*by), fill=self.fill)


class Mesh(TriangulatedBody):
    """Triangles between vertices.

    Parameters
    ----------
    vertices : (V, 3) array
        In voxels.
    faces : (F, 3) integer array
        Indices of the vertices of each triangle, counter-clockwise as seen from outside. Shells
        need no order; solids of meshes that overlap themselves do.
    fill : {"shell", "solid"}
    vertex_colors : (V, 3) array, optional
        Red, green and blue of vertices, 0 to 255, interpolated over triangles.
    face_colors : (F, 3) array, optional
        Red, green and blue of triangles. With other colours, they multiply as fractions of 255.
    uv : (V, 2) array, optional
        Texture coordinates of vertices: (0, 0) is the lower left corner of the image.
    texture : (h, w, 3) uint8 array or list of such, optional
        The image, the top row first; repeated outside of 0 to 1.
    face_textures : (F,) integer array, optional
        Which texture of the list each triangle has, -1 for none.
    parameters : mapping of str to (V,) array, optional
        Numbers at vertices by which the mesh can be coloured.

    """

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        *,
        fill: Fill = "shell",
        vertex_colors: ArrayLike | None = None,
        face_colors: ArrayLike | None = None,
        uv: ArrayLike | None = None,
        texture: ArrayLike | Sequence[ArrayLike] | None = None,
        face_textures: ArrayLike | None = None,
        parameters: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        sized = isinstance(faces, list | tuple) or (isinstance(faces, np.ndarray) and faces.ndim)
        count = len(faces) if sized else 0  # type: ignore[arg-type]
        if count > MAX_TRIANGLES:
            raise ArgumentError(
                "faces",
                f"has {count} triangles, and {MAX_TRIANGLES} is the most",
                hint="simplify the mesh, or draw it in parts",
            )
        points = arguments.points("vertices", vertices, least=1)
        triangles = _indices("faces", faces, (None, 3), 0, len(points) - 1)
        if not len(triangles):
            raise ArgumentError("faces", "has no triangle")
        textures = _textures(texture)
        if (uv is None) != (not textures):
            raise ArgumentError("texture", "and uv go together: give both or none")
        super().__init__(
            TriangleMesh(
                points,
                triangles,
                _parameters(parameters, len(points)),
                _colors("vertex_colors", vertex_colors, len(points)),
                _colors("face_colors", face_colors, len(triangles)),
                None if uv is None else arguments.array("uv", uv, (len(points), 2)),
                textures,
                None
                if face_textures is None
                else _indices(
                    "face_textures", face_textures, (len(triangles),), -1, len(textures) - 1
                ),
            ),
            fill,
        )

    @classmethod
    def from_geometry(cls, mesh: TriangleMesh, *, fill: Fill = "shell") -> Mesh:
        """Return the body of a mesh whose arrays have been checked."""
        body = cls.__new__(cls)
        super(Mesh, body).__init__(mesh, fill)
        return body

    @property
    def vertices(self) -> Floats:
        """Vertices, (V, 3) float64, in voxels."""
        return self._mesh.vertices

    @property
    def faces(self) -> Ints:
        """Indices of the vertices of each triangle, (F, 3) int64."""
        return self._mesh.faces


class Triangle(TriangulatedBody):
    """A single triangle.

    Parameters
    ----------
    points : (3, 3) array
        Its corners.

    """

    def __init__(self, points: ArrayLike) -> None:
        corners = arguments.array("points", points, (3, 3))
        super().__init__(TriangleMesh(corners, np.array([[0, 1, 2]]), is_sheet=True), "shell")
        self._arguments = {"points": corners}


class Polygon(TriangulatedBody):
    """A flat region inside of a ring of straight lines.

    Parameters
    ----------
    points : (n, 3) array
        The ring's corners in order, in one plane; the last is joined to the first.

    """

    def __init__(self, points: ArrayLike) -> None:
        ring = arguments.points("points", points, least=3)
        if len(ring) > 3 and np.array_equal(ring[0], ring[-1]):
            ring = ring[:-1]
        if len(ring) > _MAX_RING:
            raise ArgumentError("points", f"has {len(ring)} corners, and {_MAX_RING} is the most")
        middle = ring.mean(axis=0)
        around = ring - middle
        normal = np.cross(around, np.roll(around, -1, axis=0)).sum(axis=0)
        size = float(np.abs(around).max())
        length = float(np.linalg.norm(normal))
        if length <= _FLAT_PARTS * size**2:
            raise ArgumentError("points", "are on one line, or enclose nothing")
        off = np.abs(around @ (normal / length))
        if off.max() > max(_FLAT, _FLAT_PARTS * size):
            raise ArgumentError(
                f"points[{int(np.argmax(off))}]",
                f"is {off.max():.3g} voxels away from the plane of the others",
                hint="make a mesh of triangles instead",
            )
        kept = np.delete(around, int(np.argmax(np.abs(normal))), axis=1)
        scale = min(_LATTICE, (1 << 29) / size)
        triangles = clip_ears(np.rint(kept * scale).astype(np.int64))
        if triangles is None:
            raise ArgumentError("points", "has sides that cross each other")
        super().__init__(TriangleMesh(ring, triangles, is_sheet=True), "shell")
        self._arguments = {"points": ring}


class Box(TriangulatedBody):
    """The box between two opposite corners, along the axes.

    Parameters
    ----------
    start, end : (3,) array
        Opposite corners.
    fill : {"shell", "solid"}

    """

    def __init__(self, start: ArrayLike, end: ArrayLike, *, fill: Fill = "shell") -> None:
        begin, stop = arguments.vector("start", start), arguments.vector("end", end)
        low, high = np.minimum(begin, stop), np.maximum(begin, stop)
        if (low == high).any():
            axis = "xyz"[int(np.argmax(low == high))]
            raise ArgumentError("end", f"has the same {axis} as start: the box is flat")
        corners = np.stack([np.where(_CORNERS[i], high, low) for i in range(8)])
        super().__init__(TriangleMesh(corners, _BOX_FACES), fill)
        self._arguments = {"start": begin, "end": stop, "fill": self.fill}


_CORNERS = np.array([[i & 1, i & 2, i & 4] for i in range(8)], dtype=bool)
_BOX_FACES = np.array(
    [
        [0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4],
        [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5],
    ],
    dtype=np.int64,
)  # fmt: skip


def _indices(
    name: str, value: ArrayLike, shape: tuple[int | None, ...], least: int, most: int
) -> Ints:
    """Return whole numbers of a range as an int64 array, or raise ArgumentError."""
    raw = np.asarray(value) if isinstance(value, np.ndarray) else None
    if raw is not None and raw.dtype.kind in "iu" and raw.ndim == len(shape):
        numbers = raw
        if any(want not in (None, got) for got, want in zip(raw.shape, shape, strict=True)):
            arguments.array(name, np.empty(raw.shape), shape)  # raises
    else:
        empty = isinstance(value, list | tuple) and not value
        numbers = arguments.array(name, np.empty((0, 3)) if empty else value, shape)
        if (numbers != np.floor(numbers)).any():
            raise ArgumentError(name, "has an index that is no whole number")
    if numbers.size and (numbers.min() < least or numbers.max() > most):
        first = int(np.argmax(((numbers < least) | (numbers > most)).reshape(-1)))
        place = np.unravel_index(first, numbers.shape)
        where = "".join(f"[{i}]" for i in place)
        raise ArgumentError(
            name + where, f"is {int(numbers[place])}: indices are {least} to {most} here"
        )
    return numbers.astype(np.int64)


def _colors(name: str, value: ArrayLike | None, count: int) -> Floats | None:
    if value is None:
        return None
    colors = arguments.array(name, value, (count, 3))
    if colors.size and (colors.min() < 0 or colors.max() > 255):
        raise ArgumentError(name, "has a colour that is not 0 to 255")
    return colors


def _parameters(value: Mapping[str, ArrayLike] | None, count: int) -> dict[str, Floats]:
    if value is None:
        return {}
    instance("parameters", value, Mapping, "a dict of names and arrays")
    return {
        str(name): arguments.array(f"parameters[{name!r}]", numbers, (count,))
        for name, numbers in value.items()
    }


def _textures(value: ArrayLike | Sequence[ArrayLike] | None) -> tuple[NDArray[np.uint8], ...]:
    if value is None:
        return ()
    images: list[NDArray[np.uint8]] = []
    for image in value if isinstance(value, list | tuple) else [value]:
        if not (
            isinstance(image, np.ndarray)
            and image.dtype == np.uint8
            and image.ndim == 3
            and image.shape[2] == 3
            and image.size
        ):
            raise ArgumentError("texture", "is no (height, width, 3) uint8 array, or list of them")
        images.append(image)
    return tuple(images)

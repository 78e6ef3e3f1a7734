"""Reader of mesh files by trimesh, with its silent losses turned into errors.

Nothing is read outside of the file's folder. Materials, textures and colours of vertices and faces
are kept.
"""

from __future__ import annotations

import io
import logging
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from voxdisplay.bodies.body import Fill
from voxdisplay.bodies.mesh import Mesh
from voxdisplay.errors import BodyError, MissingExtra
from voxdisplay.files.contained_files import path_inside, read_file
from voxdisplay.files.guarded_calls import guarded
from voxdisplay.files.mesh_checks import check, check_uri

UP = {"glb": "y", "gltf": "y", "stl": "z", "3mf": "z"}
"""Axis that is up by convention; formats that are not here have none."""

_MAX_TEXELS = 1 << 26
_MAX_INSTANCES = 1 << 16
_MAX_FACES = 1 << 27

# Its warnings are of things that are checked here.
logging.getLogger("trimesh").addHandler(logging.NullHandler())


class Part(NamedTuple):
    """One mesh of a file, with colours as `Mesh` takes them; None where there are none."""

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    vertex_colors: NDArray[np.uint8] | None = None
    face_colors: NDArray[np.uint8] | None = None
    uv: NDArray[np.float64] | None = None
    texture: NDArray[np.uint8] | None = None


class _Folder:
    """Files that a mesh names, from its folder alone: a resolver of trimesh.

    Parameters
    ----------
    name : str
        Of the mesh, for errors.
    folder : Path or None
        None: there are no files beside it.

    Attributes
    ----------
    refused : BodyError or None
        Why a file was not read that is not to be read.
    missing : list of str
        Files that are not there.

    """

    def __init__(self, name: str, folder: Path | None) -> None:
        self._name = name
        self._folder = folder
        self.refused: BodyError | None = None
        self.missing: list[str] = []

    def get(self, key: Any) -> bytes:
        """Return a file's content."""
        key = str(key).strip().removeprefix("./")
        try:
            check_uri(self._name, key)
            path = None if self._folder is None else path_inside(self._folder, key)
            if path is not None and path.exists():
                return read_file(path)
        except BodyError as error:
            self.refused = self.refused or error
            raise FileNotFoundError(key) from error
        self.missing.append(ascii(key[:80]))
        raise FileNotFoundError(key)

    __getitem__ = get

    def write(self, name: str, data: Any) -> None:
        """Refuse to write."""
        del data
        raise PermissionError(name)

    def namespaced(self, namespace: str) -> _Folder:
        """Return the same files: there are no folders within the folder."""
        del namespace
        return self

    def keys(self) -> list[str]:
        """Return no names: files are asked for by name."""
        return []


def read_mesh(
    name: str, kind: str, data: bytes, folder: Path | None, *, fill: Fill = "shell"
) -> tuple[Mesh, tuple[str, ...]]:
    """Read a mesh.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    kind : str
        One of `MESH_KINDS`.
    data : bytes
    folder : Path or None
        Where materials, textures and buffers are that the file names; without it there are none.
    fill : {"shell", "solid"}

    Returns
    -------
    mesh : Mesh
        In the file's units and axes.
    notes : tuple of str
        What was left out.

    Raises
    ------
    BodyError
        If anything of it would be lost, or lies elsewhere; the message names file and reason.
    MissingExtra
        Without trimesh, or what it needs for this file.

    """
    claims = check(name, kind, data)
    try:
        import PIL  # noqa: F401, PLC0415 - without it trimesh leaves textures out
        import trimesh  # noqa: PLC0415 - an extra
    except ModuleNotFoundError:
        raise _missing(name) from None
    beside = _Folder(name, folder)

    def parts_of_scene() -> list[Part]:
        file = io.BytesIO(data)
        try:
            scene = trimesh.load_scene(file, file_type=kind, resolver=beside, process=False)
        except ImportError:  # of what it needs for some kinds alone
            raise _missing(name) from None
        return _parts_of(name, scene, trimesh)

    try:
        parts: list[Part] = guarded(name, "the mesh", parts_of_scene)
    except BodyError as error:
        raise beside.refused or error from None
    if beside.refused:
        raise beside.refused
    count = sum(len(part.faces) for part in parts)
    if not count:
        raise BodyError(f"{name} has no triangles: points and lines are not shown")
    if count < claims.faces:
        raise BodyError(f"{name} is damaged or not fully read: {count} of {claims.faces} triangles")
    missing = [f"there is no {each} beside it" for each in beside.missing]
    mesh: Mesh = guarded(name, "the mesh", lambda: joined(name, parts, fill))
    return mesh, (*claims.notes, *missing)


def _missing(name: str) -> MissingExtra:
    hint = "pip install 'voxdisplay[mesh]'"
    return MissingExtra(f"{name}: meshes need trimesh and what it reads them with", hint=hint)


def _parts_of(name: str, scene: Any, trimesh: Any) -> list[Part]:
    """Return the meshes of a scene, in the scene's coordinates."""
    nodes = list(scene.graph.nodes_geometry)
    if len(nodes) > _MAX_INSTANCES:
        raise BodyError(f"{name} shows more than {_MAX_INSTANCES} parts")
    filler = np.asarray(trimesh.visual.material.empty_material().image.convert("RGB"))
    textures = _Textures(name, filler)
    parts: list[Part] = []
    count = 0
    for node in nodes:
        matrix, key = scene.graph[node]
        geometry = scene.geometry[key]
        if not isinstance(geometry, trimesh.Trimesh) or not len(geometry.faces):
            continue
        count += len(geometry.faces)
        if count > _MAX_FACES:
            raise BodyError(f"{name} shows more than {_MAX_FACES} triangles")
        vertices = np.asarray(geometry.vertices, dtype=np.float64)
        faces = np.asarray(geometry.faces, dtype=np.int64)
        _check_indices(name, vertices, faces)
        matrix = np.asarray(matrix, dtype=np.float64)
        if np.linalg.det(matrix[:3, :3]) < 0:
            faces = faces[:, ::-1]
        with np.errstate(over="ignore", invalid="ignore"):
            moved = vertices @ matrix[:3, :3].T + matrix[:3, 3]
        parts.append(_colored(moved, faces, geometry.visual, textures))
    return parts


def _check_indices(name: str, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
    low, high = int(faces.min()), int(faces.max())
    if low < 0 or high >= len(vertices):
        wrong = low if low < 0 else high
        raise BodyError(f"{name}: a face has vertex {wrong}, of {len(vertices)}")
    used = np.zeros(len(vertices), dtype=bool)
    used[faces] = True
    bad = np.flatnonzero(used & ~np.isfinite(vertices).all(axis=1))
    if bad.size:
        raise BodyError(f"{name}: vertex {bad[0]} is not finite")


class _Textures:
    """Images of a scene as arrays: each once, whatever shows it.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    filler : array
        What trimesh puts where there is no image.

    """

    def __init__(self, name: str, filler: NDArray[np.uint8]) -> None:
        self._name = name
        self._filler = filler
        self._found: dict[int, tuple[Any, NDArray[np.uint8] | None]] = {}
        self._texels = 0

    def array(self, image: Any) -> NDArray[np.uint8] | None:
        """Return an image as an (h, w, 3) array; None for the filler."""
        if id(image) not in self._found:
            width, height = image.size
            self._texels += width * height
            if self._texels > _MAX_TEXELS:
                raise BodyError(f"{self._name}: textures of more than {_MAX_TEXELS} pixels")
            pixels = np.asarray(image.convert("RGB"), dtype=np.uint8)
            empty = np.array_equal(pixels, self._filler)
            self._found[id(image)] = image, None if empty else pixels
        return self._found[id(image)][1]


def _colored(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], visual: Any, textures: _Textures
) -> Part:
    """Return a mesh with the colours that trimesh found for it."""
    if visual.kind == "vertex":
        colors = np.asarray(visual.vertex_colors, dtype=np.uint8)[:, :3]
        return Part(vertices, faces, colors if len(colors) == len(vertices) else None)
    if visual.kind == "face":
        colors = np.asarray(visual.face_colors, dtype=np.uint8)[:, :3]
        return Part(vertices, faces, None, colors)
    if visual.kind != "texture":
        return Part(vertices, faces)
    material = visual.material
    image = getattr(material, "baseColorTexture", getattr(material, "image", None))
    factor = np.asarray(material.main_color, dtype=np.uint8)[:3]
    face_colors: NDArray[np.uint8] | None = np.tile(factor, (len(faces), 1))
    uv = visual.uv
    if image is None or uv is None or len(uv) != len(vertices):
        return Part(vertices, faces, None, face_colors)
    texture = textures.array(image)
    if texture is None:
        return Part(vertices, faces)
    if hasattr(material, "image"):  # there the image is the colour
        face_colors = None
    return Part(vertices, faces, None, face_colors, np.asarray(uv, dtype=np.float64), texture)


def joined(name: str, parts: list[Part], fill: Fill) -> Mesh:
    """Return one body of several meshes; what has no colour is white if others have one."""
    vertices = np.concatenate([part.vertices for part in parts])
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=False)])
    _check_indices(name, vertices, faces)
    used = np.unique(faces) if not np.isfinite(vertices).all() else None
    if used is not None:  # of unused vertices nobody asks where they are
        vertices = np.where(np.isfinite(vertices), vertices, vertices[used[0]])
    textures: list[NDArray[np.uint8]] = []
    numbers = {}
    for part in parts:
        if part.texture is not None and id(part.texture) not in numbers:
            numbers[id(part.texture)] = len(textures)
            textures.append(part.texture)
    face_textures = np.repeat(
        [-1 if part.texture is None else numbers[id(part.texture)] for part in parts],
        [len(part.faces) for part in parts],
    )
    return Mesh(
        vertices,
        faces,
        fill=fill,
        vertex_colors=_joined([part.vertex_colors for part in parts],
                              [len(part.vertices) for part in parts], (255, 255, 255)),
        face_colors=_joined([part.face_colors for part in parts],
                            [len(part.faces) for part in parts], (255, 255, 255)),
        uv=_joined([part.uv for part in parts], [len(part.vertices) for part in parts], (0.0, 0.0))
        if textures else None,
        texture=textures or None,
        face_textures=face_textures if textures else None,
    )  # fmt: skip


def _joined(arrays: list[Any], counts: list[int], filler: tuple[float, ...]) -> NDArray[Any] | None:
    """Return arrays one behind the other, a filler for those that are None; None if all are."""
    if all(array is None for array in arrays):
        return None
    return np.concatenate(
        [
            np.tile(np.array(filler), (count, 1)) if array is None else array
            for array, count in zip(arrays, counts, strict=True)
        ]
    )

"""Reader of MagicaVoxel files (.vox): scene graph, palettes, several models, hidden parts.

After the format's published description and files of the program. The colour index i of a voxel is
entry i - 1 of the palette; coordinates are z up.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from operator import itemgetter
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from voxdisplay.errors import BodyError
from voxdisplay.files.byte_reader import ByteReader
from voxdisplay.files.contents import MAX_LIT, ModelVoxels

_MAX_NODES = 1 << 16
_MAX_VISITS = 1 << 14  # a node may have several parents, so a small file could have 2^64 paths
_MAX_DEPTH = 256
_MAX_ATTRIBUTES = 1 << 10
_MAX_SIDE = 1 << 16
_MAX_MOVE = 1 << 24

Attributes = dict[str, str]
_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class _Model:
    """Size, (3,), and voxels with their colour index, (N, 4)."""

    size: NDArray[np.int64]
    voxels: NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class _Motion:
    """Map of positions: ``matrix @ p + offset``; whole numbers."""

    matrix: NDArray[np.int64]
    offset: NDArray[np.int64]

    def after(self, first: _Motion) -> _Motion:
        """Return the map of another and then of this one."""
        return _Motion(self.matrix @ first.matrix, self.matrix @ first.offset + self.offset)


@dataclass(frozen=True, slots=True)
class _Node:
    """A node of the scene graph: motions and children, or models; both keyed by frame numbers."""

    hidden: bool
    children: tuple[int, ...] = ()
    models: tuple[tuple[int, int], ...] = ()
    motions: tuple[tuple[int, _Motion], ...] = ()
    layer: int = -1


@dataclass(slots=True)
class VoxContents:
    """Contents of a file: models, and the scene graph that places them in space and time."""

    name: str

    models: list[_Model] = field(default_factory=list)
    nodes: dict[int, _Node] = field(default_factory=dict)
    hidden_layers: set[int] = field(default_factory=set)
    palette: NDArray[np.uint8] | None = None
    size: NDArray[np.int64] | None = None


def read_vox(name: str, data: bytes) -> ModelVoxels:
    """Read a MagicaVoxel file.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    data : bytes

    Raises
    ------
    BodyError
        If it is none; the message names file and place.

    """
    contents = read_contents(name, data)
    notes: list[str] = []
    placed = list(_placed(contents, notes))
    if not placed:
        raise BodyError(f"{name}: all of its {len(contents.models)} models are hidden or empty")
    voxels, colors = _joined(contents, placed)
    return ModelVoxels(voxels, colors, tuple(notes))


def read_contents(name: str, data: bytes) -> VoxContents:
    """Read all models of a MagicaVoxel file and where they are; as `read_vox`."""
    reader = ByteReader(name, data)
    if reader.bytes(4, "the file's mark") != b"VOX ":
        raise BodyError(f"{name} is not a MagicaVoxel file")
    reader.integer("the version")
    contents = VoxContents(name)
    while reader.left:
        _read_chunk(reader, contents)
    if not contents.models:
        raise BodyError(f"{name} holds no model")
    return contents


def _joined(
    contents: VoxContents, placed: list[tuple[NDArray[np.int64], NDArray[np.uint8]]]
) -> tuple[NDArray[np.int32], NDArray[np.uint8]]:
    """Return the voxels, (N, 3), of placed models, and their colours, (N, 3)."""
    palette = default_palette() if contents.palette is None else contents.palette
    voxels = np.concatenate([voxels for voxels, _ in placed])
    index = np.concatenate([index for _, index in placed])
    # Colour index i is palette entry i - 1.
    return voxels.astype(np.int32), np.roll(palette, 1, axis=0).take(index, axis=0)


def _next_chunk(reader: ByteReader) -> tuple[bytes, ByteReader]:
    """Return the kind and the content of the next chunk, and move behind its content."""
    kind = reader.bytes(4, "the kind of a chunk")
    length, children = reader.integers(2, "the length of a chunk")
    what = f"chunk {kind.decode('latin-1')!a}"
    if children < 0:
        raise reader.error(f"{what} with children of {children} bytes")
    chunk = reader.part(length, what)
    # The children of MAIN follow its own content, which is empty: they are read as its successors.
    if kind == b"MAIN" and children > reader.left:
        raise reader.error(f"all chunks are {children} bytes, of which {reader.left} are left,")
    return kind, chunk


def _read_chunk(reader: ByteReader, contents: VoxContents) -> None:
    kind, chunk = _next_chunk(reader)
    if kind == b"SIZE":
        size = np.array(chunk.integers(3, "the size of a model"), dtype=np.int64)
        if not ((size > 0) & (size <= _MAX_SIDE)).all():
            raise chunk.error(f"a model of {' x '.join(map(str, size))} voxels")
        contents.size = size
    elif kind == b"XYZI":
        contents.models.append(_read_model(chunk, contents.size))
    elif kind == b"RGBA":
        colors = chunk.array(1024, "u1", "the palette").reshape(256, 4)
        contents.palette = colors[:, :3].astype(np.uint8)
    elif kind == b"LAYR":
        number = chunk.integer("a layer")
        if _read_attributes(chunk).get("_hidden") == "1":
            contents.hidden_layers.add(number)
    elif kind in _NODES:
        number, attributes = chunk.integer("a node"), _read_attributes(chunk)
        contents.nodes[number] = _NODES[kind](chunk, attributes.get("_hidden") == "1")
        if len(contents.nodes) > _MAX_NODES:
            raise reader.error(f"more than {_MAX_NODES} nodes")


def _read_model(chunk: ByteReader, size: NDArray[np.int64] | None) -> _Model:
    count = chunk.integer("the number of voxels")
    voxels = chunk.array(4 * count if 0 <= count <= chunk.left else -1, "u1", "voxels")
    found = voxels.astype(np.uint8).reshape(-1, 4)
    if size is None:
        raise chunk.error("voxels of a model without a size")
    if len(found) and (found[:, :3].max(axis=0) >= size).any():
        outside = (found[:, :3] >= size).any(axis=1)
        first = tuple(found[outside][0, :3].tolist())
        raise chunk.error(f"voxel {first} is outside its model of {' x '.join(map(str, size))}")
    lit = found[:, 3] > 0
    return _Model(size, found if lit.all() else found[lit])


def _read_attributes(chunk: ByteReader) -> Attributes:
    count = chunk.integer("the number of attributes")
    if not 0 <= count <= _MAX_ATTRIBUTES:
        raise chunk.error(f"{count} attributes")
    return {chunk.text("an attribute"): chunk.text("an attribute's value") for _ in range(count)}


def _read_list(chunk: ByteReader, what: str) -> range:
    count = chunk.integer(f"the number of {what}")
    if not 0 <= count <= chunk.left // 4:
        raise chunk.error(f"{count} {what}")
    return range(count)


def _read_transform(chunk: ByteReader, hidden: bool) -> _Node:
    child, _, layer, frames = chunk.integers(4, "a transform")
    if frames < 1:
        raise chunk.error(f"a transform of {frames} frames")
    motions = [_read_motion(chunk) for _ in range(frames)]
    return _Node(hidden, (child,), (), tuple(sorted(motions, key=itemgetter(0))), layer)


def _read_motion(chunk: ByteReader) -> tuple[int, _Motion]:
    """Return the motion of one frame of a transform, and the frame's number."""
    attributes = _read_attributes(chunk)
    matrix = _rotation(attributes.get("_r", "4"), chunk)
    offset = np.zeros(3, dtype=np.int64)
    if "_t" in attributes:
        try:
            numbers = [int(word) for word in attributes["_t"].split()[:4]]
        except ValueError:
            numbers = []
        if len(numbers) != 3 or max(map(abs, numbers)) > _MAX_MOVE:
            raise chunk.error(f"a translation {attributes['_t'][:40]!r}")
        offset[:] = numbers
    return _frame_number(attributes), _Motion(matrix, offset)


def _rotation(text: str, chunk: ByteReader) -> NDArray[np.int64]:
    """Return the matrix of a rotation byte: two column indices, three signs of rows."""
    bits = int(text) if text.isascii() and text.isdecimal() and len(text) < 4 else -1
    first, second = bits & 3, bits >> 2 & 3
    if not 0 <= bits < 128 or first == second or 3 in {first, second}:
        raise chunk.error(f"a rotation {text[:40]!r}")
    matrix = np.zeros((3, 3), dtype=np.int64)
    for row, column in enumerate((first, second, 3 - first - second)):
        matrix[row, column] = -1 if bits >> (4 + row) & 1 else 1
    return matrix


def _read_group(chunk: ByteReader, hidden: bool) -> _Node:
    return _Node(hidden, tuple(chunk.integer("a child") for _ in _read_list(chunk, "children")))


def _read_shape(chunk: ByteReader, hidden: bool) -> _Node:
    models = []
    for _ in _read_list(chunk, "models"):
        number, attributes = chunk.integer("a model"), _read_attributes(chunk)
        models.append((_frame_number(attributes), number))
    return _Node(hidden, (), tuple(sorted(models)))


def _frame_number(attributes: Attributes) -> int:
    text = attributes.get("_f", "0")
    return int(text) if text.isascii() and text.isdecimal() and len(text) < 10 else 0


_NODES = {b"nTRN": _read_transform, b"nGRP": _read_group, b"nSHP": _read_shape}


def _keyed(keys: Sequence[tuple[int, _T]], frame: int) -> _T:
    """Return the value of the last key that is not after a frame; before the first, that of it."""
    return keys[max(0, bisect_right(keys, frame, key=itemgetter(0)) - 1)][1]


def _placed(
    contents: VoxContents, notes: list[str], frame: int = 0
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.uint8]]]:
    """Yield the voxels of each visible model in the scene, and their colour indices."""
    if not contents.nodes:
        model = contents.models[min(frame, len(contents.models) - 1)]
        if len(contents.models) > 1:
            notes.append(f"{len(contents.models)} models without a scene: the first frame is shown")
        yield model.voxels[:, :3].astype(np.int64), model.voxels[:, 3]
        return
    lit = hidden = 0
    for number, motion, visible in _shapes(contents, frame):
        node = contents.nodes[number]
        if not visible:
            hidden += 1
            continue
        if len(node.models) > 1:
            notes.append(f"a shape has {len(node.models)} frames: the first is shown")
        model = _model_of(contents, number, frame)
        lit += len(model.voxels)
        if lit > MAX_LIT:
            raise BodyError(f"{contents.name} shows more than {MAX_LIT} voxels")
        # Doubled, so that a voxel's centre is a whole number.
        center = 2 * model.voxels[:, :3].astype(np.int64) + 1 - 2 * (model.size // 2)
        moved = center @ motion.matrix.T + 2 * motion.offset
        yield moved >> 1, model.voxels[:, 3]
    if hidden:
        notes.append(f"{hidden} hidden part{'s' * (hidden > 1)} left out")


def _model_of(contents: VoxContents, number: int, frame: int) -> _Model:
    """Return the model that a shape shows in a frame."""
    index = _keyed(contents.nodes[number].models, frame)
    if not 0 <= index < len(contents.models):
        raise BodyError(f"{contents.name}: node {number} shows model {index} of "
                        f"{len(contents.models)}")  # fmt: skip
    return contents.models[index]


def _shapes(contents: VoxContents, frame: int) -> Iterator[tuple[int, _Motion, bool]]:
    """Yield the shapes of the scene graph with their motions, and whether they are visible."""
    name = contents.name
    children = {child for node in contents.nodes.values() for child in node.children}
    roots = [number for number in contents.nodes if number not in children]
    still = _Motion(np.eye(3, dtype=np.int64), np.zeros(3, dtype=np.int64))
    waiting = [(number, still, True, 0) for number in reversed(roots)]
    visits = 0
    if not roots:
        raise BodyError(f"{name}: the scene graph is a circle")
    while waiting:
        number, motion, visible, depth = waiting.pop()
        visits += 1
        if visits > _MAX_VISITS or depth > _MAX_DEPTH:
            raise BodyError(f"{name}: the scene graph is a circle, or too large")
        node = contents.nodes.get(number)
        if node is None:
            raise BodyError(f"{name}: the scene graph has no node {number}")
        shown = visible and not node.hidden and node.layer not in contents.hidden_layers
        moved = motion.after(_keyed(node.motions, frame)) if node.motions else motion
        if np.abs(moved.offset).max() > _MAX_MOVE:
            raise BodyError(f"{name}: node {number} is moved out of sight")
        if node.models:
            yield number, moved, shown
        waiting += [(child, moved, shown, depth + 1) for child in reversed(node.children)]


def frame_voxels(contents: VoxContents, frame: int) -> tuple[NDArray[np.int32], NDArray[np.uint8]]:
    """Return the voxels, (N, 3), of a frame, and their colours, (N, 3)."""
    placed = list(_placed(contents, [], frame))
    if not placed:
        return np.empty((0, 3), dtype=np.int32), np.empty((0, 3), dtype=np.uint8)
    return _joined(contents, placed)


def key_frames(contents: VoxContents) -> list[int]:
    """Return the numbers of the frames, ascending, in which anything may change; the first is 0."""
    if not contents.nodes:
        return list(range(len(contents.models)))
    keys = {0}
    for node in contents.nodes.values():
        keys.update(number for number, _ in (*node.models, *node.motions))
    return sorted(keys)


def frame_box(contents: VoxContents, frame: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the corners, (3,), of the box of all models that a frame shows; empty without any."""
    low, high = np.full(3, 2 * _MAX_MOVE), np.full(3, -2 * _MAX_MOVE)
    if not contents.nodes:
        return 0 * low, contents.models[frame].size
    for number, motion, visible in _shapes(contents, frame):
        if visible:
            size = _model_of(contents, number, frame).size
            ends = np.array([0 * size, 2 * size]) - 2 * (size // 2)
            corners = (ends @ motion.matrix.T + 2 * motion.offset) // 2
            low, high = np.minimum(low, corners.min(axis=0)), np.maximum(high, corners.max(axis=0))
    return low, high


def default_palette() -> NDArray[np.uint8]:
    """Return the palette of files that have none, (256, 3); entry i is for colour index i + 1."""
    levels = np.arange(255, -1, -51)
    cube = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1).reshape(-1, 3)
    ramp = np.array([0xEE, 0xDD, 0xBB, 0xAA, 0x88, 0x77, 0x55, 0x44, 0x22, 0x11])
    ramps = np.zeros((4, 10, 3), dtype=np.int64)
    for channel in range(3):
        ramps[channel, :, channel] = ramp
    ramps[3] = ramp[:, None]
    black = np.zeros((1, 3), dtype=np.int64)
    return np.concatenate((cube[:-1], ramps.reshape(-1, 3), black)).astype(np.uint8)

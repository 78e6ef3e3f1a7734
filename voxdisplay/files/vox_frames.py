"""Animations in MagicaVoxel files (.vox): frames of the scene graph, read and written.

Key frames of models and transforms hold until the next ones. Without a scene graph, models are
frames, as version 0.98 wrote them. Must not know displays.
"""

from __future__ import annotations

import struct
from bisect import bisect_right
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from voxdisplay.errors import BodyError
from voxdisplay.files.magicavoxel import frame_box, frame_voxels, key_frames, read_contents
from voxdisplay.files.writing import VOX_SIDE, vox_chunk, vox_palette

_MAX_FRAMES = 1_000_000
_MAX_KEYS = 1 << 12  # a key costs a walk through the scene graph
_VERSION = 200
_MAX_BYTES = 1 << 28  # they are held until all are known

FrameVoxels = tuple[NDArray[np.integer], NDArray[np.uint8]]
"""Lit voxels, (N, 3), columns x, y, z, and their colours, (N, 3)."""


class VoxFrames:
    """Frames of a MagicaVoxel file.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    data : bytes

    Attributes
    ----------
    frame_count : int
    sides : tuple of int
        Size in x, y, z of the box of all models in all frames, in which voxels are placed.

    Raises
    ------
    BodyError
        If it is none; the message names file and place.

    """

    def __init__(self, name: str, data: bytes) -> None:
        self._contents = read_contents(name, data)
        self._keys = key_frames(self._contents)
        self.frame_count = self._keys[-1] + 1
        if self.frame_count > _MAX_FRAMES or len(self._keys) > _MAX_KEYS:
            raise BodyError(
                f"{name} has {self.frame_count} frames, {len(self._keys)} of them key frames: "
                f"{_MAX_FRAMES} and {_MAX_KEYS} are the most"
            )
        boxes = np.array([frame_box(self._contents, key) for key in self._keys])
        self._low = boxes[:, 0].min(axis=0)
        x, y, z = (boxes[:, 1].max(axis=0) - self._low).tolist()
        if min(x, y, z) < 1:
            raise BodyError(f"{name}: all of its models are hidden or empty")
        self.sides: tuple[int, int, int] = (x, y, z)

    def frame(self, number: int) -> FrameVoxels:
        """Return the voxels of a frame; ``number`` is from 0 to ``frame_count - 1``."""
        key = self._keys[bisect_right(self._keys, number) - 1]
        voxels, colors = frame_voxels(self._contents, key)
        return voxels - self._low, colors


def write_vox_frames(
    path: Path, sides: tuple[int, int, int], count: int, frame: Callable[[int], FrameVoxels]
) -> str | None:
    """Write frames as a MagicaVoxel file.

    Frames that are equal to those before them are not written again.

    Parameters
    ----------
    path : Path
    sides : tuple of int
        Size in x, y, z; 256 at most.
    count : int
        Number of frames.
    frame : callable
        Returns the voxels of a frame; it is called twice for each, in their order.

    Returns
    -------
    str or None
        What the file cannot hold, for people.

    Raises
    ------
    BodyError
        If a side is too long, or the file would be.
    OSError
        If it cannot be written.

    """
    if max(sides) > VOX_SIDE:
        raise BodyError(
            f"{path.name}: models of MagicaVoxel have {VOX_SIDE} voxels a side at most, "
            f"not {max(sides)}"
        )
    codes: NDArray[np.uint32] = np.empty(0, dtype=np.uint32)
    for number in range(count):
        codes = np.union1d(codes, _packed(frame(number)[1]))
    known = np.stack([codes >> shift & 255 for shift in (16, 8, 0)], axis=1).astype(np.uint8)
    entry, palette, remark = vox_palette(known)
    size = vox_chunk(b"SIZE", struct.pack("<3i", *sides))
    chunks: list[bytes] = []
    keys: list[int] = []
    before, written = b"", 0
    for number in range(count):
        voxels, colors = frame(number)
        index = entry[np.searchsorted(codes, _packed(colors))]
        cells = np.column_stack((voxels, index)).astype(np.uint8).tobytes()
        if not keys or cells != before or number == count - 1:
            keys.append(number)
            chunks += [size, vox_chunk(b"XYZI", struct.pack("<i", len(voxels)) + cells)]
            written += len(chunks[-1])
            if written > _MAX_BYTES:
                raise BodyError(f"{path.name} would be larger than {_MAX_BYTES >> 20} MiB")
        before = cells
    chunks += [*_graph(keys), vox_chunk(b"RGBA", palette.tobytes())]
    content = vox_chunk(b"MAIN", b"", b"".join(chunks))
    path.write_bytes(b"VOX " + struct.pack("<i", _VERSION) + content)
    return remark


def _packed(colors: NDArray[np.uint8]) -> NDArray[np.uint32]:
    red, green, blue = colors.T.astype(np.uint32)
    return np.asarray(red << 16 | green << 8 | blue, dtype=np.uint32)


def _graph(keys: list[int]) -> list[bytes]:
    """Return a scene graph of one shape whose model in frame ``keys[i]`` is model i."""
    none, one = struct.pack("<i", 0), struct.pack("<i", 1)
    models = b"".join(
        struct.pack("<i", model) + one + _text(b"_f") + _text(b"%d" % number)
        for model, number in enumerate(keys)
    )
    return [
        vox_chunk(b"nTRN", none + none + struct.pack("<4i", 1, -1, -1, 1) + none),
        vox_chunk(b"nGRP", one + none + struct.pack("<2i", 1, 2)),
        vox_chunk(b"nTRN", struct.pack("<i", 2) + none + struct.pack("<4i", 3, -1, 0, 1) + none),
        vox_chunk(b"nSHP", struct.pack("<i", 3) + none + struct.pack("<i", len(keys)) + models),
    ]


def _text(text: bytes) -> bytes:
    return struct.pack("<i", len(text)) + text

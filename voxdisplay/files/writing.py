"""Writers of lit voxels: .npy, .npz, .vox and .ply."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Ints

VOX_SIDE = 256
"""Longest side of a model of MagicaVoxel."""
_COLORS = 255


@dataclass(frozen=True, slots=True, eq=False)
class LitPage:
    """Voxels that a display shows.

    Attributes
    ----------
    pixels : ndarray
        Memory of the display, indexed [z, y, x].
    voxels : (N, 3) integer array
        What is lit: columns x, y, z, in scan order.
    colors : (N, 3) uint8 array

    """

    pixels: NDArray[Any]
    voxels: NDArray[np.integer]
    colors: NDArray[np.uint8]


def write_voxels(path: Path, kind: str, page: LitPage) -> str | None:
    """Write a file.

    Parameters
    ----------
    path : Path
    kind : str
        One of `WRITERS`: its suffix.
    page : LitPage

    Returns
    -------
    str or None
        What the file cannot hold, for people.

    Raises
    ------
    OSError
        If it cannot be written.

    """
    with path.open("wb") as file:
        return WRITERS[kind](file, page)


def _write_npy(file: BinaryIO, page: LitPage) -> None:
    np.save(file, page.pixels)


def _write_npz(file: BinaryIO, page: LitPage) -> None:
    grid = np.array(page.pixels.shape[2::-1], dtype=np.int32)
    voxels = page.voxels.astype(np.int32)
    np.savez_compressed(file, voxels=voxels, colors=page.colors, grid=grid)


def _write_vox(file: BinaryIO, page: LitPage) -> str | None:
    """Write a MagicaVoxel file; what is longer than 256 voxels becomes several models."""
    index, palette, remark = vox_palette(page.colors)
    sides = np.array(page.pixels.shape[2::-1])
    cells = page.voxels // VOX_SIDE
    chunks: list[bytes] = []
    places: list[NDArray[np.integer]] = []
    for cell in np.ndindex(*(-(-sides // VOX_SIDE))):
        inside = (cells == cell).all(axis=1)
        start = np.array(cell) * VOX_SIDE
        size = np.minimum(sides - start, VOX_SIDE)
        if not inside.any() and (chunks or (sides > VOX_SIDE).any()):
            continue
        local = np.column_stack((page.voxels[inside] - start, index[inside])).astype(np.uint8)
        chunks += [
            vox_chunk(b"SIZE", struct.pack("<3i", *size.tolist())),
            vox_chunk(b"XYZI", struct.pack("<i", len(local)) + local.tobytes()),
        ]
        places.append(start + size // 2)
    if (sides > VOX_SIDE).any():
        chunks += _scene_graph(places)
    chunks.append(vox_chunk(b"RGBA", palette.tobytes()))
    file.write(b"VOX " + struct.pack("<i", 150) + vox_chunk(b"MAIN", b"", b"".join(chunks)))
    return remark


def vox_chunk(kind: bytes, content: bytes, children: bytes = b"") -> bytes:
    """Return a chunk of a MagicaVoxel file."""
    return kind + struct.pack("<2i", len(content), len(children)) + content + children


def _scene_graph(places: list[NDArray[np.integer]]) -> list[bytes]:
    """Return chunks that place each model: a root, a group, and a pair of nodes for each."""
    none = struct.pack("<i", 0)
    children = struct.pack(f"<{len(places)}i", *range(2, 2 + 2 * len(places), 2))
    chunks = [
        vox_chunk(b"nTRN", struct.pack("<i", 0) + none + struct.pack("<4i", 1, -1, -1, 1) + none),
        vox_chunk(b"nGRP", struct.pack("<i", 1) + none + struct.pack("<i", len(places)) + children),
    ]
    for model, place in enumerate(places):
        node = 2 + 2 * model
        text = " ".join(map(str, place.tolist())).encode()
        move = struct.pack("<2i", 1, 2) + b"_t" + struct.pack("<i", len(text)) + text
        chunks += [
            vox_chunk(b"nTRN", struct.pack("<i", node) + none
                   + struct.pack("<4i", node + 1, -1, 0, 1) + move),
            vox_chunk(b"nSHP", struct.pack("<i", node + 1) + none
                   + struct.pack("<2i", 1, model) + none),
        ]  # fmt: skip
    return chunks


def vox_palette(
    colors: NDArray[np.uint8],
) -> tuple[NDArray[np.uint8], NDArray[np.uint8], str | None]:
    """Return colour indices, 1 to 255, the palette, (256, 4), and a remark if it lacks colours."""
    found, index = np.unique(colors, axis=0, return_inverse=True)
    index = index.reshape(-1)
    remark = None
    if len(found) > _COLORS:
        remark = f"its palette has {_COLORS} colours, of {len(found)}: the nearest are kept"
        group = _groups(found, _COLORS)
        index = group[index]
        count = np.bincount(index, minlength=_COLORS)
        sums = [np.bincount(index, colors[:, channel], _COLORS) for channel in range(3)]
        found = np.rint(np.stack(sums, axis=1) / count[:, None]).astype(np.uint8)
    palette = np.zeros((256, 4), dtype=np.uint8)
    palette[:, 3] = 255
    palette[: len(found), :3] = found
    return (index + 1).astype(np.uint8), palette, remark


def _groups(colors: NDArray[np.uint8], count: int) -> Ints:
    """Return a number below `count` for each of more distinct colours.

    The group with the longest side is halved along it (after Heckbert's median cut, 1982).
    """
    groups = [np.arange(len(colors))]
    sides = [np.ptp(colors, axis=0)]
    while len(groups) < count:
        widest = int(np.argmax([side.max() for side in sides]))
        rows, channel = groups[widest], int(np.argmax(sides[widest]))
        values = colors[rows, channel].astype(np.int64)
        upper = values > (values.min() + values.max()) // 2
        halves = [rows[~upper], rows[upper]]
        groups[widest : widest + 1] = halves
        sides[widest : widest + 1] = [np.ptp(colors[half], axis=0) for half in halves]
    number = np.empty(len(colors), dtype=np.int64)
    for i, rows in enumerate(groups):
        number[rows] = i
    return number


def _write_ply(file: BinaryIO, page: LitPage) -> None:
    """Write the outer faces of all voxels, as squares that are turned outward."""
    corners, colors = _faces(page)
    packed = (colors.astype(np.int64) << np.array([16, 8, 0])).sum(axis=1)
    keyed = np.column_stack((corners.reshape(-1, 3), np.repeat(packed, 4)))
    vertices, index = np.unique(keyed, axis=0, return_inverse=True)
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment voxels of voxdisplay\n"
        f"element vertex {len(vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\n"
        f"element face {len(corners)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    file.write(header.encode("ascii"))
    points = np.zeros(len(vertices), dtype=[("xyz", "<f4", 3), ("rgb", "u1", 3)])
    points["xyz"] = vertices[:, :3]
    points["rgb"] = vertices[:, 3:] >> np.array([16, 8, 0]) & 255
    faces = np.zeros(len(corners), dtype=[("count", "u1"), ("index", "<i4", 4)])
    faces["count"] = 4
    faces["index"] = index.reshape(-1, 4)
    file.write(points.tobytes() + faces.tobytes())


def _faces(page: LitPage) -> tuple[Ints, NDArray[np.uint8]]:
    """Return the corners, (n, 4, 3), of all faces between a lit voxel and a dark one."""
    nz, ny, nx = page.pixels.shape[:3]
    lit = np.zeros((nz + 2, ny + 2, nx + 2), dtype=bool)
    x, y, z = page.voxels.T + 1
    lit[z, y, x] = True
    corners, colors = [], []
    for axis in range(3):
        first, second = np.eye(3, dtype=np.int64)[[(axis + 1) % 3, (axis + 2) % 3]]
        square = np.array([0 * first, first, first + second, second])
        for side in (0, 1):
            step = np.zeros(3, dtype=np.int64)
            step[axis] = 2 * side - 1
            open_side = ~lit[z + step[2], y + step[1], x + step[0]]
            start = page.voxels[open_side].astype(np.int64)
            start[:, axis] += side
            corners.append(start[:, None] + (square if side else square[::-1]))
            colors.append(page.colors[open_side])
    return np.concatenate(corners), np.concatenate(colors)


WRITERS: dict[str, Callable[[BinaryIO, LitPage], str | None]] = {
    ".npy": _write_npy,
    ".npz": _write_npz,
    ".vox": _write_vox,
    ".ply": _write_ply,
}
"""Writers by the suffixes of files."""

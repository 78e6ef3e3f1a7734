"""Readers of Qubicle (.qb), KV6 (.kv6) and binvox files (.binvox).

All are turned so that z is up, by rotations: nothing is mirrored.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from voxdisplay.errors import BodyError
from voxdisplay.files.byte_reader import ByteReader
from voxdisplay.files.contents import MAX_LIT, ModelVoxels

_MAX_MATRICES = 1 << 12
_MAX_CELLS = 1 << 28
_MAX_SIDE = 1 << 14
_MAX_PLACE = 1 << 24
_CODE, _NEXT_SLICE = 2, 6


def read_qb(name: str, data: bytes) -> ModelVoxels:
    """Read a Qubicle Binary file, version 1.1: y is up, its matrices are placed side by side.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    data : bytes
        What is in it.

    Raises
    ------
    BodyError
        If it is none; the message names file and place.

    """
    reader = ByteReader(name, data)
    version, bgra, right_handed, compressed, masks, count = reader.integers(6, "the header", "I")
    if version != 0x101 or max(bgra, right_handed, compressed, masks) > 1:
        raise BodyError(f"{name} is not a Qubicle file of version 1.1")
    if count > _MAX_MATRICES:
        raise reader.error(f"{count} matrices")
    places, colors = [], []
    cells = 0
    for _ in range(count):
        reader.bytes(reader.integer("the length of a name", "B"), "a name")
        size = np.array(reader.integers(3, "the size of a matrix", "I"), dtype=np.int64)
        start = np.array(reader.integers(3, "the place of a matrix"), dtype=np.int64)
        cells += (
            int(size[0] * size[1] * size[2]) if size.max(initial=0) <= _MAX_SIDE else _MAX_CELLS
        )
        if cells >= _MAX_CELLS or np.abs(start).max() > _MAX_PLACE:
            raise reader.error(
                f"a matrix of {' x '.join(map(str, size))} cells at {start.tolist()}"
            )
        words = _read_slices(reader, size) if compressed else reader.array(
            int(size.prod()), "<u4", "a matrix")  # fmt: skip
        lit = np.flatnonzero(words >> np.uint32(24))
        z, y, x = np.unravel_index(lit, size[::-1]) if lit.size else (lit, lit, lit)
        places.append(np.stack((x, y, z), axis=1) + start)
        channels = words[lit, None] >> np.array([16, 8, 0] if bgra else [0, 8, 16], np.uint32)
        colors.append((channels & 255).astype(np.uint8))
    found = np.concatenate(places) if places else np.empty((0, 3), dtype=np.int64)
    # From y up to z up. With z away from the viewer the axes are left-handed: an exchange of two
    # of them makes them right-handed, and mirrors nothing.
    x, y, z = found.T
    turned = np.stack((x, -z if right_handed else z, y), axis=1)
    return _model(name, turned, np.concatenate(colors) if colors else None)


def _read_slices(reader: ByteReader, size: NDArray[np.int64]) -> NDArray[np.uint32]:
    """Return the cells of a compressed matrix: runs and single cells, slice by slice."""
    area = int(size[0] * size[1])
    cells = np.zeros((int(size[2]), area), dtype=np.uint32)
    for row in cells:
        at = 0
        while (word := reader.integer("a cell", "I")) != _NEXT_SLICE:
            count, color = reader.integers(2, "a run", "I") if word == _CODE else (1, word)
            if count > area - at:
                raise reader.error(f"a run of {count} cells in a slice with room for {area - at}")
            row[at : at + count] = color
            at += count
    return cells.reshape(-1)


def read_kv6(name: str, data: bytes) -> ModelVoxels:
    """Read a KV6 file: voxels of the surface, in columns; z is down.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    data : bytes
        What is in it.

    Raises
    ------
    BodyError
        If it is none; the message names file and place.

    """
    reader = ByteReader(name, data)
    if reader.bytes(4, "the file's mark") != b"Kvxl":
        raise BodyError(f"{name} is not a KV6 file")
    nx, ny, nz = reader.integers(3, "the size", "I")
    if not (0 < nx <= _MAX_SIDE and 0 < ny <= _MAX_SIDE and 0 < nz <= 1 << 16):
        raise reader.error(f"a size of {nx} x {ny} x {nz}")
    reader.bytes(12, "the pivot")
    count = reader.integer("the number of voxels", "I")
    record = [("bgr", "u1", 3), ("filler", "u1"), ("z", "<u2"), ("rest", "u1", 2)]
    cells = reader.array(count, record, "voxels")
    reader.array(nx, "<u4", "lengths along x")
    lengths = reader.array(nx * ny, "<u2", "lengths along y").astype(np.int64)
    if lengths.sum() != count:
        raise reader.error(f"columns of {lengths.sum()} voxels in a file of {count}")
    column = np.repeat(np.arange(nx * ny), lengths)
    down = cells["z"].astype(np.int64)
    if count and int(down.max()) >= nz:
        raise reader.error(f"a voxel at depth {down.max()} of {nz}")
    # x to the right, z down: y points to the viewer. A half turn around x.
    places = np.stack((column // ny, ny - 1 - column % ny, nz - 1 - down), axis=1)
    return _model(name, places, np.ascontiguousarray(cells["bgr"][:, ::-1]))


_BINVOX = re.compile(rb"#binvox (\d{1,3})\s")
_BINVOX_DIM = re.compile(rb"\ndim (\d{1,9}) (\d{1,9}) (\d{1,9})\s")


def read_binvox(name: str, data: bytes) -> ModelVoxels:
    """Read a binvox file: runs of cells, y fastest, then z, then x.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    data : bytes
        What is in it.

    Raises
    ------
    BodyError
        If it is none; the message names file and place.

    """
    head, mark, _ = data[:4096].partition(b"\ndata\n")
    dim = _BINVOX_DIM.search(head + b"\n")
    if not (_BINVOX.match(head) and dim and mark):
        raise BodyError(f"{name} is not a binvox file, or its header is incomplete")
    nx, nz, ny = (int(side) for side in dim.groups())
    cells = nx * ny * nz
    if not 0 < cells <= 1 << 31:
        raise BodyError(f"{name}: {nx} x {nz} x {ny} cells")
    reader = ByteReader(name, data, len(head) + len(mark))
    runs = reader.array(reader.left // 2 * 2, "u1", "runs").reshape(-1, 2)
    ends = np.cumsum(runs[:, 1], dtype=np.int64)
    total = int(ends[-1]) if len(ends) else 0
    if total != cells or reader.left:
        raise BodyError(f"{name}: its runs cover {total} of {cells} cells: the file is damaged")
    lit = runs[:, 0] > 0
    count = int(runs[lit, 1].sum(dtype=np.int64))
    if count > MAX_LIT:
        raise BodyError(f"{name} has {count} voxels, more than {MAX_LIT}")
    lengths = runs[lit, 1].astype(np.int64)
    first = np.repeat(ends[lit] - lengths, lengths)
    index = first + np.arange(count) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    x, rest = np.divmod(index, nz * ny)
    return _model(name, np.stack((x, rest % ny, rest // ny), axis=1), None)


def _model(name: str, places: NDArray[np.integer], colors: NDArray[np.uint8] | None) -> ModelVoxels:
    if not len(places):
        raise BodyError(f"{name} holds no voxels")
    if len(places) > MAX_LIT:
        raise BodyError(f"{name} has {len(places)} voxels, more than {MAX_LIT}")
    return ModelVoxels(places.astype(np.int32), colors)

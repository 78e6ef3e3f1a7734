"""Readers of arrays: .npy, .npz and .raw. Nothing in them is evaluated or unpickled.

Nothing is allocated for what a header claims before it is compared with what there is.
"""

from __future__ import annotations

import io
import math
import re
import zipfile
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from voxdisplay.errors import BodyError
from voxdisplay.files.bounded_unpacking import check_ratio
from voxdisplay.files.contained_files import short_name
from voxdisplay.files.contents import MAX_BYTES, ModelVoxels, VolumeSamples
from voxdisplay.files.guarded_calls import guarded

_DESCR = re.compile(rb"'descr' *: *'([<>|=]?[fiub][1248])'")
_ORDER = re.compile(rb"'fortran_order' *: *(True|False)")
_SHAPE = re.compile(rb"'shape' *: *\(((?: *\d{1,18} *,){0,9}(?: *\d{1,18} *)?)\)")
_MAX_MEMBERS = 1000
_HEADER_BYTES = 1 << 16


def read_npy(name: str, data: bytes) -> NDArray[Any]:
    """Return the array of real numbers in a .npy file, of any shape.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    data : bytes
        What is in it.

    Raises
    ------
    BodyError
        If it is none, holds Python objects or records, or has another length than it says.

    """
    kind, shape, fortran, start = _npy_header(name, data)
    numbers = np.frombuffer(data, np.uint8, offset=min(start, len(data)))
    wanted = math.prod(shape) * kind.itemsize
    if len(numbers) != wanted:
        raise BodyError(f"{name} claims {wanted} bytes of numbers and holds {len(numbers)}")
    found = numbers.view(kind)
    return found.reshape(shape[::-1]).T if fortran else found.reshape(shape)


def _npy_header(name: str, data: bytes) -> tuple[np.dtype[Any], tuple[int, ...], bool, int]:
    """Return type, shape, order of axes, and where the numbers begin."""
    version = data[6:7]
    begin = 10 if version == b"\x01" else 12
    if data[:6] != b"\x93NUMPY" or version not in {b"\x01", b"\x02", b"\x03"} or len(data) < begin:
        raise BodyError(f"{name} is not a .npy file")
    start = begin + int.from_bytes(data[8:begin], "little")
    header = data[begin : min(start, begin + _HEADER_BYTES)]
    descr, order, shape = (pattern.search(header) for pattern in (_DESCR, _ORDER, _SHAPE))
    if b"'|O'" in header or b"'O'" in header:
        raise BodyError(f"{name} holds Python objects, which are not read: they could be programs")
    if not (descr and order and shape):
        raise BodyError(f"{name} is not an array of real numbers", hint="save it with numpy.save")
    try:
        kind = np.dtype(descr[1].decode())
    except TypeError:
        raise BodyError(f"{name} has numbers of the kind {descr[1].decode()}") from None
    sides = tuple(int(side) for side in shape[1].split(b",") if side.strip())
    return kind, sides, order[1] == b"True", start


def read_npz(name: str, data: bytes) -> ModelVoxels | VolumeSamples:
    """Read a .npz file: voxels with their colours, or the one volume in it.

    Voxels are arrays named ``voxels``, (N, 3), columns x, y, z, and perhaps ``colors``, (N, 3).

    Parameters
    ----------
    name : str
        Of the file, for errors.
    data : bytes
        What is in it.

    Raises
    ------
    BodyError
        If it is none, or has no such array.

    """
    found: ModelVoxels | VolumeSamples = guarded(
        name, "the archive", lambda: _read_archive(name, data)
    )
    return found


def _read_archive(name: str, data: bytes) -> ModelVoxels | VolumeSamples:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
        if len(members) > _MAX_MEMBERS:
            raise BodyError(f"{name} has {len(members)} members")
        if "voxels" in members:
            wanted = [key for key in ("voxels", "colors") if key in members]
            return _voxels(name, *(_member(name, archive, members[key]) for key in wanted))
        volumes = [
            key for key, info in members.items() if _dimensions(name, archive, info) in {3, 4}
        ]
        if len(volumes) != 1:
            found = ", ".join(map(short_name, volumes[:5])) or "none"
            raise BodyError(
                f"{name} should hold one array of three axes, and holds {found}",
                hint="or arrays named voxels, (N, 3), and colors, (N, 3)",
            )
        label = f"{name}:{short_name(volumes[0])}"
        return samples_of(label, _member(name, archive, members[volumes[0]]))


def _dimensions(name: str, archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> int:
    """Return how many axes an array in an archive has; 0 for what is no array."""
    try:
        with archive.open(info) as member:
            return len(_npy_header(name, member.read(1024))[1])
    except BodyError:
        return 0


def _member(name: str, archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> NDArray[Any]:
    label = f"{name}:{short_name(info.filename)}"
    if info.file_size > MAX_BYTES:
        raise BodyError(f"{label} is larger than {MAX_BYTES >> 20} MiB")
    check_ratio(label, info.file_size, info.compress_size)
    with archive.open(info) as member:
        head = member.read(_HEADER_BYTES)
        kind, shape, _, start = _npy_header(label, head)
        wanted = math.prod(shape) * kind.itemsize + start
        if wanted != info.file_size:
            raise BodyError(f"{label} claims {wanted} bytes and holds {info.file_size}")
        return read_npy(label, head + member.read(wanted + 1 - len(head)))


def _voxels(name: str, voxels: NDArray[Any], colors: NDArray[Any] | None = None) -> ModelVoxels:
    if voxels.ndim != 2 or voxels.shape[1] != 3 or voxels.dtype.kind not in "iu":
        raise BodyError(f"{name}: voxels are whole numbers, (N, 3), not {voxels.shape}")
    if not len(voxels):
        raise BodyError(f"{name} holds no voxels")
    if np.abs(voxels.astype(np.float64)).max() >= 1 << 30:
        raise BodyError(f"{name}: a voxel is further away than 2^30")
    if colors is not None and (colors.shape != voxels.shape or colors.dtype != np.uint8):
        raise BodyError(f"{name}: colors are uint8, {voxels.shape}, as the voxels are")
    return ModelVoxels(voxels.astype(np.int32), colors)


def samples_of(name: str, array: NDArray[Any]) -> ModelVoxels | VolumeSamples:
    """Return an array as a volume, or as coloured voxels if it has a last axis of 3 bytes.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    array : (nz, ny, nx) array, or (nz, ny, nx, 3) uint8 array
        Voxels of which all three bytes are 0 are dark.

    Raises
    ------
    BodyError
        If it is neither.

    """
    if array.ndim == 4 and array.shape[3] == 3 and array.dtype == np.uint8:
        lit = array.any(axis=3)
        if not lit.any():
            raise BodyError(f"{name} is dark everywhere")
        return ModelVoxels(np.argwhere(lit)[:, ::-1].astype(np.int32), array[lit])
    if array.ndim != 3 or not array.size:
        shape = " x ".join(map(str, array.shape)) or "a single number"
        raise BodyError(f"{name}: a volume has three axes, indexed [z, y, x]; this is {shape}")
    return VolumeSamples(array)


def read_raw(
    name: str, data: bytes, shape: Sequence[int] | None, dtype: str | None
) -> VolumeSamples:
    """Read a file of bare numbers.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    data : bytes
    shape : (nz, ny, nx)
    dtype : str
        As numpy names it: ``"uint8"``, ``"<i2"``, ``">f4"``, ...

    Raises
    ------
    BodyError
        If shape or type are missing or wrong, or the file has another length.

    """
    if shape is None or dtype is None:
        raise BodyError(
            f"{name} is bare numbers: give shape, [nz, ny, nx], and dtype, such as uint16",
        )
    if not re.fullmatch(r"[<>=|]?(?:[fiu]\d|u?int\d{1,2}|float\d\d|bool)", dtype):
        raise BodyError(f"dtype: expected such as uint16, <i2 or >f4, found {dtype[:40]!r}")
    try:
        kind = np.dtype(dtype)
    except TypeError:
        raise BodyError(f"dtype: there is no type {dtype!r}") from None
    if len(shape) != 3 or min(shape) < 1:
        raise BodyError(f"shape: expected three whole numbers [nz, ny, nx], found {list(shape)}")
    wanted = math.prod(shape) * kind.itemsize
    if wanted != len(data):
        sides = " x ".join(map(str, shape))
        raise BodyError(f"{name} has {len(data)} bytes; {sides} of {kind} are {wanted}")
    return VolumeSamples(np.frombuffer(data, kind).reshape(tuple(shape)))

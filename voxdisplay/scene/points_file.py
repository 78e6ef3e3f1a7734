"""Files of points beside a scene: .csv and .npy, never outside the scene's folder.

The files are as little trusted as the scene: nothing is allocated for what a header claims, and
nothing in them is evaluated. Does not know what the points are for.
"""

from __future__ import annotations

import os
import re
import stat
from array import array
from pathlib import Path, PureWindowsPath
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.errors import CurveError, did_you_mean
from voxdisplay.expressions.parse import excerpt

if TYPE_CHECKING:
    from numpy.typing import NDArray

MAX_BYTES = 16 << 20
"""Largest file: a million points or so, which is more than a display has along any curve."""


def read_points(folder: Path, name: str) -> NDArray[np.float64]:
    """Read a file of points.

    Parameters
    ----------
    folder : Path
        The scene's folder.
    name : str
        The file's path relative to it: ``.csv``, three columns x, y, z of numbers, perhaps under
        a line that says so; or ``.npy``, shape (n, 3), real numbers of any type.

    Returns
    -------
    (n, 3) float64 array
        All finite.

    Raises
    ------
    CurveError
        If the file is outside the folder (links are followed first), is missing, is no regular
        file or is larger than `MAX_BYTES`; or if it is not such points. The message names the
        file, and the line or row.

    """
    read = _READERS.get(name[-4:].lower())
    if read is None:
        raise CurveError(f"{excerpt(name)} is neither a .csv nor a .npy file")
    try:
        data = _bytes(folder, name)
    except FileNotFoundError:
        hint = did_you_mean(name, _beside(folder))
        raise CurveError(f"there is no file {excerpt(name)} beside the scene", hint=hint) from None
    except CurveError:
        raise
    except (OSError, ValueError, RuntimeError) as error:  # of links in a loop, of a NUL
        what = error.strerror if isinstance(error, OSError) else error
        raise CurveError(f"cannot read {excerpt(name)}: {what}") from error
    points = read(name, data)
    wrong = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if wrong.size:
        raise CurveError(f"point {wrong[0]} of {excerpt(name)} is not finite")
    return points


def _bytes(folder: Path, name: str) -> bytes:
    """Read a whole file inside a folder."""
    parts = PureWindowsPath(name)  # knows / and \ and drives, on any system
    if parts.is_absolute() or parts.anchor or ".." in parts.parts:
        raise CurveError(f"{excerpt(name)} is outside the scene's folder")
    root = folder.resolve()
    path = (root / name).resolve(strict=True)
    if not path.is_relative_to(root):
        raise CurveError(f"{excerpt(name)} leads outside the scene's folder")
    # Not blocking, so that a pipe put there cannot hold us up before it is found to be one.
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(handle, "rb") as file:
        status = os.fstat(handle)
        if not stat.S_ISREG(status.st_mode):
            raise CurveError(f"{excerpt(name)} is not a regular file")
        data = file.read(MAX_BYTES + 1)
    if len(data) > MAX_BYTES:
        raise CurveError(f"{excerpt(name)} is larger than {MAX_BYTES >> 20} MiB")
    return data


def _beside(folder: Path) -> list[str]:
    with os.scandir(folder) as entries:
        return [entry.name for entry, _ in zip(entries, range(1000), strict=False)]


def _csv(name: str, data: bytes) -> NDArray[np.float64]:
    numbers = array("d")
    for i, line in enumerate(data.removeprefix(b"\xef\xbb\xbf").splitlines(), start=1):
        if not line.strip():
            continue
        fields = line.split(b",")
        try:
            x, y, z = map(float, fields)
        except ValueError:
            if not numbers and [field.strip(b' "').lower() for field in fields] == [
                b"x",
                b"y",
                b"z",
            ]:
                continue
            wrong = excerpt(line.decode("utf-8", "replace"))
            raise CurveError(f"{excerpt(name)}, line {i}: {wrong} is not three numbers") from None
        numbers.extend((x, y, z))
    return np.array(numbers, dtype=np.float64).reshape(-1, 3)


# numpy's own reader makes an array of whatever shape the header claims, and evaluates the header.
_NPY_DESCR = re.compile(rb"'descr' *: *'([<>|=]?[fiu][1248])'")
_NPY_ORDER = re.compile(rb"'fortran_order' *: *(True|False)")
_NPY_SHAPE = re.compile(rb"'shape' *: *\(([0-9, ]{0,60})\)")


def _npy(name: str, data: bytes) -> NDArray[np.float64]:
    version = data[6:7]
    start = 10 if version == b"\x01" else 12
    if data[:6] != b"\x93NUMPY" or version not in {b"\x01", b"\x02", b"\x03"} or len(data) < start:
        raise CurveError(f"{excerpt(name)} is not a .npy file")
    end = start + int.from_bytes(data[8:start], "little")
    header = data[start:end]
    descr, order, shape = (
        pattern.search(header) for pattern in (_NPY_DESCR, _NPY_ORDER, _NPY_SHAPE)
    )
    if not (descr and order and shape):
        raise CurveError(f"{excerpt(name)} is not an array of real numbers")
    sides = [int(side) for side in shape[1].split(b",") if side.strip()]
    if len(sides) != 2 or sides[1] != 3:
        raise CurveError(f"{excerpt(name)} has shape ({shape[1].decode()}), not (n, 3)")
    try:
        numbers = np.frombuffer(data, dtype=descr[1].decode(), offset=end)
    except (TypeError, ValueError):  # TypeError: f1
        numbers = np.empty(0)
    if numbers.size != sides[0] * 3:
        raise CurveError(f"{excerpt(name)} does not hold the {sides[0]} points that it claims")
    points = numbers.reshape(3, -1).T if order[1] == b"True" else numbers.reshape(-1, 3)
    return points.astype(np.float64)


_READERS = {".csv": _csv, ".npy": _npy}

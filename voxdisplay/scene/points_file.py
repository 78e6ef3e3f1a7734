"""Files of points beside a scene: text tables and .npy arrays, never outside the scene's folder.

The files are as little trusted as the scene: nothing is allocated for what a header claims, and
nothing in them is evaluated. It must not know what the points are for.
"""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path, PurePath, PureWindowsPath
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.errors import CurveError, similar_file
from voxdisplay.expressions.parse import excerpt
from voxdisplay.scene.point_table import GAPS_HINT, FilePoints, read_table, split_strands

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

MAX_BYTES = 16 << 20
"""Largest file: a million points or so, which is more than a display has along any curve."""

MAX_STRANDS = 10_000
"""Most strands of one file: each is a curve."""

_TABLES = (".csv", ".txt", ".tsv", ".dat", ".xyz", ".asc", ".pts")


def read_points(
    folder: Path, name: str, *, split: bool = False, wanted: Sequence[str] = ()
) -> FilePoints:
    """Read a file of points.

    Parameters
    ----------
    folder : Path
        The scene's folder.
    name : str
        The file's path relative to it: a text table, as `read_table` takes it; or ``.npy``, shape
        (n, 3), real numbers of any type.
    split : bool
        Whether rows that are empty or not finite separate strands; else they are errors.
    wanted : sequence of str
        Names of further columns that are read if the table has them.

    Raises
    ------
    CurveError
        If the file is outside the folder (links are followed first), is missing, is no regular
        file or is larger than `MAX_BYTES`; or if it is not such points. The message names the
        file, and the line or row.

    """
    kind = PurePath(name).suffix.lower()
    if kind not in (*_TABLES, ".npy"):
        kinds = f"{', '.join(_TABLES)} or .npy"
        raise CurveError(f"{excerpt(name)} is not a file of points: {kinds}")
    try:
        data = _read_file(folder, name)
    except FileNotFoundError:
        hint = similar_file(name, _names_in(folder))
        raise CurveError(f"there is no file {excerpt(name)} beside the scene", hint=hint) from None
    except CurveError:
        raise
    except (OSError, ValueError, RuntimeError) as error:  # of links in a loop, of a NUL
        what = error.strerror if isinstance(error, OSError) else error
        raise CurveError(f"cannot read {excerpt(name)}: {what}") from error
    if kind == ".npy":
        found = _read_array(name, data, split=split)
    else:
        found = read_table(name, data, split=split, wanted=wanted)
    if not len(found.points):
        comments = kind != ".npy" and re.search(rb"^\s*[#%]", data, re.MULTILINE)
        hint = "lines that begin with # or % are comments" if comments else None
        raise CurveError(f"{excerpt(name)} holds no points", hint=hint)
    if len(found.starts) > MAX_STRANDS:
        strands = f"{len(found.starts)} strands, more than {MAX_STRANDS}"
        raise CurveError(f"{excerpt(name)} holds {strands}")
    return found


def _read_array(name: str, data: bytes, *, split: bool) -> FilePoints:
    points = _parse_npy(name, data)
    wrong = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if wrong.size and not split:
        raise CurveError(f"row {wrong[0]} of {excerpt(name)} is not finite", hint=GAPS_HINT)
    return FilePoints(*split_strands(points, []))


def _read_file(folder: Path, name: str) -> bytes:
    """Read a whole file inside a folder."""
    parts = PureWindowsPath(name)  # knows / and \ and drives, on any system
    if parts.is_absolute() or parts.anchor or ".." in parts.parts:
        raise CurveError(f"{excerpt(name)} is outside the scene's folder")
    root = folder.resolve()
    path = (root / name).resolve(strict=True)
    if not path.is_relative_to(root):
        raise CurveError(f"{excerpt(name)} leads outside the scene's folder")
    # Not blocking: else opening a pipe would wait for a writer.
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(handle, "rb") as file:
        status = os.fstat(handle)
        if not stat.S_ISREG(status.st_mode):
            raise CurveError(f"{excerpt(name)} is not a regular file")
        data = file.read(MAX_BYTES + 1)
    if len(data) > MAX_BYTES:
        raise CurveError(f"{excerpt(name)} is larger than {MAX_BYTES >> 20} MiB")
    return data


def _names_in(folder: Path) -> list[str]:
    with os.scandir(folder) as entries:
        return [entry.name for entry, _ in zip(entries, range(1000), strict=False)]


# numpy's own reader makes an array of whatever shape the header claims, and evaluates the header.
_NPY_DESCR = re.compile(rb"'descr' *: *'([<>|=]?[fiu][1248])'")
_NPY_ORDER = re.compile(rb"'fortran_order' *: *(True|False)")
_NPY_SHAPE = re.compile(rb"'shape' *: *\(((?: *\d{1,18} *,){0,9}(?: *\d{1,18} *)?)\)")


def _parse_npy(name: str, data: bytes) -> NDArray[np.float64]:
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
        hint = "save an array of shape (n, 3), of floats or integers"
        raise CurveError(f"{excerpt(name)} is not an array of real numbers", hint=hint)
    sides = [int(side) for side in shape[1].split(b",") if side.strip()]
    if len(sides) != 2 or sides[1] != 3:
        problem = f"{excerpt(name)} has shape ({shape[1].decode()}), not (n, 3)"
        raise CurveError(problem, hint=_reshaping_hint(sides))
    try:
        numbers = np.frombuffer(data, dtype=descr[1].decode(), offset=end)
    except (TypeError, ValueError):  # TypeError: f1
        numbers = np.empty(0)
    if numbers.size != sides[0] * 3:
        raise CurveError(f"{excerpt(name)} does not hold the {sides[0]} points that it claims")
    points = numbers.reshape(3, -1).T if order[1] == b"True" else numbers.reshape(-1, 3)
    return points.astype(np.float64)


def _reshaping_hint(sides: list[int]) -> str | None:
    """Return what makes points of an array of another shape; None if that is not known."""
    if len(sides) == 2 and sides[0] == 3:
        return "save array.T"
    if len(sides) == 2 and sides[1] > 3:
        return "save array[:, :3]"
    if len(sides) == 2 and sides[1] == 2:
        return "save numpy.insert(array, 2, 0, axis=1) for z = 0"
    return "save array.reshape(-1, 3)" if len(sides) > 2 and sides[-1] == 3 else None

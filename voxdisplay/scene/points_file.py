"""Files of points beside a scene: text tables and .npy arrays, never outside the scene's folder.

The files are as little trusted as the scene: nothing is allocated for what a header claims, and
nothing in them is evaluated. It must not know what the points are for.
"""

from __future__ import annotations

import re
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.errors import CurveError
from voxdisplay.expressions.parse import excerpt
from voxdisplay.files.array_files import read_npy
from voxdisplay.files.contained_files import read_inside
from voxdisplay.scene.point_table import GAPS_HINT, read_table
from voxdisplay.scene.strands import Strands, split_strands

if TYPE_CHECKING:
    from collections.abc import Sequence

MAX_BYTES = 16 << 20
"""Largest file: a million points or so, which is more than a display has along any curve."""

MAX_STRANDS = 10_000
"""Most strands of one file: each is a curve."""

_TABLES = (".csv", ".txt", ".tsv", ".dat", ".xyz", ".asc", ".pts")


def read_points(
    folder: Path, name: str, *, split: bool = False, wanted: Sequence[str] = ()
) -> Strands:
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
        If it is not such points. The message names the file, and the line or row.
    BodyError
        If the file is outside the folder (links are followed first), is missing, is no regular
        file or is larger than `MAX_BYTES`; or if it is no array.

    """
    kind = PurePath(name).suffix.lower()
    if kind not in (*_TABLES, ".npy"):
        kinds = f"{', '.join(_TABLES)} or .npy"
        raise CurveError(f"{excerpt(name)} is not a file of points: {kinds}")
    data = read_inside(folder, name, MAX_BYTES)
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


def _read_array(name: str, data: bytes, *, split: bool) -> Strands:
    array = read_npy(excerpt(name), data)
    if array.ndim != 2 or array.shape[1] != 3:
        problem = f"{excerpt(name)} has shape {array.shape}, not (n, 3)"
        raise CurveError(problem, hint=_reshaping_hint(array.shape))
    points = array.astype(np.float64)
    wrong = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if wrong.size and not split:
        raise CurveError(f"row {wrong[0]} of {excerpt(name)} is not finite", hint=GAPS_HINT)
    return Strands(*split_strands(points, []))


def _reshaping_hint(sides: tuple[int, ...]) -> str | None:
    """Return what makes points of an array of another shape; None if that is not known."""
    if len(sides) == 2 and sides[0] == 3:
        return "save array.T"
    if len(sides) == 2 and sides[1] > 3:
        return "save array[:, :3]"
    if len(sides) == 2 and sides[1] == 2:
        return "save numpy.insert(array, 2, 0, axis=1) for z = 0"
    return "save array.reshape(-1, 3)" if len(sides) > 2 and sides[-1] == 3 else None

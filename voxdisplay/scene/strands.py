"""Strands of points: those that are joined, with further columns of a table.

It must not know files, nor what the points are for.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from voxdisplay.compute.array_types import Floats


class Strands(NamedTuple):
    """Points in strands, which are joined each by itself.

    Attributes
    ----------
    points : (n, 3) float64 array
        All finite.
    starts : (k,) int64 array
        Index of the first point of each strand; empty if there is no point.
    note : str or None
        What was taken for x, y and z, if there was a choice.
    columns : mapping of str to (n,) float64 array
        Further columns that were wanted, by name; nan where there is no number.

    """

    points: Floats
    starts: NDArray[np.int64]
    note: str | None = None
    columns: Mapping[str, Floats] = MappingProxyType({})

    def separate(self) -> list[tuple[Floats, dict[str, Floats]]]:
        """Return points, (n, 3), and columns, (n,) each, of every strand by itself."""
        ends = [*self.starts[1:].tolist(), len(self.points)]
        parts = [slice(start, end) for start, end in zip(self.starts.tolist(), ends, strict=True)]
        return [
            (self.points[part], {name: each[part] for name, each in self.columns.items()})
            for part in parts
        ]


def split_strands(points: Floats, gaps: list[int]) -> tuple[Floats, NDArray[np.int64]]:
    """Return the finite points, and the index of the first point of each strand.

    Parameters
    ----------
    points : (n, 3) float64 array
        A row that is not finite separates strands.
    gaps : list of int
        Rows before which another strand begins, too.

    """
    if not gaps and np.isfinite(points).all():
        return points, np.zeros(min(1, len(points)), dtype=np.int64)
    begins = np.zeros(len(points) + 1, dtype=np.bool_)
    begins[gaps] = True
    kept = np.flatnonzero(np.isfinite(points).all(axis=1))
    first = begins[kept] | (np.diff(kept, prepend=-2) > 1)
    return points[kept], np.flatnonzero(first)

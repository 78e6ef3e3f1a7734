"""Layout of the parts of one display: its grid, where parts overlap or leave a hole, a drawing.

Must not know ports or devices.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from voxdisplay.display.part_profile import PartProfile
from voxdisplay.raster.grid import Grid

_LETTERS: Final = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdef"
_HOLE, _OVERLAP = ".", "#"
_MAX_NAMED = 4
_MAX_LAYERS, _MAX_CELLS = 4, 40  # of a drawing


class Box(NamedTuple):
    """A box of voxels in which the same parts lie.

    Attributes
    ----------
    low, high : tuple of int
        Its lowest voxel, and the highest one.
    parts : tuple of int
        Numbers of the parts that lie there.

    """

    low: tuple[int, int, int]
    high: tuple[int, int, int]
    parts: tuple[int, ...]

    def __str__(self) -> str:
        return ", ".join(
            f"{axis} {low} to {high}" if low != high else f"{axis} {low}"
            for axis, low, high in zip("xyz", self.low, self.high, strict=True)
        )


class PartLayout:
    """Places of parts in the display that they make up.

    Parameters
    ----------
    parts : sequence of PartProfile
        At least one.

    Attributes
    ----------
    grid : Grid
        The smallest grid from voxel (0, 0, 0) on that has room for all.

    Raises
    ------
    ValueError
        If that is larger than any display may be.

    """

    def __init__(self, parts: Sequence[PartProfile]) -> None:
        self.parts = tuple(parts)
        ends = np.array([np.add(part.at, part.size) for part in parts])
        self.grid = Grid.of(ends.max(axis=0).tolist())
        corners = np.array([part.at for part in parts])
        self._edges = [
            np.unique(np.concatenate(([0], corners[:, axis], ends[:, axis]))) for axis in range(3)
        ]
        # Cells between all edges, [z, y, x]: in how many parts they lie, and in which.
        shape = tuple(len(edges) - 1 for edges in reversed(self._edges))
        self._counts = np.zeros(shape, dtype=np.uint8)
        self._owner = np.full(shape, -1, dtype=np.int8)
        for number, (corner, end) in enumerate(zip(corners, ends, strict=True)):
            where = tuple(
                slice(*np.searchsorted(self._edges[axis], (corner[axis], end[axis])))
                for axis in (2, 1, 0)
            )
            self._counts[where] += 1
            self._owner[where] = np.where(self._owner[where] < 0, number, self._owner[where])

    @property
    def is_whole(self) -> bool:
        """True if each voxel lies in exactly one part."""
        return bool((self._counts == 1).all())

    @property
    def hole_voxels(self) -> int:
        """Number of voxels in no part."""
        return self._voxels(self._counts == 0)

    @property
    def overlap_voxels(self) -> int:
        """Number of voxels in several parts."""
        return self._voxels(self._counts > 1)

    def _voxels(self, cells: NDArray[np.bool_]) -> int:
        return int(self._cell_voxels[cells].sum())

    @property
    def _cell_voxels(self) -> NDArray[np.int64]:
        """Number of voxels of each cell."""
        x, y, z = (np.diff(edges) for edges in self._edges)
        return np.asarray(z[:, None, None] * y[:, None] * x)

    def covered(self, index: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return which voxels, scan-order indices (n,), lie in a part."""
        columns = self.grid.voxels_at(index).T
        cells = [
            np.searchsorted(edges, column, side="right") - 1
            for edges, column in zip(self._edges, columns, strict=True)
        ]
        return np.asarray(self._counts[cells[2], cells[1], cells[0]] > 0)

    def faults(self) -> list[str]:
        """Return a line on each overlap and hole, the largest first, and on how many are left."""
        cells = np.argwhere(self._counts != 1)
        sizes = self._cell_voxels[self._counts != 1]
        largest = cells[np.argsort(-sizes, kind="stable")[:_MAX_NAMED]]
        lines = [self._fault(self._box(cell)) for cell in largest.tolist()]
        if len(cells) > len(lines):
            lines.append(f"and so at {len(cells) - len(lines)} more places")
        return lines

    def _fault(self, box: Box) -> str:
        if not box.parts:
            return f"no part lies at {box}: what is drawn there is not shown"
        names = [self.parts[number].name for number in box.parts]
        both = f"{', '.join(names[:-1])} and {names[-1]}"
        return f"{both} overlap at {box}: each shows what is drawn there"

    def _box(self, cell: list[int]) -> Box:
        """Return the box of a cell [z, y, x]."""
        x, y, z = (
            (int(edges[at]), int(edges[at + 1]) - 1)
            for edges, at in zip(self._edges, reversed(cell), strict=True)
        )
        low, high = (x[0], y[0], z[0]), (x[1], y[1], z[1])
        parts = tuple(
            number
            for number, part in enumerate(self.parts)
            if all(
                at <= below < at + side
                for at, below, side in zip(part.at, low, part.size, strict=True)
            )
        )
        return Box(low, high, parts)

    def drawing(self) -> str:
        """Return the layers of the display from above, x to the right and y upwards.

        Each part has a letter; a hole is a dot, an overlap a #. A cell is no voxel: rows, columns
        and layers lie between the edges of parts.
        """
        lines = [
            ", ".join(f"{_LETTERS[number]} {part.name}" for number, part in enumerate(self.parts))
            + f"; {_HOLE} no part, {_OVERLAP} several"
        ]
        x_edges, y_edges, z_edges = self._edges
        faulty = np.flatnonzero((self._counts != 1).any(axis=(1, 2)))
        layers = (faulty if len(faulty) else np.arange(len(z_edges) - 1))[:_MAX_LAYERS].tolist()
        for z in layers:
            lines.append(f"z {_span(z_edges, z)}:")
            rows = list(range(len(y_edges) - 1))[:_MAX_CELLS]
            width = max(len(_span(y_edges, y)) for y in rows)
            for y in reversed(rows):
                cells = [self._mark(z, y, x) for x in range(len(x_edges) - 1)[:_MAX_CELLS]]
                lines.append(f"  y {_span(y_edges, y):<{width}}  {' '.join(cells)}")
        columns = ", ".join(_span(x_edges, x) for x in range(len(x_edges) - 1)[:_MAX_CELLS])
        lines.append(f"  columns: x {columns}")
        return "\n".join(lines)

    def _mark(self, z: int, y: int, x: int) -> str:
        count = int(self._counts[z, y, x])
        if count == 1:
            return _LETTERS[int(self._owner[z, y, x])]
        return _OVERLAP if count else _HOLE


def _span(edges: NDArray[np.int64], at: int) -> str:
    """Return the voxels between two edges: ``"0-63"``."""
    return f"{edges[at]}-{edges[at + 1] - 1}"

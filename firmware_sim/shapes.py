"""Voxels of LINE, BOX and OCT (7.3, 7.4), as indices in scan order.

Draws nothing; checking the grid is left to the caller. Voxels of a brick are identified by their
position in it, x + 16 y + 256 z, until all its masks are read: the largest brick has a side of 16,
so positions can be added without a carry from one axis to the next.
"""

from array import array
from collections.abc import Callable, Iterable, Iterator
from functools import cache, reduce
from itertools import repeat
from operator import add
from typing import Final

from firmware_sim import spec
from firmware_sim.grid import Grid

_SIDE: Final = 1 << spec.LIMIT_MAX_LEVEL
_PLACES: Final = _SIDE**3
_LEVELS: Final = range(spec.LIMIT_MAX_LEVEL + 1)


def _brick_index(x: int, y: int, z: int) -> int:
    return x + _SIDE * (y + _SIDE * z)


def _children(level: int, mask: int) -> tuple[int, ...]:
    half = 1 << level >> 1
    return tuple(half * _brick_index(c & 1, c >> 1 & 1, c >> 2) for c in range(8) if mask >> c & 1)


@cache
def _children_by_mask(level: int) -> list[tuple[int, ...]]:
    """Return the positions of a node's children by its mask.

    Mask 00 has none, but at the lowest level it writes all voxels as FF does.
    """
    children = [_children(level, mask) for mask in range(256)]
    if level == 1:
        children[0] = children[0xFF]
    return children


# By level: the positions at which the rows of a cube begin.
_ROWS: Final = [
    [_brick_index(0, y, z) for z in range(1 << level) for y in range(1 << level)]
    for level in _LEVELS
]


def line(grid: Grid, start: int, target: tuple[int, int, int]) -> "array[int]":
    """Return the voxels of a LINE (7.3).

    Parameters
    ----------
    grid
        The grid.
    start
        Index of the first voxel.
    target
        Coordinates of the last one.

    Returns
    -------
    array of type ``"Q"``
        Their indices, in this order.
    """
    deltas = [q - p for p, q in zip(grid.coordinates(start), target, strict=True)]
    length = max(map(abs, deltas))
    axes: list[Iterable[int]] = [repeat(start)]
    for delta, stride in zip(deltas, grid.strides, strict=True):
        if abs(delta) == length:
            sign = stride if delta > 0 else -stride
            axes.append(range(0, sign * (length + 1), sign))
        elif delta:
            numerators = range(length, length + 2 * delta * (length + 1), 2 * delta)
            axes.append([n // (2 * length) * stride for n in numerators])
    return array("Q", reduce(lambda one, other: map(add, one, other), axes))


def box(grid: Grid, start: int, target: tuple[int, int, int]) -> Iterator[tuple[range, int]]:
    """Return the voxels of a BOX (7.3) as runs in scan order.

    Parameters
    ----------
    grid
        The grid.
    start
        Index of one corner.
    target
        Coordinates of the other.

    Yields
    ------
    starts : range
        Index of the first voxel of each run.
    count : int
        Length of each of these runs.
    """
    corners = zip(grid.coordinates(start), target, strict=True)
    spans = [(min(corner), max(corner)) for corner in corners]
    first = grid.index(*(low for low, _ in spans))
    axes = [(high - low + 1, s) for (low, high), s in zip(spans, grid.strides, strict=True)]
    count = 1
    while axes and axes[0][1] == count:  # whole rows or planes are one run
        count *= axes.pop(0)[0]
    (many, near), (few, far) = sorted([*axes, (1, 1), (1, 1)], reverse=True)[:2]
    for begin in range(first, first + few * far, far):
        yield range(begin, begin + many * near, near), count


class Brick:
    """The voxels of an OCT (7.4).

    Parameters
    ----------
    level
        0 to 4.
    masks
        Called for each level of nodes with the number of masks; returns them.

    Attributes
    ----------
    rows : list of (int, list of int)
        Length of rows along x, and the positions in the brick at which such rows begin.
    """

    def __init__(self, level: int, masks: Callable[[int], bytes]) -> None:
        self._side = 1 << level
        self.rows: list[tuple[int, list[int]]] = []
        nodes = [0]
        for j in range(level, 0, -1):
            found = masks(len(nodes))
            if j > 1 and 0 in found:
                full = [node for node, mask in zip(nodes, found, strict=True) if not mask]
                self.rows.append((1 << j, [node + row for node in full for row in _ROWS[j]]))
            children = _children_by_mask(j)
            nodes = [
                node + child
                for node, mask in zip(nodes, found, strict=True)
                for child in children[mask]
            ]
        self.rows.append((1, nodes))

    def fits(self, room: tuple[int, int, int]) -> bool:
        """Return whether all voxels are below a limit on each axis.

        Parameters
        ----------
        room
            The limits on x, y and z, relative to the brick; they may be below 1.
        """
        if min(room) >= self._side:
            return True
        x, y, z = room
        return all(
            place % _SIDE + count <= x and place // _SIDE % _SIDE < y and place // _SIDE**2 < z
            for count, places in self.rows
            for place in places
        )


def brick_offsets(grid: Grid) -> list[int]:
    """Return the index offset of each position in a brick from the brick's first voxel."""
    x, y, z = grid.strides
    return [
        place % _SIDE * x + place // _SIDE % _SIDE * y + place // _SIDE**2 * z
        for place in range(_PLACES)
    ]

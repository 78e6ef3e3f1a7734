"""Orientation of a display: signed permutation of the axes between its user and its memory.

Must not know frames or devices.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from voxdisplay.argument_checks import wrong_kind
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import Pixels
from voxdisplay.raster.sparse_raster import SparseRaster

_WANTED = "write three axes of the memory, such as x,-z,y: each of x, y and z once"


class Orientation(NamedTuple):
    """How the memory of a display stands, seen by its user.

    Attributes
    ----------
    axes : tuple of int
        Axis of the memory, 0 to 2, along which the user's x, y and z run.
    flips : tuple of bool
        Which of the user's axes run against it.

    """

    axes: tuple[int, int, int]
    flips: tuple[bool, bool, bool]

    @classmethod
    def of(cls, axes: str | Sequence[str]) -> Self:
        """Return the orientation of a text ``"x,-z,y"``, or of a list ``["x", "-z", "y"]``.

        Parameters
        ----------
        axes : str or sequence of str
            Where the user's x, y and z run in the memory.

        Raises
        ------
        TypeError
            If it is neither.
        ValueError
            If an axis is missing, named twice or unknown.

        """
        if isinstance(axes, str):
            axes = axes.split(",")
        if not isinstance(axes, list | tuple) or not all(isinstance(each, str) for each in axes):
            raise wrong_kind("axes", "three of 'x', '-x', 'y', '-y', 'z', '-z'", axes)
        names = [each.strip().lower() for each in axes]
        text = ", ".join(names)
        if len(names) != 3:
            raise ValueError(f"axes: expected three, found {len(names)} ({text}); {_WANTED}")
        for name in names:
            if not re.fullmatch("[+-]?[xyz]", name):
                raise ValueError(f"axes: {name[:20]!r} is no axis; {_WANTED}")
        letters = [name[-1] for name in names]
        for letter in letters:
            if letters.count(letter) > 1:
                missing = ", ".join(sorted(set("xyz") - set(letters)))
                raise ValueError(
                    f"axes: {letter} is named twice, and {missing} is missing ({text}); {_WANTED}"
                )
        x, y, z = ("xyz".index(letter) for letter in letters)
        flip_x, flip_y, flip_z = (name.startswith("-") for name in names)
        return cls((x, y, z), (flip_x, flip_y, flip_z))

    def __str__(self) -> str:
        return ",".join(self.names)

    @property
    def names(self) -> list[str]:
        """Axes of the memory, such as ``["x", "-z", "y"]``."""
        return [
            ("-" if flip else "") + "xyz"[axis]
            for axis, flip in zip(self.axes, self.flips, strict=True)
        ]

    @property
    def mirrors(self) -> bool:
        """True if no rotation leads from one to the other."""
        x, y, z = self.axes
        odd = (x, y, z) not in {(0, 1, 2), (1, 2, 0), (2, 0, 1)}
        return (sum(self.flips) % 2 == 1) != odd

    def user_grid(self, memory: Grid) -> Grid:
        """Return the grid that the user of a memory sees."""
        return Grid(*(memory[axis] for axis in self.axes))

    def memory_grid(self, user: Grid) -> Grid:
        """Return the grid of the memory that a user sees."""
        sides = [0, 0, 0]
        for axis, side in zip(self.axes, user, strict=True):
            sides[axis] = side
        return Grid(*sides)

    def memory_index(self, index: NDArray[np.int64], user: Grid) -> NDArray[np.int64]:
        """Return the scan-order indices, (n,), in memory of voxels with those of the user, (n,)."""
        memory = self.memory_grid(user)
        strides = (1, memory.nx, memory.nx * memory.ny)
        found = np.zeros(len(index), dtype=np.int64)
        columns = user.voxels_at(index).T
        for column, side, axis, flip in zip(columns, user, self.axes, self.flips, strict=True):
            at = column.astype(np.int64)
            found += strides[axis] * (side - 1 - at if flip else at)
        return found

    def to_user(self, memory: NDArray[Any]) -> NDArray[Any]:
        """Return an array of the memory, [z, y, x] with more axes or none, as its user sees it."""
        return self._flipped(memory.transpose(self._order(memory.ndim)))

    def to_memory(self, user: NDArray[Any]) -> NDArray[Any]:
        """Return an array of the user, [z, y, x] with more axes or none, as the memory has it."""
        return self._flipped(user).transpose(np.argsort(self._order(user.ndim)))

    def _order(self, dimensions: int) -> list[int]:
        """Return the axis of a memory's array for each axis of the user's."""
        return [2 - self.axes[2 - axis] for axis in range(3)] + list(range(3, dimensions))

    def _flipped(self, user: NDArray[Any]) -> NDArray[Any]:
        return np.flip(user, tuple(2 - axis for axis in range(3) if self.flips[axis]))

    def memory_raster(self, raster: SparseRaster) -> SparseRaster:
        """Return a user's raster as the memory holds it; the order of voxels is kept."""
        found = SparseRaster(self.memory_grid(raster.grid), raster.format)
        if raster.page is not None:
            shape = raster.format.shape(raster.grid.array_shape)
            turned = self.to_memory(raster.page.pixels.reshape(shape))
            flat = raster.format.shape((raster.grid.voxels,))
            pixels: Pixels = np.ascontiguousarray(turned).reshape(flat)
            found.set(pixels)
        if (drawn := raster.visible) is not None:
            found.draw(replace(drawn, index=self.memory_index(drawn.index, raster.grid)))
        return found


UPRIGHT = Orientation.of("x,y,z")

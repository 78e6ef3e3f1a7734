"""Grid of the display: sides, scan order, and index offsets of the steps of chains (2, 7.1).

Knows nothing of pixels.
"""

from dataclasses import dataclass, field

from firmware_sim import spec


@dataclass(frozen=True)
class Grid:
    """A grid of nx by ny by nz voxels.

    Parameters
    ----------
    nx, ny, nz
        Number of voxels along each axis, 1 to 65535, and 0x7FFFFFFF in all at most.

    Attributes
    ----------
    sides : tuple of int
        (nx, ny, nz).
    strides : tuple of int
        Index offset of a step on each axis.
    volume : int
        Number of voxels, V.
    coordinate_size : int
        Number of bytes of a coordinate in an op, 1 or 2.

    Raises
    ------
    ValueError
        If the protocol has no such grid.
    """

    nx: int
    ny: int
    nz: int
    sides: tuple[int, int, int] = field(init=False, repr=False, compare=False)
    strides: tuple[int, int, int] = field(init=False, repr=False, compare=False)
    volume: int = field(init=False, repr=False, compare=False)
    coordinate_size: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        sides = (self.nx, self.ny, self.nz)
        volume = self.nx * self.ny * self.nz
        if not all(1 <= side <= spec.LIMIT_MAX_SIDE for side in sides):
            raise ValueError(f"a grid of {self}: take sides from 1 to {spec.LIMIT_MAX_SIDE} voxels")
        if volume > spec.LIMIT_MAX_VOXELS:
            raise ValueError(
                f"a grid of {self}: take one of {spec.LIMIT_MAX_VOXELS} voxels or less"
            )
        for name, value in (
            ("sides", sides),
            ("strides", (1, self.nx, self.nx * self.ny)),
            ("volume", volume),
            ("coordinate_size", 1 if max(sides) <= 256 else 2),
        ):
            object.__setattr__(self, name, value)  # as a frozen dataclass requires

    def __str__(self) -> str:
        return f"{self.nx}x{self.ny}x{self.nz}"

    def contains(self, x: int, y: int, z: int) -> bool:
        """Return whether a voxel with non-negative coordinates is on the grid."""
        return x < self.nx and y < self.ny and z < self.nz

    def index(self, x: int, y: int, z: int) -> int:
        """Return the index of a voxel on the grid."""
        return x + self.nx * (y + self.ny * z)

    def coordinates(self, index: int) -> tuple[int, int, int]:
        """Return the coordinates x, y, z of the voxel with an index."""
        row, x = divmod(index, self.nx)
        z, y = divmod(row, self.ny)
        return x, y, z

    def chain_leaves(self, index: int, octant: int, moves: tuple[int, int, int]) -> bool:
        """Return whether a chain leaves the grid.

        All its steps go in one direction on each axis, so it suffices to check the last voxel.

        Parameters
        ----------
        index
            The chain's first voxel.
        octant
            0 to 23, section 7.1.
        moves
            Number of steps that move on the main axis, on the next one, and on the third.
        """
        main = octant >> 3
        start = self.coordinates(index)
        for k, count in enumerate(moves):
            axis = (main + k) % 3
            end = start[axis] + (-count if octant >> axis & 1 else count)
            if not 0 <= end < self.sides[axis]:
                return True
        return False

    def crumb_offsets(self, octant: int) -> tuple[int, int, int, int]:
        """Return the index offset of each of the four crumbs.

        Parameters
        ----------
        octant
            0 to 23, section 7.1.
        """
        main = octant >> 3
        ahead, second, third = (
            -self.strides[axis] if octant >> axis & 1 else self.strides[axis]
            for axis in (main, (main + 1) % 3, (main + 2) % 3)
        )
        return ahead, ahead + second, ahead + third, ahead + second + third

"""Test patterns, and what a page that was read back says of a display's axes.

An axis that a device swaps with another or mirrors is seen at once: x is red and has one tick at
its far end, y green with two, z blue with three; a corner has the colours of the axes on whose far
end it lies. Knows frames and pages, and no device.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.frame import Frame
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat, Pixels

Voxels = NDArray[np.int64]

RED, GREEN, BLUE = AXIS_COLORS = ((255, 0, 0), (0, 255, 0), (0, 0, 255))
_WHITE, _GREY = (255, 255, 255), (96, 96, 96)
# A side shorter than this has no room for ticks.
_MIN_SIDE_FOR_TICKS = 8

NAMES = ("axes", "corners", "plane", "all")
BRIGHTNESS = {"axes": 1.0, "corners": 1.0, "plane": 0.5, "all": 0.05}


@dataclass(frozen=True, slots=True)
class PatternFrame:
    """One frame of a pattern.

    Attributes
    ----------
    frame : Frame
    axes : str
        Of which axes the frame, read back, can tell: letters of ``"xyz"``.
    telling : bool
        Whether it is worth reading back: of a marching plane, only some steps are.

    """

    frame: Frame
    axes: str
    verify: bool = True


def pattern_frames(
    name: str,
    grid: Grid,
    format: PixelFormat,  # noqa: A002 - the word of the command line
    brightness: float,
) -> Iterator[PatternFrame]:
    """Give the frames of a pattern, one of `NAMES`, in order.

    Parameters
    ----------
    name : str
    grid : Grid
    format : PixelFormat
    brightness : float
        0 to 1. A format that has nothing so dark gives its darkest light.

    """
    paint = _Painter(grid, format, brightness)
    match name:
        case "axes":
            yield PatternFrame(paint.axes(), "xyz")
        case "corners":
            yield PatternFrame(paint.corners(), "xyz")
        case "plane":
            for axis, side in enumerate(grid):
                for at in range(side):
                    telling = at in {0, side // 2, side - 1}
                    yield PatternFrame(paint.plane(axis, at), "xyz"[axis], telling)
        case _:
            yield PatternFrame(paint.all(), "")


def axes_with_ticks(grid: Grid) -> str:
    """Return the axes, letters of ``"xyz"``, that have room for ticks in the pattern ``"axes"``."""
    return "".join(
        name
        for name, side, across in zip("xyz", grid, (grid.nz, grid.nz, grid.nx), strict=True)
        if side >= _MIN_SIDE_FOR_TICKS and across >= 3
    )


class _Painter:
    """Makes frames of patterns."""

    def __init__(self, grid: Grid, format_: PixelFormat, brightness: float) -> None:
        self._grid, self._format, self._brightness = grid, format_, brightness

    def _dimmed(self, color: tuple[int, int, int]) -> NDArray[np.uint8]:
        """Give the colour, as dark as asked, but not dark: (1, 3)."""
        share = self._brightness
        while True:
            dim = np.floor(np.array([color]) * share + 0.5).astype(np.uint8)
            shown = self._format.rgb(self._format.nearest(dim))
            if (shown.astype(bool) >= np.array([color], dtype=bool)).all() or share >= 1:
                return dim
            share = min(1.0, share * 1.25 + 0.001)

    def axes(self) -> Frame:
        frame = Frame(self._grid, self._format)
        for axis, color in enumerate(AXIS_COLORS):
            line = np.zeros((self._grid[axis], 3), dtype=np.int64)
            line[:, axis] = np.arange(self._grid[axis])
            for voxels in (line, *self._ticks(axis)):
                frame.draw(voxels, self._dimmed(color))
        frame.draw(np.zeros((1, 3), dtype=np.int64), self._dimmed(_WHITE))
        return frame

    def _ticks(self, axis: int) -> Iterator[Voxels]:
        """Give one tick at the far end of x, two of y, three of z, across the axis."""
        if "xyz"[axis] not in axes_with_ticks(self._grid):
            return
        across = 0 if axis == 2 else 2
        room = self._grid[across]
        for number in range(axis + 1):
            tick = np.zeros((max(1, room // 10), 3), dtype=np.int64)
            tick[:, axis] = self._grid[axis] - 1 - 2 * number
            tick[:, across] = 1 + np.arange(len(tick))
            yield tick

    def corners(self) -> Frame:
        frame = Frame(self._grid, self._format)
        # In this order a side of one voxel shows its near end.
        for far in itertools.product((1, 0), repeat=3):
            ranges = []
            for end, side in zip(far, self._grid, strict=True):
                edge = max(1, side // 12)
                ranges.append(np.arange(side - edge, side) if end else np.arange(edge))
            cube = np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1).reshape(-1, 3)
            color = (255 * far[0], 255 * far[1], 255 * far[2]) if any(far) else _GREY
            frame.draw(cube, self._dimmed(color))
        return frame

    def plane(self, axis: int, at: int) -> Frame:
        array = self._dark()
        where: list[slice | int] = [slice(None)] * 3
        where[2 - axis] = at
        array[tuple(where)] = self._pixel(AXIS_COLORS[axis])
        return self._framed(array)

    def all(self) -> Frame:
        array = self._dark()
        array[...] = self._pixel(_WHITE)
        return self._framed(array)

    def _dark(self) -> Pixels:
        return np.zeros(self._format.shape(self._grid.array_shape), dtype=self._format.dtype)

    def _pixel(self, color: tuple[int, int, int]) -> Pixels:
        return np.asarray(self._format.pixels(self._format.nearest(self._dimmed(color)))[0])

    def _framed(self, array: Pixels) -> Frame:
        frame = Frame(self._grid, self._format)
        frame.set(array)
        return frame


@dataclass(frozen=True, slots=True)
class AxisFinding:
    """What a page says of one axis.

    Attributes
    ----------
    axis : str
        ``"x"``, ``"y"`` or ``"z"``.
    right : bool or None
        Whether what lies along the axis was found where it should be; None when the pattern would
        look the same if it were not.
    shown : str or None
        Where it was found: ``"+x"`` is right, ``"-x"`` mirrored, ``"+y"`` swapped; None when the
        page is no mirrored or swapped pattern.

    """

    axis: str
    right: bool | None
    shown: str | None


def compare_axes(meant: Pixels, got: Pixels, axes: str) -> list[AxisFinding]:
    """Compare a page that was read back with the pattern's.

    The page is compared with the pattern mirrored and swapped in all 48 ways, so that it can say
    which of them the device has made of it.

    Parameters
    ----------
    meant, got : ndarray
        Indexed [z, y, x].
    axes : str
        Letters of the axes that are asked for.

    """
    places, values = _lit(meant)
    whole = len(_lit(got)[0]) == len(places)
    matches = [way for way in _AXIS_MAPS if whole and _is_moved(places, values, meant, got, way)]
    found = []
    for axis in axes:
        number = "xyz".index(axis)
        ends = {(way[0][number], way[1][number]) for way in matches}
        if not ends:
            found.append(AxisFinding(axis, right=False, shown=None))
        elif (number, False) not in ends:
            onto, mirrored = min(ends)
            found.append(
                AxisFinding(axis, right=False, shown=("-" if mirrored else "+") + "xyz"[onto])
            )
        elif len(ends) > 1:
            found.append(AxisFinding(axis, right=None, shown=None))
        else:
            found.append(AxisFinding(axis, right=True, shown=f"+{axis}"))
    return found


# Onto which axis each of x, y, z comes, and whether it is mirrored there.
_AxisMap = tuple[tuple[int, ...], tuple[bool, ...]]
_AXIS_MAPS: list[_AxisMap] = [
    (onto, mirrored)
    for onto in itertools.permutations(range(3))
    for mirrored in itertools.product((False, True), repeat=3)
]


def _lit(page: Pixels) -> tuple[Voxels, Pixels]:
    """Give what is lit: places, (n, 3) with columns x, y, z, and pixels."""
    lit = page.any(axis=-1) if page.ndim == 4 else page != 0
    places = np.argwhere(lit)
    return places[:, ::-1], page[lit]


def _is_moved(places: Voxels, values: Pixels, meant: Pixels, got: Pixels, way: _AxisMap) -> bool:
    """Tell whether a page is another whose axes have been swapped and mirrored."""
    sides, moved = meant.shape[2::-1], np.empty_like(places)
    for axis, (onto, mirrored) in enumerate(zip(*way, strict=True)):
        if got.shape[2 - onto] != sides[axis]:
            return False
        column = places[:, axis]
        moved[:, onto] = sides[axis] - 1 - column if mirrored else column
    x, y, z = moved.T
    return bool((got[z, y, x] == values).all())

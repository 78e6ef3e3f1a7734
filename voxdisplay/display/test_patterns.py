"""Test patterns, and the check of a display's axes on a page that was read back.

An axis that a device mirrors or swaps with another is seen at once: x is red and has one tick at
its far end, y green with two, z blue with three; a corner has the colours of the axes on whose far
end it lies. Must not know devices.
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
# On a shorter one, the head of an arrow is as long as the rest of it, and looks the same both ways.
_MIN_SIDE_FOR_ARROWS = 5

NAMES = ("axes", "corners", "plane", "all")
BRIGHTNESS = {"axes": 1.0, "corners": 1.0, "plane": 0.5, "all": 0.05}


@dataclass(frozen=True, slots=True)
class PatternFrame:
    """One frame of a pattern.

    Attributes
    ----------
    frame : Frame
    axes : str
        Axes that can be checked on it: letters of ``"xyz"``.
    verify : bool
        Whether to read it back: of a marching plane, a few positions are enough.

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
    """Yield the frames of a pattern.

    Parameters
    ----------
    name : str
        One of `NAMES`.
    grid : Grid
    format : PixelFormat
    brightness : float
        0 to 1. A format that has nothing so dark shows its darkest light.

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
                    verify = at in {0, side // 2, side - 1}
                    yield PatternFrame(paint.plane(axis, at), "xyz"[axis], verify)
        case _:
            yield PatternFrame(paint.all(), "")


def arrow_frame(
    axis: int,
    grid: Grid,
    format: PixelFormat,  # noqa: A002 - as above
    brightness: float,
) -> Frame:
    """Return an arrow along an axis, 0 to 2, of the memory, in the colour of that axis.

    On a grid without room for arrows, see `has_room_for_arrows`, it is the layer at the far end.
    """
    paint = _Painter(grid, format, brightness)
    return paint.arrow(axis) if has_room_for_arrows(grid) else paint.plane(axis, grid[axis] - 1)


def has_room_for_arrows(grid: Grid) -> bool:
    """Return whether a line with a pyramid at one end shows a direction on all axes."""
    return min(grid) >= _MIN_SIDE_FOR_ARROWS


def axes_with_ticks(grid: Grid) -> str:
    """Return the axes, letters of ``"xyz"``, that have room for ticks in the pattern ``"axes"``."""
    return "".join(
        name
        for name, side, across in zip("xyz", grid, (grid.nz, grid.nz, grid.nx), strict=True)
        if side >= _MIN_SIDE_FOR_TICKS and across >= 3
    )


class _Painter:
    """Maker of the frames of one grid, format and brightness."""

    def __init__(self, grid: Grid, format_: PixelFormat, brightness: float) -> None:
        self._grid, self._format, self._brightness = grid, format_, brightness

    def _dimmed(self, color: tuple[int, int, int]) -> NDArray[np.uint8]:
        """Return a colour, dimmed but not black, as a (1, 3) array."""
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
        """Yield the ticks across an axis at its far end: one for x, two for y, three for z."""
        if "xyz"[axis] not in axes_with_ticks(self._grid):
            return
        across = 0 if axis == 2 else 2
        room = self._grid[across]
        for number in range(axis + 1):
            tick = np.zeros((max(1, room // 10), 3), dtype=np.int64)
            tick[:, axis] = self._grid[axis] - 1 - 2 * number
            tick[:, across] = 1 + np.arange(len(tick))
            yield tick

    def arrow(self, axis: int) -> Frame:
        """Return an arrow in the middle: a line, with a pyramid whose tip is at the far end."""
        frame = Frame(self._grid, self._format)
        side = self._grid[axis]
        head = max(1, side // 3)
        for at in range(side):
            wide = max(0, side - 1 - at) if at >= side - 1 - head else 0
            ranges = [
                np.arange(max(0, across // 2 - wide), min(across, across // 2 + wide + 1))
                for across in self._grid
            ]
            ranges[axis] = np.array([at])
            slab = np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1).reshape(-1, 3)
            frame.draw(slab, self._dimmed(AXIS_COLORS[axis]))
        return frame

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
        array = self._blank()
        where: list[slice | int] = [slice(None)] * 3
        where[2 - axis] = at
        array[tuple(where)] = self._pixel(AXIS_COLORS[axis])
        return self._frame_of(array)

    def all(self) -> Frame:
        array = self._blank()
        array[...] = self._pixel(_WHITE)
        return self._frame_of(array)

    def _blank(self) -> Pixels:
        return np.zeros(self._format.shape(self._grid.array_shape), dtype=self._format.dtype)

    def _pixel(self, color: tuple[int, int, int]) -> Pixels:
        return np.asarray(self._format.pixels(self._format.nearest(self._dimmed(color)))[0])

    def _frame_of(self, array: Pixels) -> Frame:
        frame = Frame(self._grid, self._format)
        frame.set(array)
        return frame


@dataclass(frozen=True, slots=True)
class AxisFinding:
    """Result of the check of one axis.

    Attributes
    ----------
    axis : str
        ``"x"``, ``"y"`` or ``"z"``.
    correct : bool or None
        Whether the axis is where it should be; None when the pattern would look the same if it
        were not.
    found : str or None
        Where the axis was found: for x, ``"+x"`` is correct, ``"-x"`` mirrored, ``"+y"`` swapped;
        None when the page is no mirrored or swapped pattern.

    """

    axis: str
    correct: bool | None
    found: str | None


def compare_axes(expected: Pixels, found: Pixels, axes: str) -> list[AxisFinding]:
    """Check the axes of a pattern on a page that was read back.

    The page is compared with the 48 mirrored and swapped versions of the pattern, to report which
    of them the device displays.

    Parameters
    ----------
    expected, found : ndarray
        Pattern and page, indexed [z, y, x].
    axes : str
        Letters of the axes to check.

    """
    voxels, values = _lit_voxels(expected)
    same_count = len(_lit_voxels(found)[0]) == len(voxels)
    matches = [
        axis_map
        for axis_map in _AXIS_MAPS
        if same_count and _is_transformed(voxels, values, expected, found, axis_map)
    ]
    findings = []
    for axis in axes:
        number = "xyz".index(axis)
        images = {(onto[number], mirrored[number]) for onto, mirrored in matches}
        if not images:
            findings.append(AxisFinding(axis, correct=False, found=None))
        elif (number, False) not in images:
            onto_axis, is_mirrored = min(images)
            sign = "-" if is_mirrored else "+"
            findings.append(AxisFinding(axis, correct=False, found=sign + "xyz"[onto_axis]))
        elif len(images) > 1:
            findings.append(AxisFinding(axis, correct=None, found=None))
        else:
            findings.append(AxisFinding(axis, correct=True, found=f"+{axis}"))
    return findings


# Signed permutation of the axes: onto which axis each of x, y, z is mapped, and whether mirrored.
_AxisMap = tuple[tuple[int, ...], tuple[bool, ...]]
_AXIS_MAPS: list[_AxisMap] = [
    (onto, mirrored)
    for onto in itertools.permutations(range(3))
    for mirrored in itertools.product((False, True), repeat=3)
]


def _lit_voxels(page: Pixels) -> tuple[Voxels, Pixels]:
    """Return the lit voxels, (n, 3) with columns x, y, z, and their pixels."""
    lit = page.any(axis=-1) if page.ndim == 4 else page != 0
    return np.argwhere(lit)[:, ::-1], page[lit]


def _is_transformed(
    voxels: Voxels, values: Pixels, expected: Pixels, found: Pixels, axis_map: _AxisMap
) -> bool:
    """Return whether all voxels are found with their values where the axis map puts them."""
    sides, moved = expected.shape[2::-1], np.empty_like(voxels)
    for axis, (onto, mirrored) in enumerate(zip(*axis_map, strict=True)):
        if found.shape[2 - onto] != sides[axis]:
            return False
        column = voxels[:, axis]
        moved[:, onto] = sides[axis] - 1 - column if mirrored else column
    x, y, z = moved.T
    return bool((found[z, y, x] == values).all())

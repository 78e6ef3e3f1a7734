"""Rendering as text: two pixels a character, by the upper half block and its background.

Returns strings; knows no terminal.
"""

from __future__ import annotations

import os
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.grid import Grid
from voxdisplay.view.axes_and_grid import AXIS_COLORS, outline_axes
from voxdisplay.view.camera import Camera
from voxdisplay.view.lit_voxels import LitVoxels
from voxdisplay.view.picture import RenderOptions, render_voxels

RESET = "\x1b[0m"
_UPPER_HALF = "\N{UPPER HALF BLOCK}"
# Rendered larger by this factor and reduced: thin lines keep their brightness.
_SUPERSAMPLING = 2
# From the middle of an axis to its name: across, and down in half characters.
_NAME_DISTANCE = (2.0, 2.5)
_HUE_WEIGHT = 1.5
# Nearer than for a window: the raster is small.
CAMERA = Camera(distance=2.2)

# The 6x6x6 colours and 24 greys that a terminal of 256 colours has from number 16 on.
_LEVELS = (0, 95, 135, 175, 215, 255)
_CUBE = np.array([(r, g, b) for r in _LEVELS for g in _LEVELS for b in _LEVELS])
_XTERM = np.concatenate((_CUBE, np.arange(8, 248, 10)[:, None].repeat(3, axis=1)))


def has_true_color(environment: Mapping[str, str] = os.environ) -> bool:
    """Return whether the terminal announces 24-bit colours, not only 256."""
    return environment.get("COLORTERM", "").lower() in {"truecolor", "24bit"}


def half_blocks(
    lit: LitVoxels,
    grid: Grid,
    columns: int,
    rows: int,
    *,
    camera: Camera = CAMERA,
    full: bool = True,
) -> list[str]:
    """Render lit voxels as lines of text.

    Parameters
    ----------
    lit : Lit
    grid : Grid
    columns, rows : int
        Characters.
    camera : Camera
    full : bool
        Use 24-bit colours; else the 256 that nearly every terminal has.

    Returns
    -------
    list of str
        ``rows`` lines without line ends; each ends with a reset of the colours.

    """
    size = columns * _SUPERSAMPLING, 2 * rows * _SUPERSAMPLING
    # Of 256 colours few are dark: a halo would be a stain of greys. Floor lines are finer than
    # characters.
    options = RenderOptions(size=size, camera=camera, glow=full, labels=False, floor=False)
    pixels = np.asarray(render_voxels(lit, grid, options).reduce(_SUPERSAMPLING))
    names = _axis_name_cells(grid, camera, columns, rows)
    codes = _color_codes(pixels, full=full)
    return [
        _line(codes[2 * row], codes[2 * row + 1], names.get(row, {}), full=full)
        for row in range(rows)
    ]


def _axis_name_cells(
    grid: Grid, camera: Camera, columns: int, rows: int
) -> dict[int, dict[int, int]]:
    """Return the cells of the axes' names, outside of the middle of each: row -> column -> axis."""
    found: dict[int, dict[int, int]] = {}
    for axis in outline_axes(grid, camera, (columns, 2 * rows)):
        x, y = np.add(axis.middle, np.multiply(axis.outward, _NAME_DISTANCE))
        column = min(max(0, int(x)), columns - 1)
        row = min(max(0, int(y / 2)), rows - 1)
        found.setdefault(row, {})[column] = axis.number
    return found


def _color_codes(pixels: NDArray[np.uint8], *, full: bool) -> list[list[str]]:
    """Return the parameters of each pixel's colour for SGR, to follow ``38;`` or ``48;``."""
    if full:
        return [[f"2;{r};{g};{b}" for r, g, b in row] for row in pixels.tolist()]
    flat, index = np.unique(pixels.reshape(-1, 3), axis=0, return_inverse=True)
    apart = ((_opponents(flat)[:, None, :] - _opponents(_XTERM)) ** 2).sum(axis=2)
    numbers = (16 + apart.argmin(axis=1))[index.reshape(pixels.shape[:2])]
    return [[f"5;{number}" for number in row] for row in numbers.tolist()]


def _opponents(colors: NDArray[np.integer]) -> NDArray[np.float64]:
    """Return colours, (n, 3), as brightness and two differences of hue, which count more."""
    red, green, blue = colors.astype(np.float64).T
    bright = 0.3 * red + 0.59 * green + 0.11 * blue
    return np.stack((bright, _HUE_WEIGHT * (red - bright), _HUE_WEIGHT * (blue - bright)), axis=1)


def _line(upper: list[str], lower: list[str], names: dict[int, int], *, full: bool) -> str:
    parts, front, back = [], "", ""
    for column, (top, bottom) in enumerate(zip(upper, lower, strict=True)):
        axis = names.get(column)
        character = " " if top == bottom else _UPPER_HALF
        if axis is not None:
            character = "xyz"[axis]
            top = _color_codes(np.array([[AXIS_COLORS[axis]]], np.uint8), full=full)[0][0]  # noqa: PLW2901
        if bottom != back:
            parts.append(f"\x1b[48;{bottom}m")
            back = bottom
        if top != front and character != " ":
            parts.append(f"\x1b[38;{top}m")
            front = top
        parts.append(character)
    return "".join(parts) + RESET

"""Background of a picture: the grid's bounding box, floor lines and axes on dark ground.

x is red, y green, z blue; each axis starts at voxel (0, 0, 0) and points to where its coordinate
grows. Knows no voxel.
"""

from __future__ import annotations

import functools
import itertools

import numpy as np

from voxdisplay.raster.grid import Grid
from voxdisplay.view.camera import Camera, Floats
from voxdisplay.view.pillow import Image, ImageDraw, ImageFont

Rgb = tuple[int, int, int]

BACKGROUND: Rgb = (7, 9, 14)
AXIS_COLORS: tuple[Rgb, Rgb, Rgb] = ((255, 84, 84), (72, 214, 112), (92, 148, 255))
_EDGE: Rgb = (92, 104, 128)
_FLOOR: Rgb = (60, 70, 92)
_TEXT: Rgb = (150, 160, 180)
# Length of an axis beyond the box, in longest sides: a flat grid's axes stay apart.
_AXIS_OVERHANG = 0.075
# Floor cells along the longest side, at most.
_MAX_FLOOR_CELLS = 8
# Lines are drawn larger by this factor and reduced: Pillow does not antialias.
_SUPERSAMPLING = 3
# Segments of a line, each of one brightness by its distance.
_FADE_STEPS = 12


@functools.lru_cache(maxsize=2)
def draw_stage(grid: Grid, camera: Camera, size: tuple[int, int], *, labels: bool) -> Image.Image:
    """Return the background. It is cached: do not draw on it."""
    pen = _Pen(grid, camera, size)
    pen.lines(_floor_lines(grid), _FLOOR, 0.9)
    pen.lines(_box_edges(grid), _EDGE, 1.0)
    ends = axis_tips(grid)
    for tip, color in zip(ends, AXIS_COLORS, strict=True):
        pen.arrow(np.zeros(3), tip, color, 1.7)
    image = Image.new("RGB", size, BACKGROUND)
    image.paste(pen.image.reduce(_SUPERSAMPLING), pen.corner)
    if labels:
        _draw_labels(image, ends, grid, camera)
    return image


def axis_tips(grid: Grid) -> Floats:
    """Return the end points of the three axes, (3, 3): rows x, y, z."""
    return np.diag(np.array(grid) + _AXIS_OVERHANG * max(grid))


def _box_edges(grid: Grid) -> list[tuple[Floats, Floats]]:
    """Return the nine edges of the box that are no axes."""
    corners = [np.array(corner) * grid for corner in itertools.product((0.0, 1.0), repeat=3)]
    return [
        (one, other)
        for one, other in itertools.combinations(corners, 2)
        if np.count_nonzero(one != other) == 1 and one.any()
    ]


def _floor_lines(grid: Grid) -> list[tuple[Floats, Floats]]:
    """Return lines on the floor, z = 0, a power of two voxels apart."""
    nx, ny, _ = grid
    step = 1
    while max(grid) > _MAX_FLOOR_CELLS * step:
        step *= 2
    along_y = [(np.array([x, 0.0, 0.0]), np.array([x, ny, 0.0])) for x in range(step, nx, step)]
    along_x = [(np.array([0.0, y, 0.0]), np.array([nx, y, 0.0])) for y in range(step, ny, step)]
    return along_y + along_x


class _Pen:
    """Draws lines between points of voxel space, fainter with distance."""

    def __init__(self, grid: Grid, camera: Camera, size: tuple[int, int]) -> None:
        self._grid, self._camera, self._size = grid, camera, size
        self._unit = _SUPERSAMPLING * max(1.0, min(size) / 600)
        self._middle = float(camera.project([np.array(grid) / 2], grid, size)[2][0])
        # Only the part of the picture that has lines and arrow heads.
        ends = np.vstack((axis_tips(grid), list(itertools.product(*((0, side) for side in grid)))))
        places = np.stack(camera.project(ends, grid, size)[:2])
        room = 3 + 3 * self._unit / _SUPERSAMPLING
        low = np.clip(np.floor(places.min(axis=1) - room), 0, np.array(size) - 1).astype(int)
        high = np.clip(np.ceil(places.max(axis=1) + room), low + 1, size).astype(int)
        self.corner = int(low[0]), int(low[1])
        width, height = ((high - low) * _SUPERSAMPLING).tolist()
        self.image = Image.new("RGB", (width, height), BACKGROUND)
        self._draw = ImageDraw.Draw(self.image)

    def _project(self, points: Floats) -> tuple[Floats, Floats]:
        x, y, scale = self._camera.project(points, self._grid, self._size)
        return (np.stack((x, y), axis=1) - self.corner) * _SUPERSAMPLING, scale / self._middle

    def lines(self, ends: list[tuple[Floats, Floats]], color: Rgb, width: float) -> None:
        """Draw lines in segments whose brightness shows their distance."""
        if not ends:
            return
        starts, stops = np.array(ends).swapaxes(0, 1)[:, :, None]
        along = starts + (stops - starts) * np.linspace(0, 1, _FADE_STEPS + 1)[:, None]
        points, near = self._project(along.reshape(-1, 3))
        near = near.reshape(len(ends), -1)
        fade = np.clip((near[:, :-1] + near[:, 1:]) / 2 * 1.55 - 0.95, 0.12, 1)
        mixed = (
            np.rint(BACKGROUND + np.subtract(color, BACKGROUND) * fade[..., None])
            .astype(int)
            .tolist()
        )
        thick = max(1, round(width * self._unit))
        for line, colors in zip(points.reshape(len(ends), -1, 2).tolist(), mixed, strict=True):
            for start, stop, fill in zip(line, line[1:], colors, strict=False):
                self._draw.line((*start, *stop), fill=tuple(fill), width=thick)

    def arrow(self, start: Floats, end: Floats, color: Rgb, width: float) -> None:
        """Draw an axis with its head."""
        points, _ = self._project(np.stack((start, end)))
        thick = width * self._unit
        along = points[1] - points[0]
        length = float(np.hypot(*along))
        if length < thick:
            return  # it points at the camera
        along /= length
        across = np.array([-along[1], along[0]])
        neck = points[1] - along * 5.5 * thick
        self._draw.line([tuple(points[0]), tuple(neck)], fill=color, width=round(thick))
        head = [points[1], neck + across * 2.1 * thick, neck - across * 2.1 * thick]
        self._draw.polygon([tuple(corner) for corner in head], fill=color)


def _draw_labels(image: Image.Image, ends: Floats, grid: Grid, camera: Camera) -> None:
    """Write the name and length of each axis at its tip."""
    draw = ImageDraw.Draw(image)
    height = max(9.0, min(image.size) / 40)
    font = ImageFont.load_default(height)
    points = np.stack(camera.project(np.vstack((np.zeros(3), ends)), grid, image.size)[:2], axis=1)
    for axis, (name, side) in enumerate(zip("xyz", grid, strict=True)):
        along = points[axis + 1] - points[0]
        along /= max(1.0, float(np.hypot(*along)))
        ahead = draw.textlength(name, font=font) + height * 0.45
        left, top, right, bottom = draw.textbbox((0, 0), f"{name}{side}", font=font)
        right += height * 0.45
        box = np.array([right - left, bottom - top])
        # The text's centre lies beyond the tip by what its box needs in that direction.
        middle = points[axis + 1] + along * (np.abs(along) @ box / 2 + 0.5 * height)
        corner = np.clip(middle - box / 2, 2, np.array(image.size) - box - 2) - (left, top)
        draw.text(tuple(corner), name, font=font, fill=AXIS_COLORS[axis])
        draw.text((corner[0] + ahead, corner[1]), str(side), font=font, fill=_TEXT)

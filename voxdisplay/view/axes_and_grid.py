"""Background of a picture: the grid's bounding box, floor lines and axes on dark ground.

x is red, y green, z blue; each axis lies on an edge of the box that is part of its outline, so that
neither it nor its label crosses what is in the box, and points to where its coordinate grows. Knows
no voxel.
"""

from __future__ import annotations

import functools
import itertools
import math
from typing import NamedTuple

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
# Length of an axis beyond the box, in longest sides.
_AXIS_OVERHANG = 0.075
# Edges that the camera sees before the box, against those behind it.
_FRONT_OPACITY = 0.35
# Corners that are less than this beyond an edge do not keep it from being part of the outline.
_OUTLINE_TOLERANCE_PX = 0.01
# Edges that are seen shorter than this, in shorter sides of the picture, get no axis.
_SHORTEST_AXIS = 0.05
# Floor cells along the longest side, at most.
_MAX_FLOOR_CELLS = 8
# Lines are drawn larger by this factor and reduced: Pillow does not antialias.
_SUPERSAMPLING = 3
# Segments of a line, each of one brightness by its distance.
_FADE_STEPS = 12


@functools.lru_cache(maxsize=2)
def draw_stage(
    grid: Grid, camera: Camera, size: tuple[int, int], *, labels: bool, floor: bool = True
) -> Image.Image:
    """Return the background, labels and floor lines optional. It is cached: do not draw on it."""
    pen = _Pen(grid, camera, size)
    axes = outline_axes(grid, camera, size)
    if floor:
        pen.lines(_floor_lines(grid), _FLOOR, 0.9)
    covered = {frozenset((axis.start, axis.end)) for axis in axes}
    front = _nearest_corner(grid, camera)
    for before in (False, True):
        edges = [
            (np.array(one), np.array(other))
            for one, other in _box_edges(grid)
            if frozenset((one, other)) not in covered and (front in (one, other)) == before
        ]
        pen.lines(edges, _EDGE, 1.0, _FRONT_OPACITY if before else 1.0)
    for axis in axes:
        start, end = np.array(axis.start), np.array(axis.end)
        tip = end + (end - start) * (_AXIS_OVERHANG * max(grid) / grid[axis.number])
        pen.arrow(start, tip, AXIS_COLORS[axis.number], 1.5)
    image = Image.new("RGB", size, BACKGROUND)
    image.paste(pen.image.reduce(_SUPERSAMPLING), pen.corner)
    if labels:
        for axis in axes:
            _draw_label(image, axis, grid[axis.number])
    return image


Corner = tuple[float, float, float]


class OutlineAxis(NamedTuple):
    """An edge of the box on which an axis is drawn.

    Attributes
    ----------
    number : int
        0 for x, 1 for y, 2 for z.
    start, end : Corner
        Its ends, x, y, z; the coordinate grows from start to end.
    middle : (x_px, y_px)
        The middle of the edge in the picture.
    outward : (dx, dy)
        Unit vector across the edge in the picture, away from the box.

    """

    number: int
    start: Corner
    end: Corner
    middle: tuple[float, float]
    outward: tuple[float, float]


def outline_axes(grid: Grid, camera: Camera, size: tuple[int, int]) -> list[OutlineAxis]:
    """Return the edge for each axis: of those in the box's outline the lowest, for z the leftmost.

    An axis that points at the camera has none.
    """
    corners = _corners(grid)
    x, y, _ = camera.project(corners, grid, size)
    points = dict(zip(corners, np.stack((x, y), axis=1), strict=True))
    found: dict[int, tuple[float, OutlineAxis]] = {}
    for start, end in _box_edges(grid):
        along = points[end] - points[start]
        length = float(np.hypot(*along))
        if length < _SHORTEST_AXIS * min(size):
            continue
        across = np.array([along[1], -along[0]]) / length
        beyond = np.array([(point - points[start]) @ across for point in points.values()])
        if beyond.min() < -_OUTLINE_TOLERANCE_PX:
            across, beyond = -across, -beyond
        if beyond.min() < -_OUTLINE_TOLERANCE_PX:
            continue
        number = int(np.argmax(np.subtract(end, start)))
        middle = (points[start] + points[end]) / 2
        rank = float(-middle[0] if number == 2 else middle[1])
        if number not in found or rank > found[number][0] + _OUTLINE_TOLERANCE_PX:
            place, outward = tuple(middle.tolist()), tuple((-across).tolist())
            found[number] = rank, OutlineAxis(number, start, end, place, outward)
    return [found[number][1] for number in sorted(found)]


def _corners(grid: Grid) -> list[Corner]:
    """Return the eight corners of the box."""
    nx, ny, nz = map(float, grid)
    return [(x, y, z) for x in (0.0, nx) for y in (0.0, ny) for z in (0.0, nz)]


def _box_edges(grid: Grid) -> list[tuple[Corner, Corner]]:
    """Return the twelve edges of the box, each in the direction in which its coordinate grows."""
    return [
        (one, other)
        for one, other in itertools.combinations(_corners(grid), 2)
        if sum(a != b for a, b in zip(one, other, strict=True)) == 1
    ]


def _nearest_corner(grid: Grid, camera: Camera) -> Corner:
    """Return the corner of the box that is nearest to the camera."""
    corners = _corners(grid)
    toward = np.array(
        [
            -math.sin(camera.yaw) * math.cos(camera.pitch),
            -math.cos(camera.yaw) * math.cos(camera.pitch),
            math.sin(camera.pitch),
        ]
    )
    return corners[int(np.argmax(np.array(corners) @ toward))]


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
        over = _AXIS_OVERHANG * max(grid)
        ends = list(itertools.product(*((-over, side + over) for side in grid)))
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

    def lines(
        self, ends: list[tuple[Floats, Floats]], color: Rgb, width: float, opacity: float = 1.0
    ) -> None:
        """Draw lines in segments whose brightness shows their distance."""
        if not ends:
            return
        starts, stops = np.array(ends).swapaxes(0, 1)[:, :, None]
        along = starts + (stops - starts) * np.linspace(0, 1, _FADE_STEPS + 1)[:, None]
        points, near = self._project(along.reshape(-1, 3))
        near = near.reshape(len(ends), -1)
        fade = np.clip((near[:, :-1] + near[:, 1:]) / 2 * 1.55 - 0.95, 0.12, 1) * opacity
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


def _draw_label(image: Image.Image, axis: OutlineAxis, side: int) -> None:
    """Write the name and length of an axis beside the middle of its edge, outside of the box."""
    draw = ImageDraw.Draw(image)
    height = max(9.0, min(image.size) / 40)
    font = ImageFont.load_default(height)
    name = "xyz"[axis.number]
    ahead = draw.textlength(name, font=font) + height * 0.45
    left, top, right, bottom = draw.textbbox((0, 0), f"{name}{side}", font=font)
    right += height * 0.45
    box = np.array([right - left, bottom - top])
    # The text's centre lies outside of the edge by what its box needs in that direction.
    outward = np.array(axis.outward)
    middle = axis.middle + outward * (np.abs(outward) @ box / 2 + 0.7 * height)
    if (middle < 0).any() or (middle > image.size).any():
        return  # of a picture that shows a part of the box, it would be moved onto what is inside
    corner = np.clip(middle - box / 2, 2, np.array(image.size) - box - 2) - (left, top)
    draw.text(tuple(corner), name, font=font, fill=AXIS_COLORS[axis.number])
    draw.text((corner[0] + ahead, corner[1]), str(side), font=font, fill=_TEXT)

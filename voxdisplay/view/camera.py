"""Perspective camera: the one definition of where a voxel lies in a picture.

The page for browsers implements `Camera.project` a second time; a test compares the two. Knows no
picture and no colour.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

# At this distance no corner of a grid, at most sqrt(3)/2 from its centre, is behind the camera.
NEAREST = 1.0
FARTHEST = 10.0
SMALLEST_ZOOM, LARGEST_ZOOM = 0.2, 12.0
# Margin on each side of the fitted grid, in shorter sides of the picture: room for labels.
_MARGIN = 0.1


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera that turns around the grid, z up, and shows all of it.

    Attributes
    ----------
    yaw, pitch : float
        Radians. At yaw 0 and pitch 0 the camera is in front: x grows to the right, z up, and y
        away from it. A greater yaw turns the grid clockwise as seen from above; a greater pitch
        raises the camera, and at pi/2 it looks straight down.
    distance : float
        From the camera to the grid's centre, in longest sides of the grid; 1 to 10. It is the
        strength of the perspective, not the size of the picture.
    zoom : float
        Magnification of the fitted picture, 0.2 to 12.
    orthographic : bool
        Whether what is parallel stays parallel.

    """

    yaw: float = -0.6
    pitch: float = 0.42
    distance: float = 2.6
    zoom: float = 1.0
    orthographic: bool = False

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (self.yaw, self.pitch, self.distance, self.zoom))):
            raise ValueError("the numbers of a camera must be finite")
        if not NEAREST <= self.distance <= FARTHEST:
            raise ValueError(f"the distance {self.distance} is not {NEAREST:g} to {FARTHEST:g}")
        if not SMALLEST_ZOOM <= self.zoom <= LARGEST_ZOOM:
            raise ValueError(f"the zoom {self.zoom} is not {SMALLEST_ZOOM:g} to {LARGEST_ZOOM:g}")

    @np.errstate(under="ignore")  # of angles next to nothing
    def project(
        self, points: ArrayLike, grid: tuple[int, int, int], size: tuple[int, int]
    ) -> tuple[Floats, Floats, Floats]:
        """Return where points lie in the picture.

        With ``(nx, ny, nz)`` the grid, ``L = max(nx, ny, nz)``, ``(W, H)`` the picture::

            X = (x - nx/2) / L,  Y = (y - ny/2) / L,  Z = (z - nz/2) / L
            right = X*cos(yaw) - Y*sin(yaw)
            away  = X*sin(yaw) + Y*cos(yaw)
            up    = Z*cos(pitch) + away*sin(pitch)
            depth = distance + away*cos(pitch) - Z*sin(pitch)
            k = fit / depth
            x_px = W/2 + k*right,  y_px = H/2 + fit*middle - k*up,  scale = k / L

        `orthographic` makes ``depth = distance``. `fit` and `middle` are those of `fitted`.

        Parameters
        ----------
        points : (n, 3) array
            Voxel space, columns x, y, z: the centre of voxel (i, j, k) is (i, j, k) + 1/2.
        grid : Grid or (nx, ny, nz)
        size : (W, H)
            The picture, in pixels.

        Returns
        -------
        x_px, y_px : (n,) float64 arrays
            Right and down from the picture's upper left corner; pixel (i, j) is
            [i, i+1) x [j, j+1).
        scale : (n,) float64 array
            Width of a voxel there, in pixels: the greater, the nearer.

        """
        width, height = size
        longest = max(grid)
        # By columns, not as a matrix product: half the time, and no threads.
        x, y, z = (
            (column - side / 2) / longest
            for column, side in zip(np.asarray(points, dtype=np.float64).T, grid, strict=True)
        )
        right = x * math.cos(self.yaw) - y * math.sin(self.yaw)
        away = x * math.sin(self.yaw) + y * math.cos(self.yaw)
        up = z * math.cos(self.pitch) + away * math.sin(self.pitch)
        fit, middle = self.fitted(grid, size)
        if self.orthographic:
            k = np.full_like(right, fit / self.distance)
        else:
            k = fit / (self.distance + away * math.cos(self.pitch) - z * math.sin(self.pitch))
        return width / 2 + k * right, height / 2 + fit * middle - k * up, k / longest

    def fitted(self, grid: tuple[int, int, int], size: tuple[int, int]) -> tuple[float, float]:
        """Return the scale and the middle by which the grid is fitted into a picture and centred.

        What is fitted is the cylinder that the grid's box sweeps in one turn, of radius
        ``r = hypot(nx, ny)/2/L`` and height ``h = nz/L``, so that the picture neither grows nor
        shrinks while the box turns. On its rims, ``up/depth`` is greatest and least where
        ``away = +-r``. ``right/depth`` is at most ``r / sqrt(a**2 - b**2)``, with
        ``a = distance - h/2*abs(sin(pitch))`` and ``b = r*cos(pitch)``.

        Parameters
        ----------
        grid : Grid or (nx, ny, nz)
        size : (W, H)
            The picture, in pixels.

        Returns
        -------
        fit : float
            Pixels of what is as large as its depth.
        middle : float
            The ``up/depth`` that lies in the picture's middle.

        """
        longest = max(grid)
        radius, half = math.hypot(*grid[:2]) / 2 / longest, grid[2] / 2 / longest
        sin, cos = math.sin(self.pitch), math.cos(self.pitch)
        depends = 0.0 if self.orthographic else 1.0
        rims = [
            (z * cos + away * sin) / (self.distance + depends * (away * cos - z * sin))
            for z in (-half, half)
            for away in (-radius, radius)
        ]
        low, high = min(rims), max(rims)
        nearest = self.distance - depends * half * abs(sin)
        wide = 2 * radius / math.sqrt(nearest**2 - (depends * radius * cos) ** 2)
        margins = 2 * _MARGIN * min(size)
        fit = min((size[0] - margins) / wide, (size[1] - margins) / (high - low))
        return self.zoom * fit, (low + high) / 2

    def turned(self, yaw: float, pitch: float = 0.0) -> Camera:
        """Return the camera turned by angles in radians; the pitch is limited to +-pi/2."""
        pitch = min(max(self.pitch + pitch, -math.pi / 2), math.pi / 2)
        return replace(self, yaw=math.remainder(self.yaw + yaw, 2 * math.pi), pitch=pitch)

    def zoomed(self, factor: float) -> Camera:
        """Return the camera with a magnification greater by a factor; it is limited."""
        return replace(self, zoom=min(max(self.zoom * factor, SMALLEST_ZOOM), LARGEST_ZOOM))

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


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera that looks at the grid's centre, z up.

    Attributes
    ----------
    yaw, pitch : float
        Radians. At yaw 0 and pitch 0 the camera is in front: x grows to the right, z up, and y
        away from it. A greater yaw turns the grid clockwise as seen from above; a greater pitch
        raises the camera, and at pi/2 it looks straight down.
    distance : float
        From the camera to the grid's centre, in longest sides of the grid; 1 to 10.
    fov : float
        Field of view across the picture's shorter side, in radians.

    """

    yaw: float = -0.6
    pitch: float = 0.42
    distance: float = 2.6
    fov: float = 0.72

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (self.yaw, self.pitch, self.distance, self.fov))):
            raise ValueError("the numbers of a camera must be finite")
        if not NEAREST <= self.distance <= FARTHEST:
            raise ValueError(f"the distance {self.distance} is not {NEAREST:g} to {FARTHEST:g}")
        if not 0 < self.fov < math.pi:
            raise ValueError(f"the field of view {self.fov} is not between 0 and pi")

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
            k = min(W, H) / (2 * tan(fov/2)) / depth
            x_px = W/2 + k*right,  y_px = H/2 - k*up,  scale = k / L

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
        depth = self.distance + away * math.cos(self.pitch) - z * math.sin(self.pitch)
        k = min(width, height) / (2 * math.tan(self.fov / 2)) / depth
        return width / 2 + k * right, height / 2 - k * up, k / longest

    def turned(self, yaw: float, pitch: float = 0.0) -> Camera:
        """Return the camera turned by angles in radians; the pitch is limited to +-pi/2."""
        pitch = min(max(self.pitch + pitch, -math.pi / 2), math.pi / 2)
        return replace(self, yaw=math.remainder(self.yaw + yaw, 2 * math.pi), pitch=pitch)

    def zoomed(self, factor: float) -> Camera:
        """Return the camera nearer by a factor, or farther below 1; the distance is limited."""
        return replace(self, distance=min(max(self.distance / factor, NEAREST), FARTHEST))

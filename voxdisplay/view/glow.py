"""Additive splatting of lit voxels: the light that reaches the camera, as a display emits it.

Voxels do not hide each other: there is no depth buffer, and no order. The result is linear light
without an upper bound; exposure is the business of `picture`.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.grid import Grid
from voxdisplay.view.camera import Camera, Floats
from voxdisplay.view.lit_voxels import LitVoxels
from voxdisplay.view.pillow import Image

Light = NDArray[np.float32]

# Voxels splatted at once: bounds the memory that a dense volume takes.
_CHUNK_VOXELS = 1 << 19
# Splats of a greater standard deviation, in pixels, are drawn on a coarser raster, where they have
# at least this one, and are upsampled: as smooth, and much faster.
_COARSE_SIGMA_PX = 1.5
# On a coarser raster, voxels whose sizes differ by less than this factor have one splat size.
_SIZE_CLASS_RATIO = 1.1
# Variance of a point splatted by bilinear weights alone, in square pixels.
_BILINEAR_VARIANCE = 1 / 6
# Most variance that one pass of the blur adds. Smaller steps make rounder spots; on a coarser
# raster that is visible, and cheap.
_MAX_STEP_VARIANCE, _COARSE_STEP_VARIANCE = 0.5, 0.15

_LINEAR = (np.arange(256) / 255) ** 2.2


class LightRegion(NamedTuple):
    """Light of a rectangle of the picture; the rest is dark.

    Attributes
    ----------
    light : (3, h, w) float32 array
        Planes of linear red, green and blue; 1 is about the centre of one voxel of full colour.
    left, top : int
        Position of its first pixel in the picture.

    """

    light: Light
    left: int
    top: int


@np.errstate(under="ignore")  # light fades to nothing
def accumulate_light(
    lit: LitVoxels, grid: Grid, camera: Camera, size: tuple[int, int]
) -> LightRegion:
    """Return the sum of the light of lit voxels.

    Each is a Gaussian spot as wide as the voxel at its distance; nearer ones are brighter.

    Parameters
    ----------
    lit : Lit
    grid : Grid
    camera : Camera
    size : (W, H)
        The picture, in pixels.

    Returns
    -------
    LightRegion

    """
    middle_px = float(camera.project([np.array(grid) / 2], grid, size)[2][0])
    wide = _splat_sigma_px(middle_px) / _COARSE_SIGMA_PX
    factor = 1 if wide < 1 else max(2, int(wide))
    box = _lit_region(lit, grid, camera, size, factor)
    shape = 3, box.height, box.width
    rasters: dict[int, Light] = {}
    for start in range(0, len(lit.positions) if box.width and box.height else 0, _CHUNK_VOXELS):
        part = slice(start, start + _CHUNK_VOXELS)
        x, y, scale = camera.project(lit.positions[part] + 0.5, grid, size)
        x, y = x / factor - box.left, y / factor - box.top
        near = scale / middle_px
        light = _LINEAR.take(lit.colors[part].T) * (near * near)
        # Spots of a pixel or two differ little in size; on a coarser raster size shows distance.
        band = (
            np.rint(np.log(near) / math.log(_SIZE_CLASS_RATIO)).astype(np.int64)
            if factor > 1
            else None
        )
        for number in [0] if band is None else np.unique(band).tolist():
            own = slice(None) if band is None else band == number
            raster = rasters.setdefault(number, np.zeros(shape, dtype=np.float32))
            _splat(raster, x[own], y[own], light[:, own])
    total: Light = np.zeros(shape, dtype=np.float32)
    step = _MAX_STEP_VARIANCE if factor == 1 else _COARSE_STEP_VARIANCE
    for number, raster in rasters.items():
        spread_px = _splat_sigma_px(middle_px * _SIZE_CLASS_RATIO**number) / factor
        variance = max(0.0, spread_px**2 - _BILINEAR_VARIANCE)
        # Normalised to 1 in the centre of a voxel's spot.
        total += blur(raster, variance, step) * np.float32(
            2 * math.pi * (variance + _BILINEAR_VARIANCE)
        )
    return (
        LightRegion(total, box.left, box.top)
        if factor == 1
        else _upsampled(total, box, factor, size)
    )


class _Region(NamedTuple):
    """A rectangle of a raster, in pixels."""

    left: int
    top: int
    width: int
    height: int


def _lit_region(
    lit: LitVoxels, grid: Grid, camera: Camera, size: tuple[int, int], factor: int
) -> _Region:
    """Return the rectangle that light can reach: the projected bounding box, with a margin."""
    if len(lit.positions) == 0:
        return _Region(0, 0, 0, 0)
    ends = [(column.min() + 0.5, column.max() + 0.5) for column in lit.positions.T]
    corners = list(itertools.product(*ends))
    x, y, scale = camera.project(corners, grid, size)
    margin = 2 + math.ceil(3.5 * _splat_sigma_px(float(scale.max())) / factor)
    left, right = (
        min(max(0, math.floor(edge / factor) + more), -(-size[0] // factor))
        for edge, more in ((x.min(), -margin), (x.max(), margin))
    )
    top, bottom = (
        min(max(0, math.floor(edge / factor) + more), -(-size[1] // factor))
        for edge, more in ((y.min(), -margin), (y.max(), margin))
    )
    return _Region(left, top, right - left, bottom - top)


def _splat_sigma_px(voxel_px: float) -> float:
    """Return a spot's standard deviation: small neighbours merge into a line, large ones do not."""
    return voxel_px * (0.19 + 0.26 / (1 + (voxel_px / 6) ** 2))


def _splat(raster: Light, x: Floats, y: Floats, light: Floats) -> None:
    """Add points to the four pixels around each by bilinear weights; skip those outside."""
    height, width = raster.shape[1:]
    left, top = np.floor(x - 0.5), np.floor(y - 0.5)
    inside = (left >= 0) & (left < width - 1) & (top >= 0) & (top < height - 1)
    if not inside.all():
        x, y, left, top = (each[inside] for each in (x, y, left, top))
        light = light[:, inside]
    fx, fy = x - 0.5 - left, y - 0.5 - top
    first = (top * width + left).astype(np.int64)
    index = np.concatenate((first, first + 1, first + width, first + width + 1))
    weights = ((1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy)
    for plane, channel in zip(raster, light, strict=True):
        shares = np.concatenate([weight * channel for weight in weights])
        np.add(plane, np.bincount(index, shares, height * width).reshape(plane.shape), out=plane)


def blur(light: Light, variance: float, step: float) -> Light:
    """Blur planes by a variance in square pixels, in passes of at most `step` (up to 2/3)."""
    passes = math.ceil(variance / step)
    share = np.float32(variance / max(1, passes) / 2)
    light = light.copy()
    given = np.empty_like(light[0])
    for plane in light:  # one by one: each stays in the processor's cache
        for _ in range(passes):
            for here, there in ((plane, given), (plane.T, given.T)):
                # Each pixel passes a share to both neighbours, which adds a variance of two shares.
                np.multiply(plane, share, out=given)
                plane *= 1 - 2 * share  # noqa: PLW2901 - in place
                here[:, 1:] += there[:, :-1]
                here[:, :-1] += there[:, 1:]
    return light


def _upsampled(light: Light, box: _Region, factor: int, size: tuple[int, int]) -> LightRegion:
    """Upsample light from a coarser raster to the picture's."""
    wide, high = box.width * factor, box.height * factor
    planes = [
        np.asarray(Image.fromarray(plane).resize((wide, high), Image.Resampling.BICUBIC))
        for plane in light
    ]
    left, top = box.left * factor, box.top * factor
    inside = np.stack(planes)[:, : size[1] - top, : size[0] - left]
    return LightRegion(np.maximum(inside, 0), left, top)

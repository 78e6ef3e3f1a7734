"""Rendering of a page as a picture: light over a background, with exposure and bloom.

Used for files, notebooks, films and terminals. Knows no device and no scene.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.grid import Grid
from voxdisplay.raster.palette import Colors
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.raster.pixel_map import PixelMap
from voxdisplay.view.axes_and_grid import BACKGROUND, draw_stage
from voxdisplay.view.camera import Camera
from voxdisplay.view.glow import Light, accumulate_light, blur
from voxdisplay.view.lit_voxels import LitVoxels, lit_voxels
from voxdisplay.view.pillow import Image, ImageChops

SIZE = (800, 600)

# The bloom is made on a raster coarser by this factor.
_BLOOM_SCALE = 8
# Its blurs: variance in square pixels of that raster, and weight.
_BLOOM_BLURS = ((0.8, 0.6), (12.0, 0.8))
_BLOOM_STEP_VARIANCE = 0.6
# Share of white in the brightest light.
_HIGHLIGHT_WHITENESS = 0.35
# The bloom is amplified to this brightness of 255, and by no more than this factor.
_BLOOM_PEAK, _BLOOM_MAX_GAIN = 72.0, 3.0
_SMOOTH = Image.Resampling.BICUBIC
# Exposure: this quantile of the lit pixels is shown at this share of full brightness.
_METER_QUANTILE, _METER_TARGET = 0.92, 0.8

# Pixels that are metered, at most.
_METER_PIXELS = 1 << 15
_SRGB_STEPS = 4096
_SRGB_TABLE = np.rint(255 * (np.arange(_SRGB_STEPS) / (_SRGB_STEPS - 1)) ** (1 / 2.2)).astype(
    np.uint8
)


@dataclass(frozen=True, slots=True)
class RenderOptions:
    """Options of a picture.

    Attributes
    ----------
    size : (W, H)
        In pixels.
    camera : Camera
    glow, axes, labels, floor : bool
        Whether there is bloom; whether the grid's box and axes are drawn; whether the axes have
        their names and lengths, and the box lines on its floor.

    """

    size: tuple[int, int] = SIZE
    camera: Camera = field(default_factory=Camera)
    glow: bool = True
    axes: bool = True
    labels: bool = True
    floor: bool = True

    def with_view(
        self, angle: tuple[float, float] | None, zoom: float | None = None
    ) -> RenderOptions:
        """Return the options with another yaw and pitch, in radians, and another zoom."""
        yaw, pitch = angle or (self.camera.yaw, self.camera.pitch)
        zoom = self.camera.zoom if zoom is None else zoom
        return replace(self, camera=replace(self.camera, yaw=yaw, pitch=pitch, zoom=zoom))


def render_page(
    page: NDArray[np.integer] | PixelMap,
    grid: Grid,
    format: PixelFormat,  # noqa: A002 - as the option --format
    options: RenderOptions = RenderOptions(),
    palette: Colors | None = None,
) -> Image.Image:
    """Render a page.

    Parameters
    ----------
    page : ndarray or PixelMap
        As from `Display.read` or `Frame.array`, indexed [z, y, x]; or the lit pixels alone.
    grid : Grid
    format : PixelFormat
    options : Look
    palette : (256, 3) uint8 array, optional
        Of an index8 page; by default the default one.

    Returns
    -------
    PIL.Image.Image
        RGB, of the options's size.

    """
    return render_voxels(lit_voxels(page, grid, format, palette), grid, options)


@np.errstate(under="ignore")  # light fades to nothing
def render_voxels(
    lit: LitVoxels, grid: Grid, options: RenderOptions, exposure: float | None = None
) -> Image.Image:
    """Render lit voxels.

    Parameters
    ----------
    lit : Lit
    grid : Grid
    options : Look
    exposure : float, optional
        Factor on the light; by default that of `auto_exposure`. A film has one for all pictures.

    """
    image = _background(grid, options)
    glare = accumulate_light(lit, grid, options.camera, options.size)
    if not glare.light.size:
        return image
    exposed = _tone_mapped(glare.light * np.float32(exposure or auto_exposure(glare.light)))
    sharp = _to_srgb(exposed)
    image = _put_before(image, sharp, glare.left, glare.top)
    if not options.glow:
        return image
    whole = Image.new("RGB", options.size)
    whole.paste(sharp, (glare.left, glare.top))
    return _screen_blended(image, *_bloom(whole))


def _put_before(image: Image.Image, light: Image.Image, left: int, top: int) -> Image.Image:
    """Put light before a part of an image, as opaque as it is bright; return the image."""
    box = left, top, left + light.width, top + light.height
    red, green, blue = light.split()
    dark = ImageChops.invert(ImageChops.lighter(ImageChops.lighter(red, green), blue))
    behind = ImageChops.multiply(image.crop(box), Image.merge("RGB", (dark, dark, dark)))
    image.paste(ImageChops.add(behind, light), box)
    return image


def _screen_blended(image: Image.Image, light: Image.Image, left: int, top: int) -> Image.Image:
    """Blend light onto a part of an image by the screen mode; return the image."""
    box = left, top, left + light.width, top + light.height
    image.paste(ImageChops.screen(image.crop(box), light), box)
    return image


@np.errstate(under="ignore")
def auto_exposure(light: Light) -> float:
    """Return the exposure that shows most of the light clearly and little of it saturated."""
    apart = max(1, round((light[0].size / _METER_PIXELS) ** 0.5))
    most = light[:, ::apart, ::apart].max(axis=0)
    most = most[most > most.max(initial=0.0) / 50]
    if not len(most):
        return 1.0
    return -float(np.log(1 - _METER_TARGET)) / float(np.quantile(most, _METER_QUANTILE))


def _background(grid: Grid, options: RenderOptions) -> Image.Image:
    if options.axes:
        return draw_stage(
            grid, options.camera, options.size, labels=options.labels, floor=options.floor
        ).copy()
    return Image.new("RGB", options.size, BACKGROUND)


@np.errstate(all="ignore")  # light that underflows is dark
def _tone_mapped(light: Light) -> Light:
    """Map light of any strength below 1, keeping its hue; the brightest turns towards white."""
    most = light.max(axis=0)
    toned = 1 - np.exp(-most)
    white = toned * toned * toned
    white *= white * np.float32(_HIGHLIGHT_WHITENESS)
    kept = toned * (1 - white) / np.maximum(most, np.float32(1e-6))
    return np.asarray(light * kept + toned * white, dtype=np.float32)


def _to_srgb(light: Light) -> Image.Image:
    """Encode linear light of 0 to 1 as sRGB."""
    steps = (light * np.float32(_SRGB_STEPS - 1)).astype(np.uint16)
    return Image.merge("RGB", [Image.fromarray(plane) for plane in _SRGB_TABLE.take(steps)])


def _bloom(sharp: Image.Image) -> tuple[Image.Image, int, int]:
    """Return the bloom, a narrow and a wide blur of the picture, and its left and top there."""
    coarse = np.asarray(sharp.reduce(_BLOOM_SCALE), dtype=np.float32).transpose(2, 0, 1)
    scattered = np.zeros_like(coarse)
    for variance, share in _BLOOM_BLURS:
        scattered += share * blur(coarse, variance, _BLOOM_STEP_VARIANCE)
    gain = min(_BLOOM_MAX_GAIN, _BLOOM_PEAK / max(1.0, float(scattered.max())))
    planes = np.rint(scattered * gain).astype(np.uint8)
    small = Image.merge("RGB", [Image.fromarray(plane) for plane in planes])
    left, top, right, bottom = small.getbbox() or (0, 0, 1, 1)
    # Resampling reaches two pixels farther.
    box = (
        max(0, left - 2),
        max(0, top - 2),
        min(small.width, right + 2),
        min(small.height, bottom + 2),
    )
    size = (box[2] - box[0]) * _BLOOM_SCALE, (box[3] - box[1]) * _BLOOM_SCALE
    left, top = box[0] * _BLOOM_SCALE, box[1] * _BLOOM_SCALE
    large = small.resize(size, _SMOOTH, box)
    # The last coarse pixels may reach beyond the picture's edge.
    inside = min(large.width, sharp.width - left), min(large.height, sharp.height - top)
    return large.crop((0, 0, *inside)), left, top

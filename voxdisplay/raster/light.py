"""Brightness and current limit of a picture: one factor for all of its light.

sRGB values are decoded to linear light, multiplied, and encoded again (IEC 61966-2-1). The factor
is a whole number of parts in 65536; a channel v of 0..255 becomes

    floor(255 * encode(decode(v / 255) * factor / 65536) + 0.5)

and then the nearest that the pixel format has. The limit holds for what is sent, rounding
included. Must not know frames or devices.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.palette import DEFAULT, Palette
from voxdisplay.raster.pixel_format import PixelFormat, Values
from voxdisplay.raster.sparse_raster import SparseRaster

FULL: Final = 1 << 16
"""Factor that leaves all light as it is."""

Levels = NDArray[np.uint8]


class CurrentLimit(NamedTuple):
    """Largest current of a picture.

    Attributes
    ----------
    amps : float
        What the supply carries.
    ma_per_channel : float
        Current of one channel of one voxel at its full light, in milliamperes; it is proportional
        to the light.

    """

    amps: float
    ma_per_channel: float


class Dimmed(NamedTuple):
    """Picture with less light.

    Attributes
    ----------
    raster : SparseRaster
    palette : Palette or None
    factor : int
        Parts in 65536 of the light that are left.
    amps : float or None
        Current of the picture without the limit; None if there is no limit.

    """

    raster: SparseRaster
    palette: Palette | None
    factor: int
    amps: float | None


def decode_srgb(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the linear light, 0 to 1, of sRGB values of 0 to 1."""
    with np.errstate(all="ignore"):
        high = ((values + 0.055) / 1.055) ** 2.4
    return np.where(values <= 0.04045, values / 12.92, high)


def encode_srgb(light: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the sRGB values, 0 to 1, of linear light of 0 to 1."""
    high = 1.055 * light ** (1 / 2.4) - 0.055
    return np.where(light <= 0.0031308, light * 12.92, high)


LINEAR: NDArray[np.float64] = decode_srgb(np.arange(256) / 255)
"""Linear light of the channel values 0 to 255."""
LINEAR.flags.writeable = False


def dimmed_levels(factor: int) -> Levels:
    """Return what each channel value, 0 to 255, becomes: (256,) uint8."""
    return np.floor(255 * encode_srgb(LINEAR * (factor / FULL)) + 0.5).astype(np.uint8)


def parts_of(brightness: float) -> int:
    """Return a brightness of 0 to 1 as parts in 65536."""
    return int(np.floor(brightness * FULL + 0.5))


def dim(
    raster: SparseRaster, palette: Palette | None, brightness: float, limit: CurrentLimit | None
) -> Dimmed:
    """Return a picture with less light.

    A palette of the picture's own is dimmed; without, pixels become those nearest to the dimmed
    colours. MONO1 has no dimmer light: its pictures stay as they are.

    Parameters
    ----------
    raster : SparseRaster
    palette : Palette or None
        For INDEX8: that of the picture, if it has one of its own.
    brightness : float
        Factor of linear light, 0 to 1.
    limit : CurrentLimit, optional
        If the picture takes more current, the factor is the largest that does not.

    """
    format_ = raster.format
    is_mono = format_ is PixelFormat.MONO1
    factor, amps = FULL if is_mono else parts_of(brightness), None
    if limit is not None:
        rgb = palette.rgb(raster.lit.values) if palette else format_.rgb(raster.lit.values)
        counts = np.stack([np.bincount(channel, minlength=256) for channel in rgb.T])
        amps = _amps(counts, factor, format_, palette is not None, limit)
        if amps > limit.amps and not is_mono:
            factor = _largest_factor(counts, factor, format_, palette is not None, limit)
    if factor == FULL:
        return Dimmed(raster, palette, factor, amps)
    levels = dimmed_levels(factor)
    if palette is not None:
        colors, used = DEFAULT.copy(), np.unique(raster.lit.values)  # the others need no bytes
        colors[used] = levels[palette.colors[used]]
        return Dimmed(raster, Palette(colors), factor, amps)
    return Dimmed(_recolored(raster, levels), None, factor, amps)


def _amps(
    counts: NDArray[np.int64], factor: int, format_: PixelFormat, exact: bool, limit: CurrentLimit
) -> float:
    """Return the current of a picture by how many voxels have each channel value, (3, 256)."""
    shown = np.repeat(dimmed_levels(factor)[:, None], 3, axis=1)
    if not exact and format_ is not PixelFormat.MONO1:
        shown = format_.rgb(format_.nearest(shown))
    return float((counts.T * LINEAR[shown]).sum()) * limit.ma_per_channel / 1000


def _largest_factor(
    counts: NDArray[np.int64], factor: int, format_: PixelFormat, exact: bool, limit: CurrentLimit
) -> int:
    """Return the largest factor that keeps a limit, by bisection: current never falls with it."""
    low, high = 0, factor
    while high - low > 1:
        middle = (low + high) // 2
        if _amps(counts, middle, format_, exact, limit) > limit.amps:
            high = middle
        else:
            low = middle
    return low


def _recolored(raster: SparseRaster, levels: Levels) -> SparseRaster:
    """Return a raster whose channels are replaced by others."""
    found = SparseRaster(raster.grid, raster.format)
    if raster.page is not None:
        pixels = raster.page.pixels
        if raster.format is PixelFormat.RGB888:
            found.set(levels[pixels])
        else:
            every = np.arange(raster.format.full + 1)
            table = raster.format.pixels(_nearest(every, levels, raster.format))
            found.set(table[pixels])
    if (drawn := raster.visible) is not None:
        found.draw(drawn.recolored(_nearest(drawn.values, levels, raster.format)))
    return found


def _nearest(values: NDArray[np.integer], levels: Levels, format_: PixelFormat) -> Values:
    return format_.nearest(levels[format_.rgb(values)])

"""Ordered dithering in space: Bayer's matrix of 4 x 4 x 4 thresholds.

For volumes alone: a curve falls to pieces. Of a torus knot of 226 voxels at half the light, 113 are
left, with 67 gaps. Thresholds are fixed in space, so that what moves does not flicker: if a soft
ball moves by a quarter of a voxel, voxels change that are 3 % of the lit ones, as many as without.
Light is compared as linear light. Must not know frames.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.light import LINEAR
from voxdisplay.raster.pixel_format import PixelFormat

RANKS: Final = 64
_LUMINANCE: Final = np.array([0.2126, 0.7152, 0.0722])  # of linear sRGB (IEC 61966-2-1)


def _bayer() -> NDArray[np.int64]:
    """Return the ranks 0 to 63 of a 4 x 4 x 4 cell, [z, y, x]: each of them once.

    As in the plane (Bayer 1973): the corners of a 2 x 2 x 2 cell are taken in an order in which
    each is followed by the one opposite; the cell of 4 repeats it at both scales.
    """
    corners = np.empty((2, 2, 2), dtype=np.int64)
    for rank, corner in enumerate(("000", "111", "011", "100", "101", "010", "110", "001")):
        corners[tuple(map(int, corner))] = rank
    return 8 * np.tile(corners, (2, 2, 2)) + np.kron(corners, np.ones((2, 2, 2), dtype=np.int64))


BAYER: Final = _bayer()


def can_dither(format_: PixelFormat) -> bool:
    """Return whether a format has so few colours that dithering shows more."""
    return format_ is not PixelFormat.RGB888


def ranks_at(voxels: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return the ranks, (n,), of voxels, (n, 3) with columns x, y, z."""
    x, y, z = (voxels & 3).T
    return np.asarray(BAYER[z, y, x])


def dithered(
    rgb: NDArray[np.uint8], ranks: NDArray[np.integer], format_: PixelFormat
) -> NDArray[np.uint8]:
    """Return colours that a format has, and whose mean over all ranks is the light wanted.

    Parameters
    ----------
    rgb : (n, 3) uint8 array
        sRGB colours.
    ranks : (n,) integer array
        0 to 63: those of their voxels.
    format_ : PixelFormat
        For MONO1 the luminance decides; INDEX8 has the default palette.

    Returns
    -------
    (n, 3) uint8 array
        Each channel is one of the two levels of the format around it, the upper one if its share
        of the way in linear light is more than (rank + 1/2) / 64.

    """
    limits = (ranks + 0.5) / RANKS
    light = LINEAR[rgb]
    if format_ is PixelFormat.MONO1:
        return (
            np.where((light @ _LUMINANCE > limits)[:, None], 255, 0).astype(np.uint8).repeat(3, 1)
        )
    shown = np.empty_like(rgb)
    grey = np.repeat(np.arange(256, dtype=np.uint8)[:, None], 3, axis=1)
    for channel, levels in enumerate(format_.rgb(format_.nearest(grey)).T):
        there = np.unique(levels)
        below = np.searchsorted(there, rgb[:, channel], side="right") - 1
        low, high = there[below], there[np.minimum(below + 1, len(there) - 1)]
        step = np.where(high > low, LINEAR[high] - LINEAR[low], 1.0)
        share = (light[:, channel] - LINEAR[low]) / step
        shown[:, channel] = np.where(share > limits, high, low)
    return shown


def dithered_pixels(
    entries: NDArray[np.integer], colors: NDArray[np.uint8], format_: PixelFormat
) -> NDArray[Any]:
    """Return the pixels of entries of a list of colours.

    Parameters
    ----------
    entries : (nz, ny, nx) integer array
        Indices into the colours.
    colors : (k, 3) uint8 array
    format_ : PixelFormat

    Returns
    -------
    ndarray
        Indexed [z, y, x], of the format's type and shape.

    """
    ranks = np.arange(RANKS).repeat(len(colors))
    shown = dithered(np.tile(colors, (RANKS, 1)), ranks, format_)
    table = format_.pixels(format_.nearest(shown)).reshape(format_.shape((RANKS, len(colors))))
    z, y, x = (np.arange(side) & 3 for side in entries.shape)
    return np.asarray(table[BAYER[np.ix_(z, y, x)], entries])

"""Wiring order and LED values: from a picture [z, y, x, colour] to the bytes along the wire.

Must not know packets.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.sinks.settings import SinkSettings

Bytes = NDArray[np.uint8]


def wiring_order(settings: SinkSettings) -> NDArray[np.intp]:
    """Return the scan-order indices of voxels in the order of the wire.

    Returns
    -------
    (n,) intp array
        x + nx * (y + ny * z) of the first LED, the second, and so on.

    """
    grid = settings.size
    voxels = np.arange(grid.voxels, dtype=np.intp).reshape(grid.array_shape)
    for axis, far in enumerate(settings.start):
        if far:
            voxels = np.flip(voxels, axis=2 - axis)
    along, across, panel = ("xyz".index(axis) for axis in settings.panels)
    voxels = voxels.transpose(2 - panel, 2 - across, 2 - along).copy()
    if settings.wiring != "straight":
        voxels[:, 1::2] = voxels[:, 1::2, ::-1].copy()
    panels = voxels.reshape(len(voxels), -1)
    if settings.wiring == "continuous":
        panels[1::2] = panels[1::2, ::-1].copy()
    return panels.reshape(-1)


def value_table(gamma: float, factor: float) -> Bytes:
    """Return the LED values, (256,), of pixel values: 255 * factor * (value / 255) ** gamma."""
    levels = np.arange(256, dtype=np.float64) / 255
    return np.rint(255 * factor * levels**gamma).astype(np.uint8)


class LedBytes:
    """Converter of pictures into the bytes along the wire.

    Parameters
    ----------
    settings : SinkSettings

    """

    def __init__(self, settings: SinkSettings) -> None:
        first_bytes = 3 * wiring_order(settings)
        self._order = settings.order
        factors = dict(zip("rgb", settings.white, strict=True))
        tables = {color: value_table(settings.gamma, factors[color]) for color in "rgb"}
        plain = np.arange(256, dtype=np.uint8)
        self._is_plain = all((table == plain).all() for table in tables.values())
        self._is_plain &= "w" not in settings.order
        self._data = np.empty(settings.leds * settings.bytes_per_led, dtype=np.uint8)
        if self._is_plain:  # one gather of bytes does both orders, that of wire and of colours
            channels = np.array(["rgb".index(color) for color in settings.order], dtype=np.intp)
            self._source = (first_bytes[:, None] + channels).reshape(-1)
            return
        self._source = first_bytes
        self._tables = tables
        self._gathered = np.empty(settings.leds, dtype=np.uint8)
        self._planes = {color: np.empty(settings.leds, dtype=np.uint8) for color in settings.order}

    def convert(self, rgb: Bytes) -> Bytes:
        """Return the bytes of a picture; they are valid until the next call.

        Parameters
        ----------
        rgb : (nz, ny, nx, 3) uint8 array

        Returns
        -------
        (n * bytes per LED,) uint8 array

        """
        # All indices are inside: "clip" only spares numpy a buffer.
        flat = rgb.reshape(-1)
        if self._is_plain:
            return np.take(flat, self._source, out=self._data, mode="clip")
        planes = self._planes
        for channel, color in enumerate("rgb"):
            np.take(flat[channel:], self._source, out=self._gathered, mode="clip")
            np.take(self._tables[color], self._gathered, out=planes[color], mode="clip")
        if "w" in planes:  # it takes what the other three share
            white = np.minimum(planes["r"], planes["g"], out=planes["w"])
            np.minimum(white, planes["b"], out=white)
            for color in "rgb":
                planes[color] -= white
        leds = self._data.reshape(-1, len(self._order))
        for place, color in enumerate(self._order):
            leds[:, place] = planes[color]
        return self._data

"""Pixel formats of protocol.md, section 2.1: colours, pixel values, and arrays of them.

Must not know frames, curves or packets.
"""

from __future__ import annotations

import enum
import reprlib
from collections.abc import Hashable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from voxdisplay.argument_checks import wrong_kind
from voxdisplay.wire import spec

Values = NDArray[np.uint32]
Pixels = NDArray[np.uint8 | np.uint16]


class _PixelFormatType(enum.EnumMeta):
    """Lookup by value that never compares arrays with names."""

    def __call__(cls, value: object, *names: Any, **settings: Any) -> Any:
        """Return the member of a value; see `enum.EnumMeta.__call__`."""
        if not isinstance(value, Hashable):  # an array, whose comparison is no truth value
            cls._missing_(value)
        return super().__call__(value, *names, **settings)


class PixelFormat(enum.Enum, metaclass=_PixelFormatType):
    """Pixel format of a display; values are the names of the command line."""

    MONO1 = "mono1"
    INDEX8 = "index8"
    RGB565 = "rgb565"
    RGB888 = "rgb888"

    @classmethod
    def of(cls, value: object) -> PixelFormat:
        """Return a format, or that of a name; raise `TypeError` or `ValueError` otherwise."""
        if isinstance(value, cls):
            return value
        if not isinstance(value, str):
            raise wrong_kind("format", f"one of {', '.join(each.value for each in cls)}", value)
        return cls(value)

    @classmethod
    def _missing_(cls, value: object) -> None:
        names = ", ".join(format_.value for format_ in cls)
        raise ValueError(f"format: expected one of {names}, found {reprlib.repr(value)}")

    @classmethod
    def from_wire(cls, number: int) -> PixelFormat | None:
        """Return the format with a number in INFO; None if there is none."""
        return next((format_ for format_ in cls if format_.wire == number), None)

    @property
    def wire(self) -> int:
        """Number of the format on the wire."""
        return int(getattr(spec, f"FORMAT_{self.name}"))

    @property
    def bytes(self) -> int:
        """Bytes of one pixel."""
        return spec.PIXEL_BYTES[self.wire]

    @property
    def full(self) -> int:
        """Value of the full pixel: all bits set."""
        return 1 if self is PixelFormat.MONO1 else (1 << 8 * self.bytes) - 1

    @property
    def dtype(self) -> type[np.uint8 | np.uint16]:
        """Element type of an array of this format."""
        return np.uint16 if self is PixelFormat.RGB565 else np.uint8

    def shape(self, array_shape: tuple[int, ...]) -> tuple[int, ...]:
        """Shape of an array of this format: RGB888 has a last axis of 3."""
        return (*array_shape, 3) if self is PixelFormat.RGB888 else array_shape

    def nearest(self, rgb: NDArray[np.uint8]) -> Values:
        """Return the pixel values nearest to colours.

        With mono1 every colour but black is lit, so that dark colours stay visible.

        Parameters
        ----------
        rgb : (n, 3) uint8 array
            sRGB colours.

        Returns
        -------
        (n,) uint32 array

        """
        red, green, blue = np.asarray(rgb, dtype=np.uint32).T
        match self:
            case PixelFormat.MONO1:
                values = (red | green | blue) != 0
            case PixelFormat.INDEX8:
                values = _quantise(red, 7) << 5 | _quantise(green, 7) << 2 | _quantise(blue, 3)
            case PixelFormat.RGB565:
                values = _quantise(red, 31) << 11 | _quantise(green, 63) << 5 | _quantise(blue, 31)
            case PixelFormat.RGB888:
                values = red | green << 8 | blue << 16
        return np.asarray(values, dtype=np.uint32)

    def rgb(self, values: NDArray[np.integer]) -> NDArray[np.uint8]:
        """Return the colours, (n, 3) uint8, of pixel values, (n,)."""
        v = np.asarray(values, dtype=np.uint32)
        channels: tuple[NDArray[np.integer], ...]
        match self:
            case PixelFormat.MONO1:
                channels = (v * 255,) * 3
            case PixelFormat.INDEX8:
                channels = (_expand(v >> 5, 7), _expand(v >> 2 & 7, 7), _expand(v & 3, 3))
            case PixelFormat.RGB565:
                channels = (_expand(v >> 11, 31), _expand(v >> 5 & 63, 63), _expand(v & 31, 31))
            case PixelFormat.RGB888:
                channels = (v & 255, v >> 8 & 255, v >> 16)
        return np.stack(channels, axis=1).astype(np.uint8)

    def values(self, array: NDArray[np.generic]) -> Values:
        """Return the pixel values, flat in scan order, of an array of this format."""
        if self is PixelFormat.RGB888:
            channels = array.reshape(-1, 3)
            padded = np.zeros((len(channels), 4), dtype=np.uint8)
            for channel in range(3):  # one assignment for all takes three times as long
                padded[:, channel] = channels[:, channel]
            return padded.view("<u4").reshape(-1).astype(np.uint32, copy=False)
        return array.reshape(-1).astype(np.uint32)

    def pixels(self, values: NDArray[np.integer]) -> Pixels:
        """Return pixel values, (n,), as array elements: (n,), or (n, 3) for RGB888."""
        if self is PixelFormat.RGB888:
            return np.asarray(values[:, None] >> np.array([0, 8, 16]) & 255, dtype=np.uint8)
        return np.asarray(values, dtype=self.dtype)

    def validate(self, array: NDArray[np.generic], array_shape: tuple[int, int, int]) -> None:
        """Raise if an array is not memory of this format.

        Parameters
        ----------
        array : ndarray
        array_shape : (nz, ny, nx)
            Of the grid.

        Raises
        ------
        ValueError
            If shape or type differ, or MONO1 has anything but 0 and 1.

        """
        want = self.shape(array_shape)
        if array.shape != want:
            raise ValueError(
                f"the array has the shape {array.shape}, a {self.value} frame of this display "
                f"has {want}, indexed [z, y, x]{self._fitting(array, array_shape)}"
            )
        if array.dtype != self.dtype:
            raise ValueError(
                f"the array is {array.dtype}, a {self.value} frame is {self.dtype.__name__}: "
                f"{self._conversion(array)}"
            )
        if self is PixelFormat.MONO1 and (array.astype(np.uint8) > 1).any():
            raise ValueError("a mono1 frame has only 0 and 1: write (array > 0).astype('uint8')")

    def from_integers(self, array: NDArray[np.generic]) -> NDArray[np.generic]:
        """Return integers or truth values as elements of this format, where all of them fit.

        For numbers that have no width of their own, such as those of a list. Others are returned
        as they are.
        """
        return array.astype(self.dtype) if self._holds(array) else array

    def _holds(self, array: NDArray[np.generic]) -> bool:
        """Return whether all elements of an array are integers that this format can hold."""
        if array.dtype.kind not in "iub":
            return False
        top = 1 if self is PixelFormat.MONO1 else int(np.iinfo(self.dtype).max)
        return not array.size or 0 <= int(array.min()) <= int(array.max()) <= top

    def _fitting(self, array: NDArray[np.generic], array_shape: tuple[int, int, int]) -> str:
        """Return how an array of another shape becomes pixels of this format, if it is a volume."""
        if array.ndim != 3 or array.dtype.kind not in "fiub":
            return ""
        grid = "" if array.shape == array_shape else ", grid=frame.grid"
        return f"; voxdisplay.volume_pixels(array, format={self.value!r}{grid}) makes them"

    def _conversion(self, array: NDArray[np.generic]) -> str:
        """Return how an array of another type becomes pixels of this format."""
        if self._holds(array):
            return f"convert it with array.astype('{self.dtype.__name__}')"
        if self is PixelFormat.MONO1:
            return (
                "choose what is lit, as by (array > threshold).astype('uint8') or "
                "voxdisplay.volume_pixels(array, format='mono1')"
            )
        meaning = {
            PixelFormat.INDEX8: "pixels are entries of the palette, 0 (dark) to 255",
            PixelFormat.RGB565: "pixels are red << 11 | green << 5 | blue, with 5, 6 and 5 bits",
            PixelFormat.RGB888: "red, green and blue are 0 (dark) to 255",
        }[self]
        return (
            f"{meaning}; voxdisplay.volume_pixels(array, format={self.value!r}) makes pixels of "
            "any volume"
        )


def is_lit(pixels: NDArray[np.generic]) -> NDArray[np.bool_]:
    """Return which pixels, (n,) or (n, 3), are lit: (n,)."""
    on = pixels != 0
    return on[:, 0] | on[:, 1] | on[:, 2] if on.ndim == 2 else np.asarray(on)


def _quantise(channel: NDArray[np.integer], top: int) -> NDArray[np.integer]:
    """Return the nearest of the levels 0..top to a channel of 0..255."""
    return (channel * top * 2 + 255) // 510


def _expand(level: NDArray[np.integer], top: int) -> NDArray[np.integer]:
    """Return the channel, 0..255, of a level of 0..top."""
    return (level * 510 + top) // (2 * top)

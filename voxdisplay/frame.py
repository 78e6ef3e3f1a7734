"""What is to be shown: a display list in the order of drawing, and its raster.

A frame knows the display's grid and pixel format. It turns curves into voxels and colours into
pixels, and says what was lost in that. It knows nothing of packets on their way.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from voxdisplay import voxelize as voxelizing
from voxdisplay.color import parse_colors
from voxdisplay.curves.curve import Curve
from voxdisplay.errors import MissingExtra
from voxdisplay.grid import Grid
from voxdisplay.pixel import PixelFormat, Pixels, Values
from voxdisplay.wire.chains import encode_chains
from voxdisplay.wire.digest import digest
from voxdisplay.wire.ops import Coding
from voxdisplay.wire.spans import encode_spans

Color: TypeAlias = str | Sequence[str] | NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class _Drawn:
    """Voxels of one item, all on the grid, in order, and their pixel values."""

    voxels: NDArray[np.integer]
    index: NDArray[np.int64]
    values: Values


@dataclass(frozen=True, slots=True)
class Drawing:
    """What became of a drawn item.

    Attributes
    ----------
    voxels : int
        How many it has, inside the grid or not.
    clipped : int
        How many of them are outside, and not shown.
    exact_color : bool
        Whether the display can show its colours as they are.

    """

    voxels: int
    clipped: int
    exact_color: bool


class Frame:
    """One complete picture.

    Made by `Display.frame`, or by hand for a display that is not there.

    Parameters
    ----------
    grid : Grid or (nx, ny, nz)
        Shape of the display.
    format : PixelFormat or str
        ``"mono1"``, ``"index8"``, ``"rgb565"`` or ``"rgb888"``.

    """

    def __init__(self, grid: tuple[int, int, int], format: PixelFormat | str = "rgb888") -> None:  # noqa: A002 - the word of the wire and of the command line
        self.grid = Grid(*grid)
        self.format = PixelFormat(format)
        self._raster: Pixels = np.zeros(self.format.shape((self.grid.voxels,)), self.format.dtype)
        self._items: list[_Drawn] = []
        self._has_base = False

    def draw(
        self,
        what: Curve | voxelizing.Sequence | ArrayLike,
        color: Color = "white",
    ) -> Drawing:
        """Draw a curve, a sequence or voxels over what is there.

        Parameters
        ----------
        what : Curve, Sequence, or (N, 3) integer array
            Voxels of an array have columns x, y, z. What lies outside the grid is clipped.
        color : str, list of str, or (k, 3) uint8 array
            A colour, or several spread along the curve. See `voxdisplay.color`.

        Returns
        -------
        Drawing
            What became of it.

        """
        if isinstance(what, Curve):
            what = voxelizing.voxelize(what)
        voxels = what.voxels if isinstance(what, voxelizing.Sequence) else _as_voxels(what)
        return self._add(voxels, _as_colors(color))

    def draw_all(self, items: Iterable[tuple[Curve, Color]]) -> list[Drawing]:
        """Draw many curves, in order: the same as `draw` on each, but found together."""
        curves, colors = zip(*items, strict=True) if (items := list(items)) else ((), ())
        sequences = voxelizing.voxelize_many(curves)
        return [self.draw(*pair) for pair in zip(sequences, colors, strict=True)]

    def _add(self, voxels: NDArray[np.integer], colors: NDArray[np.uint8]) -> Drawing:
        rgb = _spread(colors, len(voxels))
        values = self.format.nearest(rgb)
        exact = np.array_equal(self.format.rgb(values), rgb)
        inside = self.grid.inside(voxels)
        if not inside.all():
            voxels, values = voxels[inside], values[inside]
        index = self.grid.index_of(voxels)
        self._raster[index] = self.format.pixels(values)
        self._items.append(_Drawn(voxels, index, values))
        return Drawing(len(inside), int(len(inside) - inside.sum()), bool(exact))

    def set(self, array: NDArray[np.generic]) -> None:
        """Make the frame an array, whatever was drawn before.

        Parameters
        ----------
        array : ndarray
            The display's memory, indexed [z, y, x]: (nz, ny, nx) uint8 for mono1 and index8,
            uint16 for rgb565; (nz, ny, nx, 3) uint8 for rgb888.

        Raises
        ------
        ValueError
            If shape, type or a mono1 value is another; the message says what is wanted.

        """
        array = np.asarray(array)
        self.format.check(array, self.grid.array_shape)
        self._raster[...] = array.reshape(self._raster.shape)
        self._items.clear()
        self._has_base = True

    def clear(self) -> None:
        """Make the frame dark."""
        self._raster[...] = 0
        self._items.clear()
        self._has_base = False

    def array(self) -> Pixels:
        """Give the frame as the display will hold it, indexed [z, y, x]: a copy, as for `set`."""
        return self._raster.reshape(self.format.shape(self.grid.array_shape)).copy()

    def _repr_png_(self) -> bytes | None:
        """Give notebooks a picture, if Pillow is installed."""
        try:
            from voxdisplay.view.picture import picture  # noqa: PLC0415 - an extra
        except MissingExtra:
            return None
        file = io.BytesIO()
        picture(self.array(), self.grid, self.format).save(file, format="PNG")
        return file.getvalue()

    def lit(self) -> tuple[NDArray[np.int64], Values]:
        """Give the lit voxels: their scan-order indices, ascending, and their pixel values."""
        if self._has_base:
            values = self.format.values(self._raster)
            index = np.flatnonzero(values)
            return index, values[index]
        if not self._items:
            return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.uint32)
        index = np.unique(np.concatenate([item.index for item in self._items]))
        values = self.format.values(self._raster[index])
        return index[values != 0], values[values != 0]

    def digest(self) -> int:
        """Give the digest that a display which shows this frame must report."""
        return digest(*self.lit())

    def payloads(self, max_payload: int) -> list[bytes]:
        """Give the ops that draw the frame on a dark page.

        No voxel gets two different pixels, so the payloads may arrive in any order.

        Parameters
        ----------
        max_payload : int
            The longest payload that the device takes.

        """
        coding = Coding(self.grid, self.format, max_payload)
        if self._has_base:
            return encode_spans(self.format.values(self._raster), coding)
        # Order does not matter any more: a pen that many items share is set once.
        items = sorted((item for item in self._items if len(item.values)), key=_first_value)
        if not items:
            return []
        voxels = np.concatenate([item.voxels for item in items])
        index = np.concatenate([item.index for item in items])
        values = np.concatenate([item.values for item in items])
        # The painter's order, settled here: what a later item covers is not sent at all.
        seen = (self.format.values(self._raster[index]) == values) & (values != 0)
        return encode_chains(voxels[seen], values[seen], coding)


def _first_value(item: _Drawn) -> int:
    return int(item.values[0])


def _as_voxels(what: ArrayLike) -> NDArray[np.integer]:
    voxels = np.asarray(what)
    if voxels.ndim != 2 or voxels.shape[1] != 3 or voxels.dtype.kind not in "iu":
        raise ValueError(
            f"voxels are an (N, 3) array of whole numbers, columns x, y, z; "
            f"this is {voxels.shape} of {voxels.dtype}"
        )
    return voxels.astype(np.int64)


def _as_colors(color: Color) -> NDArray[np.uint8]:
    if isinstance(color, np.ndarray):
        if (
            color.ndim != 2
            or color.shape[1] != 3
            or len(color) == 0
            or color.dtype.kind not in "iu"
            or not 0 <= color.min() <= color.max() <= 255
        ):
            raise ValueError(
                f"colours are a (k, 3) array of 0 to 255, k >= 1; this is {color.shape} of "
                f"{color.dtype}"
            )
        return color.astype(np.uint8)
    return parse_colors(color)


def _spread(colors: NDArray[np.uint8], count: int) -> NDArray[np.uint8]:
    """Spread k colours evenly along ``count`` voxels, blending between them: (count, 3)."""
    if len(colors) == 1:
        return np.broadcast_to(colors, (count, 3))
    place = np.linspace(0, len(colors) - 1, count)
    stops = np.arange(len(colors))
    blended = [np.interp(place, stops, colors[:, channel]) for channel in range(3)]
    return np.floor(np.stack(blended, axis=1) + 0.5).astype(np.uint8)

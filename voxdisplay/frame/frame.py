"""One picture of a display: display list in drawing order, and its raster.

A frame turns curves into voxels and colours into pixels of the display's grid and format. It must
not know packets in flight, holds no array of the grid's size that it was not given, and leaves the
encoding to `wire`.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace
from itertools import chain
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from voxdisplay import voxelization
from voxdisplay.argument_checks import flag, instance, wrong_kind
from voxdisplay.bodies.body import Body
from voxdisplay.curves.curve import Curve
from voxdisplay.frame.drawing import Drawing
from voxdisplay.raster.array_arguments import as_array, as_voxels, is_array_like
from voxdisplay.raster.color import Color, as_colors, colors_at
from voxdisplay.raster.coloring import Coloring
from voxdisplay.raster.display_list import DrawnVoxels, Kind
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.palette import DEFAULT, Palette
from voxdisplay.raster.pixel_format import PixelFormat, Pixels, Values
from voxdisplay.raster.sparse_raster import SparseRaster
from voxdisplay.voxelization.body_voxelization import voxelize_body
from voxdisplay.voxelization.corner_rows import corner_rows
from voxdisplay.voxelization.voxel_box import VoxelBox
from voxdisplay.wire import spec
from voxdisplay.wire.differences import encode_difference
from voxdisplay.wire.digest import palette_digest, raster_digest
from voxdisplay.wire.op_encoding import EncoderConfig
from voxdisplay.wire.palette_ops import changed_color_blocks
from voxdisplay.wire.raster_encoding import encode_raster

Fit = Literal["contain", "none", "content"]
FITS = ("contain", "none", "content")


@runtime_checkable
class Drawable(Protocol):
    """An object that draws itself on a frame, such as a scene."""

    def draw_on(self, frame: Frame, *, fit: Fit = "contain") -> Drawing:
        """Draw on a frame; `fit` is that of `Frame.draw`."""


class Frame:
    """One complete picture: see the methods `draw`, `set`, `array`, `save` and `show`.

    Frames are equal if a display shows the same for them: grid, format, pixels and palette.

    Parameters
    ----------
    grid : tuple of int
        Size (nx, ny, nz) of the display.
    format : PixelFormat or str
        ``"mono1"``, ``"index8"``, ``"rgb565"`` or ``"rgb888"``.
    palette : (256, 3) uint8 array, optional
        For index8: red, green and blue of each pixel value. They are fixed: colours take the
        nearest entry.
    own_palette : bool
        For index8 without `palette`: colours that the default palette lacks get free entries, as
        long as there are any, and are shown exactly.

    Only displays with the feature ``palette`` show another palette than the default one.

    """

    def __init__(
        self,
        grid: tuple[int, int, int],
        format: PixelFormat | str = "rgb888",  # noqa: A002 - the word of the wire and of the command line
        *,
        palette: NDArray[np.uint8] | None = None,
        own_palette: bool = False,
    ) -> None:
        self.grid = Grid.of(grid)
        self.format = PixelFormat.of(format)
        self._raster = SparseRaster(self.grid, self.format)
        if palette is not None and self.format is not PixelFormat.INDEX8:
            raise ValueError(f"a {self.format.value} display has no palette: leave it out")
        self._palette: Palette | None = None  # None: the default palette, or a format without
        own_palette = flag("own_palette", own_palette)
        if self.format is PixelFormat.INDEX8 and (own_palette or palette is not None):
            self._palette = Palette(palette, grows=palette is None)

    def __repr__(self) -> str:
        lit = len(self.lit()[0])
        palette = ", own palette" if self.has_own_palette else ""
        return f"<Frame {self.grid} {self.format.value}, {lit} voxels lit{palette}>"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Frame):
            return NotImplemented
        if (self.grid, self.format) != (other.grid, other.format):
            return False
        mine, others = self.palette, other.palette
        if mine is not None and others is not None and not np.array_equal(mine, others):
            return False
        return not len(self._raster.differing(other._raster))

    __hash__ = None  # type: ignore[assignment]  # it can be drawn on

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """Return `array`, for numpy; always a copy."""
        if copy is False:
            raise ValueError("the array of a frame is a copy: np.array(frame, copy=False) is not")
        return self.array() if dtype is None else self.array().astype(dtype, copy=False)

    def copy(self) -> Frame:
        """Return another frame of the same picture; quick, until one of the two is drawn on."""
        twin = type(self).__new__(type(self))
        twin.__dict__.update(self.__dict__)
        twin._raster = self._raster.copy()  # noqa: SLF001 - of its own kind
        twin._palette = self._palette.copy() if self._palette else None  # noqa: SLF001
        return twin

    def __copy__(self) -> Frame:
        return self.copy()

    def draw(
        self,
        drawable: Curve
        | Body
        | voxelization.Sequence
        | voxelization.VoxelSet
        | Drawable
        | ArrayLike,
        color: Color | None = None,
        *,
        fit: Fit = "contain",
    ) -> Drawing:
        """Draw a curve, a body, a sequence, voxels or a scene over what is there.

        Parameters
        ----------
        drawable : Curve, Body, Sequence, VoxelSet, (N, 3) integer array, or Scene
            Voxels of an array have columns x, y, z. What lies outside the grid is clipped.
        color : str, (r, g, b), list of these, or (k, 3) integer array, optional
            A colour, or several spread along the curve: see `voxdisplay.raster.color.as_colors`.
            As many as a `Points` curve has points belong to those points. White by default, or a
            body's own colours. A scene has colours of its own.
        fit : {"contain", "none", "content"}
            For a scene: scale and centre one that was composed for a grid of another size, keep
            its numbers, or scale and centre what is there in it.

        Returns
        -------
        Drawing
            Voxel counts, and whether the colours are exact.

        Raises
        ------
        TypeError
            If `drawable` or `color` is of another kind.
        ValueError
            If an array has another shape or type, or a colour is none.
        CurveError, BodyError, SceneError
            If a curve or a body cannot be evaluated or drawn.

        """
        is_other = not isinstance(drawable, Curve | Body | voxelization.Sequence | type)
        if is_other and isinstance(drawable, Drawable):
            if color is not None:
                raise TypeError("color: a scene has colours of its own; leave it out")
            return drawable.draw_on(self, fit=fit)
        if isinstance(drawable, Body):
            drawable = voxelize_body(drawable, VoxelBox.of_grid(self.grid))
        colors = as_colors("white" if color is None else color)
        if isinstance(drawable, voxelization.VoxelSet):
            own = drawable.colors if color is None else None
            return self.draw_voxels(drawable, colors if own is None else own)
        if isinstance(drawable, Curve):
            drawable = voxelization.voxelize(drawable)
        if isinstance(drawable, voxelization.Sequence):
            if len(colors) > 1 and len(colors) == drawable.curve.point_count:
                colors = colors_at(colors, voxelization.point_indices(drawable))
            return self.draw_voxels(drawable, colors)
        if not is_array_like(drawable) or isinstance(drawable, Frame):
            wanted = "a curve, a body, a sequence, an (N, 3) array of voxels or a scene"
            raise wrong_kind("drawable", wanted, drawable)
        return self._add(as_voxels("drawable", drawable), colors, Kind.ARRAY)

    def draw_voxels(
        self, voxels: voxelization.Sequence | voxelization.VoxelSet, colors: NDArray[np.uint8]
    ) -> Drawing:
        """Draw N voxels with one colour, a colour for each, or several spread along them.

        Parameters
        ----------
        voxels : Sequence or VoxelSet
        colors : (1, 3), (N, 3) or (k, 3) uint8 array

        """
        if isinstance(voxels, voxelization.VoxelSet):
            drawing = self._add_set(voxels.voxels, colors)
            return replace(drawing, notes=voxels.notes)
        drawing = self._add(voxels.voxels, colors, Kind.CURVE, corner_rows(voxels))
        return replace(drawing, undefined=voxels.undefined, jumps=voxels.jumps)

    def draw_all(self, items: Iterable[tuple[Curve, Color]]) -> list[Drawing]:
        """Draw many curves in order: as `draw` on each, but voxelised together, which is faster."""
        if not isinstance(items, Iterable) or getattr(items, "ndim", None) == 0:
            raise wrong_kind("items", "an iterable of (curve, color)", items)
        pairs = list(items)
        for pair in pairs:
            if not isinstance(pair, tuple | list) or len(pair) != 2:
                raise wrong_kind("items", "an iterable of (curve, color)", pair)
        sequences = voxelization.voxelize_many(curve for curve, _ in pairs)
        return [
            self.draw(sequence, color)
            for sequence, (_, color) in zip(sequences, pairs, strict=True)
        ]

    def _add_set(self, voxels: NDArray[np.integer], colors: NDArray[np.uint8]) -> Drawing:
        """Draw voxels that have no order, such as those of a body.

        Parameters
        ----------
        voxels : (N, 3) integer array
            Columns x, y, z, in any order; those outside the grid are clipped.
        colors : (k, 3) uint8 array
            One colour, or one for each voxel, or several spread along the rows.

        """
        return self._add(voxels, colors, Kind.SET)

    def _add(
        self,
        voxels: NDArray[np.integer],
        colors: NDArray[np.uint8],
        kind: Kind,
        corners: NDArray[np.int64] | None = None,
    ) -> Drawing:
        item, clipped, exact = self._coloring.item(voxels, colors, kind, corners)
        self._raster.draw(item)
        return Drawing(len(voxels), clipped, exact)

    @property
    def _coloring(self) -> Coloring:
        return Coloring(self.grid, self.format, self._palette)

    def set(self, array: NDArray[np.generic]) -> None:
        """Replace the picture by an array. The palette stays as it is.

        Parameters
        ----------
        array : ndarray
            The display's memory, indexed [z, y, x]: (nz, ny, nx) uint8 for mono1 and index8,
            uint16 for rgb565; (nz, ny, nx, 3) uint8 for rgb888. Lists of whole numbers are taken
            if they fit.

        Raises
        ------
        ValueError
            If shape, type or a mono1 value is another; the message says what is wanted.

        """
        given, array = array, as_array("array", array)
        if not hasattr(given, "dtype"):
            array = self.format.from_integers(array)
        self.format.validate(array, self.grid.array_shape)
        pixels: Pixels = np.array(array, order="C").reshape(self.format.shape((self.grid.voxels,)))
        self._raster.set(pixels)
        if self._palette:
            self._palette.mark_used(np.flatnonzero(np.bincount(pixels, minlength=256)))

    def set_voxels(self, index: NDArray[np.integer], values: NDArray[np.integer]) -> None:
        """Replace the picture by pixels of single voxels. The palette stays as it is.

        Parameters
        ----------
        index : (n,) integer array
            Scan-order indices, as of `lit`: x + nx * (y + ny * z). Of equal ones the last counts.
        values : (n,) integer array
            Their pixel values, as of `lit`.

        Raises
        ------
        ValueError
            If an index is outside the grid, or there are not as many values.

        """
        places = as_array("index", index).astype(np.int64)
        if places.ndim != 1 or np.shape(values) != places.shape:
            raise ValueError(
                f"index, values: expected two arrays (n,), found {places.shape} "
                f"and {np.shape(values)}"
            )
        if len(places) and not 0 <= places.min() <= places.max() < self.grid.voxels:
            raise ValueError(
                f"index: expected 0 to {self.grid.voxels - 1}, "
                f"found {places.min()} to {places.max()}"
            )
        self._raster.clear()
        none = np.zeros(len(places), dtype=np.bool_)
        self._raster.draw(DrawnVoxels.of_item(places, np.asarray(values), none, Kind.SET))
        if self._palette:
            self._palette.mark_used(np.unique(values))

    def clear(self) -> None:
        """Make all voxels dark."""
        self._raster.clear()

    @property
    def palette(self) -> NDArray[np.uint8] | None:
        """Copy of the palette, (256, 3) uint8: colours of the pixel values. None if not index8."""
        if self.format is not PixelFormat.INDEX8:
            return None
        return (self._palette.colors if self._palette else DEFAULT).copy()

    @property
    def has_own_palette(self) -> bool:
        """True if the palette is not the default one."""
        return self._palette is not None and len(self._palette.entries_differing(DEFAULT)) > 0

    def array(self) -> Pixels:
        """Return the frame as the display will hold it, indexed [z, y, x]: a copy, as for `set`."""
        return self._raster.pixels().reshape(self.format.shape(self.grid.array_shape))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a picture of the frame.

        Parameters
        ----------
        path : str or path
            Its suffix says what is written: .png; .gif or .mp4, a film of one turn; .html, a page
            to turn it in a browser.

        Raises
        ------
        ValueError
            If it has another suffix.
        MissingExtra
            If a library is not installed.
        OSError
            If the file cannot be written.

        """
        from voxdisplay.view.rich_display import save_page  # noqa: PLC0415 - needs an extra

        save_page(path, self._raster.lit, self.grid, self.format, self.palette)

    def show(self) -> None:
        """Show a picture of the frame: in a notebook's output, else in the picture viewer.

        Raises
        ------
        MissingExtra
            If Pillow is not installed.
        VoxDisplayError
            If there is no screen, or no picture viewer.

        """
        from voxdisplay.view.rich_display import show_page  # noqa: PLC0415 - needs an extra

        show_page(self._raster.lit, self.grid, self.format, self.palette)

    def _repr_png_(self) -> bytes | None:
        """Return a picture for notebooks; None without Pillow."""
        from voxdisplay.view.rich_display import page_png  # noqa: PLC0415 - needs an extra

        return page_png(self._raster.lit, self.grid, self.format, self.palette)

    def rgb(self) -> NDArray[np.uint8]:
        """Return the colours shown, (nz, ny, nx, 3) uint8, whatever the format."""
        lit = self._raster.lit
        colors = np.zeros((self.grid.voxels, 3), dtype=np.uint8)
        colors[lit.index] = self._coloring.colors_of(lit.values)
        return colors.reshape(*self.grid.array_shape, 3)

    def lit(self) -> tuple[NDArray[np.int64], Values]:
        """Return the scan-order indices of lit voxels, ascending, and their pixel values."""
        lit = self._raster.lit
        return lit.index, lit.values

    def lit_rgb(self) -> NDArray[np.uint8]:
        """Return the colours, (n, 3), of the voxels of `lit`."""
        return self._coloring.colors_of(self._raster.lit.values)

    def digest(self) -> int:
        """Return the digest that a display reports when it shows this frame (section 8)."""
        found = raster_digest(self._raster)
        if self._palette and len(entries := self._palette.entries_differing(DEFAULT)):
            found += palette_digest(self.grid.voxels, entries, self._palette.colors[entries])
        return found & 0xFFFFFFFF

    def payloads(self, max_payload: int, features: Collection[str] = ()) -> list[bytes]:
        """Return payloads that draw the frame on a dark page, in whatever order they arrive.

        Parameters
        ----------
        max_payload : int
            Bytes of the longest payload that the device takes.
        features : collection of str
            Features that the device announced: `DeviceInfo.features`. No others are used.

        """
        return list(chain.from_iterable(self.iter_payloads(max_payload, features)))

    def iter_payloads(
        self, max_payload: int, features: Collection[str] = (), bytes_per_s: float = 0.0
    ) -> Iterator[list[bytes]]:
        """Yield the payloads of `payloads` while they are encoded, a few at a time or none.

        The frame must not be changed until all have been taken.

        Parameters
        ----------
        max_payload, features
            As of `payloads`.
        bytes_per_s : float
            Rate of the line; 0 for a slow one. On a fast line, searches that take longer than they
            save are skipped.

        """
        config = self._encoder_config(max_payload, features, bytes_per_s)
        first = changed_color_blocks(self._palette, DEFAULT, config)
        yield from encode_raster(self._raster, config, first)

    def difference(
        self, base: Frame, max_payload: int, features: Collection[str] = ()
    ) -> list[bytes]:
        """Return payloads that draw the frame on a page which shows another.

        Parameters
        ----------
        base : Frame
            The frame shown, of the same grid and format.
        max_payload, features
            As of `payloads`.

        """
        config = self._encoder_config(max_payload, features)
        self._check_comparable(base)
        old = base._palette.colors if base._palette else DEFAULT
        first = changed_color_blocks(self._palette, old, config)
        return encode_difference(self._raster, base._raster, config, first)

    def changed_indices(self, base: Frame) -> NDArray[np.int64]:
        """Return the scan-order indices, ascending, of voxels that differ from another frame."""
        self._check_comparable(base)
        return self._raster.differing(base._raster)

    def _check_comparable(self, base: Frame) -> None:
        instance("base", base, Frame, "a frame")
        if (base.grid, base.format) != (self.grid, self.format):
            raise ValueError(
                f"base: expected a frame of {self.grid} {self.format.value}, found {base}"
            )

    def _encoder_config(
        self, max_payload: int, features: Collection[str], bytes_per_s: float = 0.0
    ) -> EncoderConfig:
        config = EncoderConfig.of_device(self.grid, self.format, max_payload, features, bytes_per_s)
        if self.has_own_palette and not config.has(spec.FEATURE_PALETTE):
            raise ValueError(
                "the frame has a palette of its own, and the device cannot set its palette"
            )
        return config

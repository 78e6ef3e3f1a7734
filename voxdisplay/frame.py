"""One picture of a display: display list in drawing order, and its raster.

A frame turns curves into voxels and colours into pixels of the display's grid and format. It must
not know packets in flight, and leaves the encoding to `wire.encoding_selection`.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from voxdisplay import voxelization
from voxdisplay.argument_checks import flag, instance, whole_number, wrong_kind
from voxdisplay.bodies.body import Body
from voxdisplay.curves.curve import Curve
from voxdisplay.curves.singular_points import SingularPoint
from voxdisplay.raster.array_arguments import as_array, as_voxels, is_array_like
from voxdisplay.raster.color import Color, as_colors, colors_at, interpolate_colors
from voxdisplay.raster.display_list import DrawnVoxels, Kind
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.palette import DEFAULT, Palette
from voxdisplay.raster.pixel_format import PixelFormat, Pixels, Values
from voxdisplay.raster.pixel_map import without
from voxdisplay.raster.sparse_raster import SparseRaster
from voxdisplay.voxelization.body_voxelization import voxelize_body
from voxdisplay.voxelization.voxel_box import VoxelBox
from voxdisplay.wire import spec
from voxdisplay.wire.differences import PageDifference, encode_difference
from voxdisplay.wire.digest import digest, page_digest, palette_digest
from voxdisplay.wire.encoding_selection import PageUpdate, encode_raw_if_faster, encode_update
from voxdisplay.wire.features import feature_bits
from voxdisplay.wire.op_encoding import EncoderConfig
from voxdisplay.wire.palette_ops import color_blocks
from voxdisplay.wire.payload_splitting import OpBlocks

Fit = Literal["contain", "none", "content"]
FITS = ("contain", "none", "content")


@dataclass(frozen=True, slots=True)
class Drawing:
    """Result of drawing one object.

    Attributes
    ----------
    voxels : int
        Number of its voxels, inside the grid or not.
    clipped : int
        Number of those outside, which are not shown.
    exact_color : bool
        True if the display can show its colours as they are.
    undefined : tuple of SingularPoint
        Parameters at which a curve has no value and is drawn with the limits of both sides.
    jumps : tuple of float
        Parameters at which a curve jumps: nothing is drawn across.
    notes : tuple of str
        What was wrong with a body or left out, for people.

    """

    voxels: int
    clipped: int
    exact_color: bool
    undefined: tuple[SingularPoint, ...] = ()
    jumps: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()

    @classmethod
    def sum(cls, drawings: Iterable[Drawing]) -> Drawing:
        """Return the result of drawing several objects."""
        drawings = list(drawings)
        return cls(
            voxels=sum(drawing.voxels for drawing in drawings),
            clipped=sum(drawing.clipped for drawing in drawings),
            exact_color=all(drawing.exact_color for drawing in drawings),
            undefined=tuple(point for drawing in drawings for point in drawing.undefined),
            jumps=tuple(t for drawing in drawings for t in drawing.jumps),
            notes=tuple(note for drawing in drawings for note in drawing.notes),
        )


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
        drawing = self._add(voxels.voxels, colors, Kind.CURVE, _corner_rows(voxels))
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
        # A single colour is looked up once.
        each = len(colors) in {1, len(voxels)}
        rgb = colors if each else interpolate_colors(colors, len(voxels))
        found = self._palette.nearest(rgb) if self._palette else self.format.nearest(rgb)
        exact = np.array_equal(self._colors_of(found), rgb)
        values = np.broadcast_to(found, (len(voxels),)) if len(found) != len(voxels) else found
        inside = self.grid.inside(voxels)
        at_corner = np.zeros(len(voxels), dtype=np.bool_)
        if corners is not None:
            at_corner[corners] = True
        # Voxels outside have meaningless indices; they are removed here.
        item = DrawnVoxels.of_item(self.grid.index_of(voxels), values, at_corner, kind)
        self._raster.draw(item.select(inside))
        return Drawing(len(inside), int(len(inside) - inside.sum()), bool(exact))

    def _colors_of(self, values: NDArray[np.integer]) -> NDArray[np.uint8]:
        return self._palette.rgb(values) if self._palette else self.format.rgb(values)

    def set(self, array: NDArray[np.generic]) -> None:
        """Replace the picture by an array. The palette stays as it is.

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
        array = as_array("array", array)
        self.format.validate(array, self.grid.array_shape)
        pixels: Pixels = np.array(array, order="C").reshape(self.format.shape((self.grid.voxels,)))
        self._raster.set(pixels)
        if self._palette:
            self._palette.mark_used(np.flatnonzero(np.bincount(pixels, minlength=256)))

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

        save_page(path, self.array(), self.grid, self.format, self.palette)

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

        show_page(self.array(), self.grid, self.format, self.palette)

    def _repr_png_(self) -> bytes | None:
        """Return a picture for notebooks; None without Pillow."""
        from voxdisplay.view.rich_display import page_png  # noqa: PLC0415 - needs an extra

        return page_png(self.array(), self.grid, self.format, self.palette)

    def rgb(self) -> NDArray[np.uint8]:
        """Return the colours shown, (nz, ny, nx, 3) uint8, whatever the format."""
        index, values = self.lit()
        colors = np.empty((self.grid.voxels, 3), dtype=np.uint8)
        colors[:] = self._colors_of(np.zeros(1, dtype=np.uint32))  # palettes may show the dark
        colors[index] = self._colors_of(values)
        return colors.reshape(*self.grid.array_shape, 3)

    def lit(self) -> tuple[NDArray[np.int64], Values]:
        """Return the scan-order indices of lit voxels, ascending, and their pixel values."""
        lit = self._raster.lit
        return lit.index, lit.values

    def digest(self) -> int:
        """Return the digest that a display reports when it shows this frame (section 8)."""
        found = self._raster_digest()
        if self._palette and len(entries := self._palette.entries_differing(DEFAULT)):
            found += palette_digest(self.grid.voxels, entries, self._palette.colors[entries])
        return found & 0xFFFFFFFF

    def _raster_digest(self) -> int:
        if not (page := self._raster.page):
            return digest(*self.lit())
        # In a page, much may be lit; a digest is a sum, to which what was drawn is added.
        drawn = self._raster.drawn
        found = page_digest(page.pixels, self.format)
        return found - digest(drawn.index, page.at(drawn.index)) + digest(drawn.index, drawn.values)

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
        colors = self._palette_blocks(DEFAULT, config)
        if self._raster.page and (
            plain := encode_raw_if_faster(self._raster.pixels(), config, colors)
        ):
            yield from plain
            return
        ordered, index = self._visible_parts()
        yield []
        yield from encode_update(PageUpdate(ordered, index, self._raster.at), config, colors)

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
        changed = self.changed_indices(base)
        old = base._palette.colors if base._palette else DEFAULT
        content = PageDifference(changed, self._ordered(), base._ordered(), self._raster.at)
        return encode_difference(content, config, self._palette_blocks(old, config))

    def changed_indices(self, base: Frame) -> NDArray[np.int64]:
        """Return the scan-order indices, ascending, of voxels that differ from another frame."""
        instance("base", base, Frame, "a frame")
        if (base.grid, base.format) != (self.grid, self.format):
            raise ValueError(
                f"base: expected a frame of {self.grid} {self.format.value}, found {base}"
            )
        return self._raster.differing(base._raster)

    def _encoder_config(
        self, max_payload: int, features: Collection[str], bytes_per_s: float = 0.0
    ) -> EncoderConfig:
        whole_number("max_payload", max_payload, spec.LIMIT_MIN_PAYLOAD, spec.LIMIT_MAX_PAYLOAD)
        bits = feature_bits(features)
        config = EncoderConfig(self.grid, self.format, max_payload, bits, bytes_per_s)
        if self.has_own_palette and not config.has(spec.FEATURE_PALETTE):
            raise ValueError(
                "the frame has a palette of its own, and the device cannot set its palette"
            )
        return config

    def _visible_parts(self) -> tuple[DrawnVoxels | None, NDArray[np.int64]]:
        """Return the lit voxels of items that may have an order, and the indices of all others."""
        ordered = self._ordered()
        index = self.lit()[0]
        if ordered is None:
            return None, index
        lit = ordered.select(ordered.values != 0)
        if not self._raster.page and ordered is self._raster.visible:
            return lit, index[:0]
        return lit, index[without(index, lit.index)]

    def _ordered(self) -> DrawnVoxels | None:
        """Return the visible voxels, dark ones included, of items that may have an order."""
        drawn = self._raster.visible
        if drawn and (drawn.kinds == Kind.SET).any():
            drawn = drawn.select((drawn.kinds != Kind.SET)[drawn.item])
        return drawn

    def _palette_blocks(self, old: NDArray[np.uint8], config: EncoderConfig) -> OpBlocks | None:
        """Return op blocks that set the entries that differ from another palette, or None."""
        if self._palette and len(entries := self._palette.entries_differing(old)):
            return color_blocks(entries, self._palette.colors, config)
        return None


_NO_INDICES = np.empty(0, dtype=np.int64)


def _corner_rows(sequence: voxelization.Sequence) -> NDArray[np.int64]:
    """Return the rows of voxels at which a curve has its corners."""
    breaks = sequence.curve.breaks
    if not len(breaks) or len(sequence) < 2:
        return _NO_INDICES
    behind = np.searchsorted(sequence.t, breaks).clip(1, len(sequence) - 1)
    before = np.abs(sequence.t[behind - 1] - breaks) <= np.abs(sequence.t[behind] - breaks)
    return np.unique(behind - before)

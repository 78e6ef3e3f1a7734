"""Framebuffer: pixels and palette of one picture, and the payloads that draw it.

It must not know what is drawn, nor packets in flight. It holds no array of the grid's size that it
was not given, and leaves the encoding to `wire`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import chain
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from voxdisplay.argument_checks import flag, instance
from voxdisplay.raster.array_arguments import as_array
from voxdisplay.raster.coloring import Coloring
from voxdisplay.raster.display_list import DrawnVoxels, Kind
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.palette import DEFAULT, Palette
from voxdisplay.raster.pixel_format import PixelFormat, Pixels, Values
from voxdisplay.raster.sparse_raster import SparseRaster
from voxdisplay.wire import spec
from voxdisplay.wire.differences import encode_difference
from voxdisplay.wire.digest import palette_digest, raster_digest
from voxdisplay.wire.op_encoding import EncoderConfig
from voxdisplay.wire.palette_ops import changed_color_blocks
from voxdisplay.wire.raster_encoding import encode_raster

if TYPE_CHECKING:
    from voxdisplay.frame.output_transform import OutputTransform
    from voxdisplay.raster.pixel_map import PixelMap


class _Sent(NamedTuple):
    """What a display's memory holds for a picture, whose lit voxels were those; and a note."""

    lit: PixelMap
    memory: Framebuffer
    note: str


class Framebuffer:
    """Pixels and palette of one picture.

    Parameters
    ----------
    grid, format, palette, own_palette
        As of `voxdisplay.Frame`.

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
        self._output: OutputTransform | None = None
        self._sent: _Sent | None = None

    @classmethod
    def _of_raster(cls, raster: SparseRaster, palette: Palette | None) -> Self:
        """Return the picture of a raster, with a palette of its own or none."""
        found = cls(raster.grid, raster.format)
        found._raster, found._palette = raster, palette  # as of `copy`
        return found

    def __repr__(self) -> str:
        lit = len(self.lit()[0])
        palette = ", own palette" if self.has_own_palette else ""
        return f"<Frame {self.grid} {self.format.value}, {lit} voxels lit{palette}>"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Framebuffer):
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

    def copy(self) -> Self:
        """Return another frame of the same picture; quick, until one of the two is drawn on."""
        twin = type(self).__new__(type(self))
        twin.__dict__.update(self.__dict__)
        twin._raster = self._raster.copy()  # noqa: SLF001 - of its own kind
        twin._palette = self._palette.copy() if self._palette else None  # noqa: SLF001
        return twin

    def __copy__(self) -> Self:
        return self.copy()

    # -- the display's memory

    @property
    def output(self) -> OutputTransform | None:
        """What lies between the picture and the display's memory; None if they are the same."""
        return self._output

    def with_output(self, output: OutputTransform | None) -> Self:
        """Return the same picture for a display that stands, or is lit, otherwise.

        Parameters
        ----------
        output : OutputTransform or None

        """
        if output is not None:
            from voxdisplay.frame.output_transform import OutputTransform  # noqa: PLC0415

            instance("output", output, OutputTransform, "an OutputTransform or None")
        twin = self.copy()
        twin._output, twin._sent = output, None  # noqa: SLF001 - of its own kind
        return twin

    @property
    def pitch(self) -> tuple[float, float, float]:
        """Distances of voxels along x, y and z, in any unit."""
        return (1.0, 1.0, 1.0) if self._output is None else self._output.pitch

    @property
    def memory(self) -> Framebuffer:
        """The picture as the display's memory holds it; it must not be changed."""
        return self if self._output is None else self._to_send(self._output).memory

    def cropped(self, corner: tuple[int, int, int], grid: Grid) -> Self:
        """Return what the memory holds in a box, as a picture of its own.

        Parameters
        ----------
        corner : tuple of int
            The lowest voxel (x, y, z) of the box.
        grid : Grid
            Its sides; it is inside the memory.

        """
        memory = self.memory
        palette = memory._palette.copy() if memory._palette else None  # noqa: SLF001 - of its own kind
        return type(self)._of_raster(memory._raster.cropped(corner, grid), palette)  # noqa: SLF001

    def readback(self) -> Pixels:
        """Return what a display reads back that shows the frame, [z, y, x], as its user sees it.

        That is `array`, unless the display dims its light.
        """
        page = self.memory.array()
        return page if self._output is None else self._output.to_user(page)

    @property
    def output_note(self) -> str:
        """What the display's current limit has done to the picture; empty if nothing."""
        return "" if self._output is None else self._to_send(self._output).note

    def _to_send(self, output: OutputTransform) -> _Sent:
        lit = self._raster.lit  # another one after each change
        if self._sent is None or self._sent.lit is not lit:
            raster, palette, note = output.memory(self._raster, self._palette)
            self._sent = _Sent(lit, Framebuffer._of_raster(raster, palette), note)
        return self._sent

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
        if self._output is not None:
            return self.memory.digest()
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
        if self._output is not None:
            yield from self.memory.iter_payloads(max_payload, features, bytes_per_s)
            return
        config = self._encoder_config(max_payload, features, bytes_per_s)
        first = changed_color_blocks(self._palette, DEFAULT, config)
        yield from encode_raster(self._raster, config, first)

    def difference(
        self, base: Framebuffer, max_payload: int, features: Collection[str] = ()
    ) -> list[bytes]:
        """Return payloads that draw the frame on a page which shows another.

        Parameters
        ----------
        base : Frame
            The frame shown, of the same grid and format.
        max_payload, features
            As of `payloads`.

        """
        self._check_comparable(base)
        if self._output is not None or base._output is not None:
            return self.memory.difference(base.memory, max_payload, features)
        config = self._encoder_config(max_payload, features)
        old = base._palette.colors if base._palette else DEFAULT
        first = changed_color_blocks(self._palette, old, config)
        return encode_difference(self._raster, base._raster, config, first)

    def changed_indices(self, base: Framebuffer) -> NDArray[np.int64]:
        """Return the scan-order indices, ascending, of voxels that differ from another frame."""
        self._check_comparable(base)
        return self._raster.differing(base._raster)

    def _check_comparable(self, base: Framebuffer) -> None:
        instance("base", base, Framebuffer, "a frame")
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

    @property
    def _coloring(self) -> Coloring:
        return Coloring(self.grid, self.format, self._palette)

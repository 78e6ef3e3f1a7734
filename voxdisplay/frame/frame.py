"""One picture of a display: drawing of curves, bodies and scenes, and output as images.

A frame turns curves into voxels and colours into pixels of the display's grid and format. It must
not know how they are kept and encoded.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import groupby
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from voxdisplay import voxelization
from voxdisplay.argument_checks import wrong_kind
from voxdisplay.bodies.body import Body
from voxdisplay.compute.garbage_collection import collecting_between
from voxdisplay.curves.curve import Curve
from voxdisplay.frame.drawing import Drawing
from voxdisplay.frame.framebuffer import Framebuffer
from voxdisplay.raster.array_arguments import as_voxels, is_array_like
from voxdisplay.raster.color import Color, as_colors, colors_at
from voxdisplay.raster.display_list import DrawnVoxels, Kind, Spread
from voxdisplay.voxelization.body_voxelization import voxelize_body
from voxdisplay.voxelization.corner_rows import corner_rows
from voxdisplay.voxelization.voxel_box import VoxelBox

Fit = Literal["contain", "none", "content"]
FITS = ("contain", "none", "content")


@runtime_checkable
class Drawable(Protocol):
    """An object that draws itself on a frame, such as a scene."""

    def draw_on(self, frame: Frame, *, fit: Fit = "contain") -> Drawing:
        """Draw on a frame; `fit` is that of `Frame.draw`."""


class Frame(Framebuffer):
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

    Notes
    -----
    Only displays with the feature ``palette`` show another palette than the default one.

    """

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
            return self.draw_voxels(drawable, _colors_of(drawable, colors))
        if not is_array_like(drawable) or isinstance(drawable, Frame):
            wanted = "a curve, a body, a sequence, an (N, 3) array of voxels or a scene"
            raise wrong_kind("drawable", wanted, drawable)
        return self._add(as_voxels("drawable", drawable), colors, Kind.ARRAY)

    def draw_voxels(
        self,
        voxels: voxelization.Sequence | voxelization.VoxelSet,
        colors: NDArray[np.uint8] | Spread,
    ) -> Drawing:
        """Draw N voxels with one colour, a colour for each, or several spread along them.

        Parameters
        ----------
        voxels : Sequence or VoxelSet
        colors : (1, 3), (N, 3) or (k, 3) uint8 array, or Spread
            A spread is along a curve of which the voxels are a stretch.

        """
        if isinstance(voxels, voxelization.VoxelSet):
            drawing = self._add_set(voxels.voxels, self._shades(voxels, colors))
            return replace(drawing, notes=voxels.notes)
        found = self._coloring.item(voxels.voxels, colors, Kind.CURVE, corner_rows(voxels))
        self._raster.draw(found.item)
        return Drawing(len(voxels), found.clipped, found.exact, voxels.undefined, voxels.jumps)

    def draw_all(self, items: Iterable[tuple[Curve, Color]]) -> list[Drawing]:
        """Draw many curves in order: as `draw` on each, but voxelised together, which is faster."""
        if not isinstance(items, Iterable) or getattr(items, "ndim", None) == 0:
            raise wrong_kind("items", "an iterable of (curve, color)", items)
        pairs = list(items)
        for pair in pairs:
            if not isinstance(pair, tuple | list) or len(pair) != 2:
                raise wrong_kind("items", "an iterable of (curve, color)", pair)
        given = iter([color for _, color in pairs])
        return self.draw_batches(
            [(sequence, _colors_of(sequence, color)) for sequence, color in zip(batch, given)]  # noqa: B905 - those of the batch
            for batch in voxelization.voxelize_batches(curve for curve, _ in pairs)
        )

    def draw_batches(
        self,
        batches: Iterable[
            Sequence[
                tuple[voxelization.Sequence | voxelization.VoxelSet, NDArray[np.uint8] | Spread]
            ]
        ],
    ) -> list[Drawing]:
        """Draw voxels in order, with colours as of `draw_voxels`; nothing if the iterable fails.

        Costs less than to draw them one by one, and no more memory than one batch and the pixels.
        """
        items: list[DrawnVoxels] = []
        drawings: list[Drawing] = []
        for batch in collecting_between(batches):
            for _, members in groupby(batch, key=_is_set):
                same = list(members)
                sets = [(v, c) for v, c in same if isinstance(v, voxelization.VoxelSet)]
                curves = [(v, c) for v, c in same if isinstance(v, voxelization.Sequence)]
                drawn, found = self._sets(sets) if sets else self._sequences(curves)
                items += drawn
                drawings += found
        for item in items:
            self._raster.draw(item)
        return drawings

    def _sets(
        self, sets: list[tuple[voxelization.VoxelSet, NDArray[np.uint8] | Spread]]
    ) -> tuple[list[DrawnVoxels], list[Drawing]]:
        """Return sets of voxels as items, and what becomes of each."""
        items, drawings = [], []
        for voxel_set, colors in sets:
            voxels = voxel_set.voxels
            found = self._coloring.item(voxels, self._shades(voxel_set, colors), Kind.SET)
            items.append(found.item)
            drawings.append(Drawing(len(voxels), found.clipped, found.exact, notes=voxel_set.notes))
        return items, drawings

    def _shades(
        self, voxel_set: voxelization.VoxelSet, colors: NDArray[np.uint8] | Spread
    ) -> NDArray[np.uint8] | Spread:
        """Return the colours of a volume dithered, if the display's profile wants that."""
        if self._output is None or not self._output.dithers or self._palette is not None:
            return colors
        count = len(voxel_set)
        if (
            voxel_set.kind != "volume"
            or isinstance(colors, Spread)
            or len(colors) not in {1, count}
        ):
            return colors
        from voxdisplay.raster.dither import can_dither, dithered, ranks_at  # noqa: PLC0415

        if not count or not can_dither(self.format):
            return colors
        ranks = ranks_at(voxel_set.voxels)
        return dithered(np.broadcast_to(colors, (count, 3)), ranks, self.format)

    def _sequences(
        self, sequences: list[tuple[voxelization.Sequence, NDArray[np.uint8] | Spread]]
    ) -> tuple[list[DrawnVoxels], list[Drawing]]:
        """Return sequences as items, and what becomes of each."""
        found = self._coloring.items(
            [sequence.voxels for sequence, _ in sequences],
            [colors for _, colors in sequences],
            Kind.CURVE,
            [corner_rows(sequence) for sequence, _ in sequences],
        )
        drawings = [
            Drawing(len(each), clipped, exact, each.undefined, each.jumps)
            for (each, _), clipped, exact in zip(
                sequences, found.clipped.tolist(), found.exact.tolist(), strict=True
            )
        ]
        return [found.items], drawings

    def _add_set(self, voxels: NDArray[np.integer], colors: NDArray[np.uint8] | Spread) -> Drawing:
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
        colors: NDArray[np.uint8] | Spread,
        kind: Kind,
    ) -> Drawing:
        item, clipped, exact = self._coloring.item(voxels, colors, kind)
        self._raster.draw(item)
        return Drawing(len(voxels), clipped, exact)

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

        In a notebook it turns, with the extra ``notebook``.

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


def _is_set(
    pair: tuple[voxelization.Sequence | voxelization.VoxelSet, NDArray[np.uint8] | Spread],
) -> bool:
    return isinstance(pair[0], voxelization.VoxelSet)


def _colors_of(sequence: voxelization.Sequence, color: Color) -> NDArray[np.uint8]:
    """Return the colours of a sequence; those of points are spread between them."""
    colors = as_colors(color)
    if len(colors) > 1 and len(colors) == sequence.curve.point_count:
        return colors_at(colors, voxelization.point_indices(sequence))
    return colors

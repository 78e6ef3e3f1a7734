"""Scene model: coloured curves and bodies in drawing order, and the grid they were composed for.

It must not read files; of the one it came from it holds the text, for the places in errors.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from voxdisplay.argument_checks import choice, distances, instance, whole_number
from voxdisplay.frame import FITS, Drawing, Fit, Frame
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_map import PixelMap
from voxdisplay.scene.best_view import BestView
from voxdisplay.scene.content_fit import content_placement
from voxdisplay.scene.item import PartSpan, SceneItem
from voxdisplay.scene.placement import Placement, placed
from voxdisplay.scene.scene_files import DEFAULT_SIZE
from voxdisplay.scene.show import SceneShow
from voxdisplay.scene.voxelized_items import draw_items, draw_still, shown_voxels, voxelize_items

if TYPE_CHECKING:
    from voxdisplay.voxelization import Sequence, VoxelSet

Pitch: TypeAlias = tuple[float, float, float]

DEFAULT_FPS = 30.0

_MAX_FILM_FRAMES = 300  # of a view in a notebook
_MAX_TYPES = 5  # of objects that a repr names


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Scene:
    """Contents of a scene file; of a moving scene, at its beginning.

    Attributes
    ----------
    size : Grid or None
        The grid it was composed for; None: the display's own.
    items : tuple of SceneItem
        In drawing order.
    notes : tuple of str
        Choices made by the reader, one line each, for people.
    spans : tuple of PartSpan
        Items of which a part is shown.
    view : BestView or None
        Where it is best seen from; None: nowhere in particular.

    """

    size: Grid | None
    items: tuple[SceneItem, ...]
    notes: tuple[str, ...] = ()
    spans: tuple[PartSpan, ...] = ()
    view: BestView | None = None

    def __repr__(self) -> str:
        size = f" {self.size}" if self.size else ""
        types = [item.type for item in self.items[:_MAX_TYPES]]
        if len(self.items) > _MAX_TYPES:
            types.append("...")
        named = f" ({', '.join(types)})" if types else ""
        count = len(self.items)
        return f"<Scene{size}: {count} object{'s' * (count != 1)}{named}>"

    def voxelize(
        self, *, clip: tuple[int, int, int] | None = None, **options: Any
    ) -> list[Sequence | VoxelSet]:
        """Return the voxels of all items: sequences of curves, sets of bodies.

        Parameters
        ----------
        clip : (int, int, int), optional
            The grid to which bodies are clipped. By default those that have no end are clipped to
            the scene's size, and others are not.
        **options
            Of `voxdisplay.voxelize`.

        Raises
        ------
        SceneError
            If a curve or body cannot be evaluated or drawn; it names the object.

        """
        grid = Grid.of(clip) if clip is not None else None
        endless = self.size or DEFAULT_SIZE
        return shown_voxels(voxelize_items(self.items, grid, endless, **options), self.spans)

    def draw_on(self, frame: Frame, *, fit: Fit = "contain") -> Drawing:
        """Draw all items on a frame: `Frame.draw` of a scene.

        Parameters
        ----------
        frame : Frame
        fit : {"contain", "none", "content"}
            As of `fitted`.

        Returns
        -------
        Drawing
            The sums of all items.

        Raises
        ------
        SceneError
            As of `voxelize`.

        """
        instance("frame", frame, Frame, "a frame")
        fitted, _ = self.fitted(frame.grid, fit, frame.pitch)
        return Drawing.sum(fitted.draw_each(frame))

    def draw_each(self, frame: Frame) -> list[Drawing]:
        """Draw all items on a frame as they are; return what became of each."""
        if not self.spans:
            return draw_still(frame, self.items)
        whole = voxelize_items(self.items, frame.grid)
        drawings, _ = draw_items(frame, self.items, whole, self.spans)
        return drawings

    def _repr_png_(self) -> bytes | None:
        """Return a picture for notebooks; None without Pillow."""
        frame = Frame(self.size or DEFAULT_SIZE)
        self.draw_on(frame)
        return frame._repr_png_()

    def show(self) -> None:
        """Show the scene: in a notebook a view that turns, and plays a scene that moves.

        Outside a notebook, its picture in the picture viewer, of a moving scene at time 0. Of a
        long one the view has fewer frames per second.

        Raises
        ------
        MissingExtra
            If Pillow is not installed.
        VoxDisplayError
            If there is no screen, or no picture viewer.
        SceneError
            As of `voxelize`.

        """
        from voxdisplay.view.film import LazyPages  # noqa: PLC0415 - needs an extra
        from voxdisplay.view.rich_display import show_film  # noqa: PLC0415

        blank = Frame(self.size or DEFAULT_SIZE)
        film = self.show_on(blank, fit="none")
        step = -(-self.frame_count // _MAX_FILM_FRAMES)
        pages = LazyPages(
            -(-self.frame_count // step), lambda number: PixelMap(*film.frame(number * step).lit())
        )
        show_film(pages, blank.grid, blank.format, fps=self.fps / step, view=self.view)

    def fitted(
        self, grid: Grid, mode: Fit = "contain", pitch: Pitch = (1.0, 1.0, 1.0)
    ) -> tuple[Scene, str | None]:
        """Fit the scene to a display's grid.

        Parameters
        ----------
        grid : Grid
            The display's.
        mode : {"contain", "none", "content"}
            ``"contain"`` scales a scene that was composed for another grid by the same factor in
            x, y and z, so that all of it is shown, and centres it. ``"content"`` does so with what
            there is in it, so that this fills the grid. ``"none"`` keeps the numbers.
        pitch : (px, py, pz)
            Distances of the display's voxels along x, y and z, in any unit. Where they differ, the
            factors differ as 1 / px, 1 / py and 1 / pz, so that what is round stays round.

        Returns
        -------
        scene : Scene
            This one when there is nothing to change.
        note : str or None
            One line that says what was changed.

        """
        placement, note = self.placement_for(Grid.of(grid), mode, pitch)
        if placement is None:
            return self, note
        return self.placed(placement, Grid.of(grid)), note

    def placement_for(
        self, grid: Grid, mode: Fit, pitch: Pitch = (1.0, 1.0, 1.0)
    ) -> tuple[Placement | None, str | None]:
        """Return the map by which the scene is fitted, and a note on it: see `fitted`."""
        choice("fit", mode, FITS)
        pitch = distances("pitch", pitch)
        if mode == "content":
            return content_placement(self._moments(), self.size or DEFAULT_SIZE, grid, pitch)
        if mode == "contain" and len(set(pitch)) > 1:
            return _contained(self.size or grid, grid, pitch)
        if mode == "none" or self.size is None or self.size == grid:
            return None, None
        size, room = np.array(self.size, dtype=np.float64), np.array(grid, dtype=np.float64)
        scale = float((room / size).min())
        note = f"scene composed for {self.size}, scaled by {scale:.3g} to {grid}"
        return Placement.scaling(scale, (room - scale * size) / 2), note

    def placed(self, placement: Placement, grid: Grid) -> Scene:
        """Return the scene under an affine map, as one that was composed for a grid."""
        items: list[SceneItem] = []
        kept: list[int] = []  # before each item, how many of those before it are left
        for item in self.items:
            kept.append(len(items))
            shape = placed(item.shape, placement)
            if shape is not None:
                fit = placement.after(item.fit)
                items.append(replace(item, shape=shape, fit=fit))
        kept.append(len(items))
        spans = tuple(
            span._replace(first=kept[span.first], end=kept[span.end]) for span in self.spans
        )
        return replace(self, size=grid, items=tuple(items), spans=spans)

    def _moments(self) -> Iterable[Scene]:
        """Yield the scene at moments between which it does not become much larger."""
        yield self

    @property
    def duration(self) -> float:
        """Seconds that a moving scene lasts; 0 of a still one."""
        return 0.0

    @property
    def fps(self) -> float:
        """Frames per second of a moving scene."""
        return DEFAULT_FPS

    @property
    def loop(self) -> bool:
        """True if a moving scene is meant to start again at its end."""
        return False

    @property
    def frame_count(self) -> int:
        """Number of frames; 1 of a still scene."""
        return 1

    def at(self, time: float) -> Scene:  # noqa: ARG002 - for those that move
        """Return the scene at a time, in seconds since its beginning: a still one is as it is."""
        return self

    def at_frame(self, number: int) -> Scene:
        """Return the scene at frame ``number``, from 0 to ``frame_count - 1``, as a still one."""
        whole_number("number", number, 0, 0)
        return self

    def show_on(self, blank: Frame, *, fit: Fit = "contain") -> SceneShow:
        """Return the scene as a show of frames like a blank one.

        Parameters
        ----------
        blank : Frame
            Its copies are drawn on.
        fit : {"contain", "none", "content"}
            As of `fitted`.

        """
        instance("blank", blank, Frame, "a frame")
        fitted, _ = self.fitted(blank.grid, fit, blank.pitch)
        return SceneShow(fitted, blank)


def _contained(size: Grid, grid: Grid, pitch: Pitch) -> tuple[Placement, str]:
    """Return the map of a scene to a display whose voxels are no cubes, and a note on it."""
    sides, room = np.array(size, dtype=np.float64), np.array(grid, dtype=np.float64)
    steps = np.array(pitch) / min(pitch)
    factors = float((room * steps / sides).min()) / steps
    named = ", ".join(f"{factor:.3g}" for factor in factors)
    note = (
        f"scene of {size} scaled by {named} along x, y, z to {grid}, whose voxels are "
        f"{' x '.join(f'{each:g}' for each in pitch)} mm"
    )
    return Placement(np.diag(factors), (room - factors * sides) / 2), note

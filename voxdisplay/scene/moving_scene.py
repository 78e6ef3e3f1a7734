"""Moving scenes: scene files that have a duration, at any time of it.

What a scene shows is a function of the scene and the time alone. Must not know how frames are
played.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from voxdisplay.argument_checks import number as checked_number
from voxdisplay.argument_checks import whole_number
from voxdisplay.errors import SceneError
from voxdisplay.scene.model import Scene

if TYPE_CHECKING:
    from collections.abc import Iterator

    from voxdisplay.raster.grid import Grid
    from voxdisplay.scene.best_view import BestView
    from voxdisplay.scene.builder import Built, SceneBuilder
    from voxdisplay.scene.environment import ValueTable
    from voxdisplay.scene.json_text import JsonText
    from voxdisplay.scene.placement import Placement
    from voxdisplay.scene.timeline import Timeline

_MOMENTS = 24  # at which the extent of what is there is looked at


@dataclass(frozen=True, slots=True)
class Film:
    """Parsed parts of a moving scene, from which each frame is built.

    Attributes
    ----------
    timeline : Timeline
    table : ValueTable
        Values of its expressions.
    builder : SceneBuilder
    source : JsonText
        The file's text.

    """

    timeline: Timeline
    table: ValueTable
    builder: SceneBuilder
    source: JsonText

    def build(self, time: float, fit: Placement | None) -> Built:
        """Return what is shown at a time, in seconds."""
        try:
            self.table.seek(*self.timeline.block_of(time))
            return self.builder.build(time, fit)
        except SceneError as error:
            if time:
                error.args = (f"{error.args[0]}, at time = {time:g}", *error.args[1:])
            raise self.source.add_location(error) from error.__cause__


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MovingScene(Scene):
    """Contents of a scene file that has a duration.

    Its items are those at time 0.

    Attributes
    ----------
    film : Film
        What it is at other times.
    fit : Placement or None
        How it was fitted to a grid.

    """

    film: Film = None  # type: ignore[assignment]  # behind attributes that have defaults
    fit: Placement | None = None

    def __repr__(self) -> str:
        still = Scene.__repr__(self).removeprefix("<").removesuffix(">")
        return f"<Moving{still}, {self.duration:g} s at {self.fps:g} fps>"

    @classmethod
    def of_film(
        cls,
        film: Film,
        size: Grid | None,
        notes: tuple[str, ...],
        fit: Placement | None = None,
        view: BestView | None = None,
    ) -> MovingScene:
        """Return the scene of a film; raise SceneError if it cannot be built at time 0."""
        built = film.build(0.0, fit)
        notes = tuple(dict.fromkeys((*notes, *built.notes)))
        return cls(size, built.items, notes, built.spans, view, film, fit)

    @property
    def duration(self) -> float:
        """Seconds that it lasts."""
        return self.film.timeline.duration

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self.film.timeline.fps

    @property
    def loop(self) -> bool:
        """True if it is meant to start again at its end."""
        return self.film.timeline.loop

    @property
    def frame_count(self) -> int:
        """Number of frames: frame n is that of the time n / fps, the last before the end."""
        return self.film.timeline.frame_count

    def at(self, time: float) -> Scene:
        """Return the scene at a time.

        Parameters
        ----------
        time : float
            Seconds since its beginning, from 0 to its duration.

        Raises
        ------
        ValueError
            If the time is outside.
        SceneError
            If a value is wrong at that time.

        """
        time = checked_number("time", time)
        if not 0 <= time <= self.duration:
            raise ValueError(f"time: {time:g} s is not from 0 to {self.duration:g}")
        built = self.film.build(time, self.fit)
        return Scene(self.size, built.items, self.notes, built.spans, self.view)

    def at_frame(self, number: int) -> Scene:
        """Return the scene at a frame: `Scene.at_frame`."""
        number = whole_number("number", number, 0, self.frame_count - 1)
        built = self.film.build(self.film.timeline.time_of(number), self.fit)
        return Scene(self.size, built.items, self.notes, built.spans, self.view)

    def placed(self, placement: Placement, grid: Grid) -> MovingScene:
        """Return the scene under an affine map: `Scene.placed`."""
        fit = placement.after(self.fit)
        placed = MovingScene.of_film(self.film, grid, self.notes, fit, self.view)
        return replace(placed, notes=self.notes)

    def _moments(self) -> Iterator[Scene]:
        moments = min(_MOMENTS, self.frame_count)
        for i in range(moments):
            yield self.at_frame(i * (self.frame_count - 1) // max(1, moments - 1))

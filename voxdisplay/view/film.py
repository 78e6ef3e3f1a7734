"""Films of a moving page: a picture for each page, from one point of view, at one exposure.

Pages are made when they are needed, so that films of any length take little memory. Must not know
where they come from.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.grid import Grid
from voxdisplay.raster.palette import Colors
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.raster.pixel_map import PixelMap
from voxdisplay.view.glow import accumulate_light
from voxdisplay.view.lit_voxels import lit_voxels
from voxdisplay.view.picture import RenderOptions, auto_exposure, render_voxels

if TYPE_CHECKING:
    from voxdisplay.view.pillow import Image

Page = NDArray[np.integer] | PixelMap
_METERED = 7  # pages that the exposure is found from, spread over the film


class LazyPages(Sequence[Page]):
    """Pages that are made when they are accessed.

    Parameters
    ----------
    count : int
    page : callable
        Returns the page of a number from 0 to ``count - 1``, indexed [z, y, x].

    """

    def __init__(self, count: int, page: Callable[[int], Page]) -> None:
        self._count, self._page = count, page

    def __len__(self) -> int:
        return self._count

    @overload
    def __getitem__(self, number: int) -> Page: ...
    @overload
    def __getitem__(self, number: slice) -> list[Page]: ...
    def __getitem__(self, number: int | slice) -> Page | list[Page]:
        if isinstance(number, slice):
            return [self[i] for i in range(*number.indices(self._count))]
        if not -self._count <= number < self._count:
            raise IndexError(number)
        return self._page(number % self._count)


@dataclass(frozen=True, slots=True)
class FilmJob:
    """Pages and the options of their export as a film.

    Attributes
    ----------
    pages : sequence of ndarray or PixelMap
        Indexed [z, y, x]; at least one.
    grid : Grid
    format : PixelFormat
    options : RenderOptions
    title : str
    fps : float
        Pages per second.
    palette : (256, 3) uint8 array or None
        Of index8 pages; None for the default one.

    """

    pages: Sequence[Page]
    grid: Grid
    format: PixelFormat
    options: RenderOptions = field(default_factory=RenderOptions)
    title: str = "voxdisplay"
    fps: float = 30.0
    palette: Colors | None = None

    @property
    def page(self) -> Page:
        """The first page."""
        return self.pages[0]

    def pictures(self, progress: Callable[[int, int], None] | None) -> FilmPictures:
        """Return the pictures of the film."""
        return FilmPictures(self, progress)


class FilmPictures(Sequence["Image.Image"]):
    """The pictures of a film, rendered when they are accessed.

    Parameters
    ----------
    film : FilmJob
    progress : callable, optional
        Called with (pictures rendered, pictures in all).

    """

    def __init__(self, film: FilmJob, progress: Callable[[int, int], None] | None = None) -> None:
        self._film, self._progress = film, progress
        count = len(film.pages)
        metered = sorted({i * count // _METERED for i in range(_METERED)})
        # The brightest of them decides: no picture is blinding.
        self._exposure = min((self._metered(number) for number in metered), default=1.0)

    def _metered(self, number: int) -> float:
        film = self._film
        lit = lit_voxels(film.pages[number], film.grid, film.format, film.palette)
        light = accumulate_light(lit, film.grid, film.options.camera, film.options.size).light
        return auto_exposure(light) if light.size else np.inf

    def __len__(self) -> int:
        return len(self._film.pages)

    @overload
    def __getitem__(self, number: int) -> Image.Image: ...
    @overload
    def __getitem__(self, number: slice) -> list[Image.Image]: ...
    def __getitem__(self, number: int | slice) -> Any:
        if isinstance(number, slice):
            return [self[i] for i in range(*number.indices(len(self)))]
        film = self._film
        page = film.pages[number]
        if self._progress:
            self._progress(number % len(self) + 1, len(self))
        lit = lit_voxels(page, film.grid, film.format, film.palette)
        exposure = self._exposure if np.isfinite(self._exposure) else 1.0
        return render_voxels(lit, film.grid, film.options, exposure)

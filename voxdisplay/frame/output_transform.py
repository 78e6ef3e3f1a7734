"""`OutputTransform`: what lies between a picture and the memory of the display that shows it.

How the display stands, and how much light it may give. Must not know devices or files.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from voxdisplay.errors import IncompatibleDevice
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.light import FULL, CurrentLimit, dim
from voxdisplay.raster.orientation import UPRIGHT, Orientation
from voxdisplay.raster.palette import Palette
from voxdisplay.raster.pixel_format import PixelFormat, Pixels
from voxdisplay.raster.sparse_raster import SparseRaster

CUBIC: Final = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class OutputTransform:
    """Map from pictures, as users draw them, to the memory of a display.

    Attributes
    ----------
    orientation : Orientation
    pitch : tuple of float
        Distances of voxels along the user's x, y and z, in any unit.
    brightness : float
        Factor of linear light, 0 to 1.
    limit : CurrentLimit or None
    dithers : bool
        Whether volumes are dithered.

    """

    orientation: Orientation = UPRIGHT
    pitch: tuple[float, float, float] = CUBIC
    brightness: float = 1.0
    limit: CurrentLimit | None = None
    dithers: bool = False

    @property
    def dims(self) -> bool:
        """True if the memory may hold other light than the picture."""
        return self.brightness != 1 or self.limit is not None

    def user_grid(self, memory: Grid) -> Grid:
        """Return the grid of pictures for a memory."""
        return self.orientation.user_grid(memory)

    def to_user(self, page: Pixels) -> Pixels:
        """Return a page of the memory as the user sees it, [z, y, x]; its light is as it is."""
        turned: NDArray[Any] = np.ascontiguousarray(self.orientation.to_user(page))
        return turned

    def memory(
        self, raster: SparseRaster, palette: Palette | None
    ) -> tuple[SparseRaster, Palette | None, str]:
        """Return what the memory has to hold to show a picture, and what the limit has done.

        Parameters
        ----------
        raster : SparseRaster
        palette : Palette or None
            The picture's own.

        Returns
        -------
        raster : SparseRaster
        palette : Palette or None
        note : str
            Empty if the limit has done nothing.

        Raises
        ------
        IncompatibleDevice
            If the picture takes more current than the limit, and its format has no dimmer light.

        """
        note = ""
        if self.dims:
            dimmed = dim(raster, palette, self.brightness, self.limit)
            if self.limit and dimmed.amps is not None and dimmed.amps > self.limit.amps:
                taken = f"this picture takes {dimmed.amps:.3g} A, the limit is {self.limit.amps:g}"
                if raster.format is PixelFormat.MONO1:
                    raise IncompatibleDevice(
                        f"{taken} A, and a mono1 display has no dimmer light",
                        hint="light fewer voxels, or raise the limit of the display's profile",
                    )
                note = f"{taken} A: shown with {100 * dimmed.factor / FULL:.3g} % of its light"
            raster, palette = dimmed.raster, dimmed.palette
        if self.orientation != UPRIGHT:
            raster = self.orientation.memory_raster(raster)
        return raster, palette, note

"""Shows of one grid and pixel format, as files hold them.

Must not know displays, nor how files are read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from voxdisplay.shows.recording_conversion import ConvertedShow

if TYPE_CHECKING:
    from voxdisplay.frame import Fit, Frame
    from voxdisplay.raster.grid import Grid
    from voxdisplay.raster.pixel_format import PixelFormat
    from voxdisplay.shows.show import Show


class FixedFormatShow:
    """Base of shows whose frames are of one grid and pixel format.

    Attributes
    ----------
    grid : Grid
    pixel_format : PixelFormat
    fps : float
    loop : bool
    frame_count : int

    """

    grid: Grid
    pixel_format: PixelFormat
    fps: float
    loop: bool = False
    frame_count: int

    @property
    def duration(self) -> float:
        """Seconds."""
        return self.frame_count / self.fps

    def frame(self, number: int) -> Frame:
        """See `Show.frame`."""
        raise NotImplementedError

    def show_on(self, blank: Frame, *, fit: Fit = "contain") -> Show:
        """Return the show for a display: this one, if it is of the same grid and format.

        Parameters
        ----------
        blank, fit
            As of `shows.recording_conversion.ConvertedShow`, which it is else.

        """
        if (blank.grid, blank.format) == (self.grid, self.pixel_format):
            return self
        return ConvertedShow(self, blank, fit)

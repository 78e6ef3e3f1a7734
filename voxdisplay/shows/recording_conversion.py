"""Recordings on displays of another grid or pixel format: decoded, moved and coloured again.

Must not know displays, nor how files are read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from voxdisplay.shows.derived_show import DerivedShow

if TYPE_CHECKING:
    from voxdisplay.frame import Frame
    from voxdisplay.shows.show import Show


class ConvertedShow(DerivedShow):
    """A show whose frames are drawn on frames of another kind.

    Voxels are placed by their centres. They are never enlarged, which would leave gaps.

    Parameters
    ----------
    show : Show
        Whose frames are of one grid and pixel format.
    blank : Frame
        A blank frame of the display.
    fit : {"contain", "none", "content"}
        ``"none"`` keeps coordinates and clips; all others make a larger picture smaller, by one
        factor in x, y and z, and centre it.

    """

    def __init__(
        self, show: Show, blank: Frame, fit: Literal["contain", "none", "content"] = "contain"
    ) -> None:
        super().__init__(show)
        self._blank = blank
        self._fit = fit

    def frame(self, number: int) -> Frame:
        """Return a frame of the display: as `Show.frame`."""
        source = self._show.frame(number)
        index, _ = source.lit()
        voxels = source.grid.voxels_at(index)
        target = self._blank.copy()
        if self._fit != "none":
            size, room = np.array(source.grid, float), np.array(target.grid, float)
            scale = min(1.0, float((room / size).min()))
            centres = (voxels + 0.5 - size / 2) * scale + room / 2
            voxels = np.floor(centres).astype(np.int32)
        if len(voxels):
            target.draw(voxels, source.lit_rgb())
        return target

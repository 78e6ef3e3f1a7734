"""Shows for displays that stand, or are lit, otherwise than their memory says.

A recording holds packets for an upright memory: here its frames are decoded and coded again. Must
not know displays.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from voxdisplay.shows.derived_show import DerivedShow

if TYPE_CHECKING:
    from voxdisplay.frame import Frame
    from voxdisplay.frame.output_transform import OutputTransform
    from voxdisplay.shows.show import Show


class OrientedShow(DerivedShow):
    """A show whose frames have what lies between a picture and a display's memory.

    Parameters
    ----------
    show : Show
        Of the grid and format that the display's user sees.
    output : OutputTransform

    """

    def __init__(self, show: Show, output: OutputTransform) -> None:
        super().__init__(show)
        self._output = output

    def frame(self, number: int) -> Frame:
        """Return a frame of the display: as `Show.frame`."""
        return self._show.frame(number).with_output(self._output)

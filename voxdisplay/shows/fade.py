"""A show that begins and ends dark: brightness rises and falls in linear light.

Must not know playlists.
"""

from __future__ import annotations

import numpy as np

from voxdisplay.frame import Frame
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.shows.show import Show

_GAMMA = 2.2  # of sRGB, nearly


class FadedShow:
    """Part of a show with a fade at both ends.

    A display of one bit a voxel has no brightness: there it is the show itself.

    Parameters
    ----------
    show : Show
    start_s, end_s : float
        The part, in seconds of the show.
    fade_s : float
        How long each fade takes; at most half of the part.

    """

    def __init__(self, show: Show, start_s: float, end_s: float, fade_s: float) -> None:
        self._show, self._start_s, self._end_s = show, start_s, end_s
        self._fade_s = min(fade_s, (end_s - start_s) / 2)
        self.fps, self.loop = show.fps, show.loop
        self.duration, self.frame_count = show.duration, show.frame_count
        if show.frame_count == 1:  # brightness makes frames of a still picture
            self.duration = end_s
            self.frame_count = max(1, round(end_s * show.fps))

    def frame(self, number: int) -> Frame:
        """See `Show.frame`."""
        frame = self._show.frame(min(number, self._show.frame_count - 1))
        time_s = number / self.fps
        level = min((time_s - self._start_s) / self._fade_s, (self._end_s - time_s) / self._fade_s)
        if level >= 1 or frame.format is PixelFormat.MONO1:
            return frame
        return _dimmed(frame, max(0.0, level))


def _dimmed(frame: Frame, level: float) -> Frame:
    """Return a frame with all colours dimmed to a share of their light."""
    index, values = frame.lit()
    palette = frame.palette
    colors = frame.format.rgb(values) if palette is None else palette[values]
    dimmed = np.rint(colors * level ** (1 / _GAMMA)).astype(np.uint8)
    dark = frame.copy()
    dark.clear()
    nx, ny, _ = frame.grid
    voxels = np.stack((index % nx, index // nx % ny, index // (nx * ny)), axis=1)
    if len(voxels):
        dark.draw(voxels, dimmed)
    return dark

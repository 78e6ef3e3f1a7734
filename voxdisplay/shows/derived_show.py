"""Base class of shows that are made of another one, frame by frame.

Must not know displays.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from voxdisplay.frame import Frame
    from voxdisplay.shows.show import Show


class DerivedShow(ABC):
    """A show with the times of another one, and frames that are made of its frames.

    Parameters
    ----------
    show : Show
        The other one.

    """

    def __init__(self, show: Show) -> None:
        self._show = show

    @property
    def duration(self) -> float:
        """As of the show."""
        return self._show.duration

    @property
    def fps(self) -> float:
        """As of the show."""
        return self._show.fps

    @property
    def loop(self) -> bool:
        """As of the show."""
        return self._show.loop

    @property
    def frame_count(self) -> int:
        """As of the show."""
        return self._show.frame_count

    @abstractmethod
    def frame(self, number: int) -> Frame:
        """Return a frame of the display: as `Show.frame`."""

"""Several shows in a row, as they are named on a command line.

Must not know displays.
"""

from __future__ import annotations

from dataclasses import dataclass

from voxdisplay.frame import Fit, Frame
from voxdisplay.shows.binding import Playable, bind_timeline
from voxdisplay.shows.timeline import Timeline


@dataclass(frozen=True, slots=True)
class ShowSequence:
    """Shows in a row, each played once, as often as it says of itself.

    Attributes
    ----------
    shows : tuple
        Shows, scenes and playlists.

    """

    shows: tuple[Playable, ...]

    def timeline_on(
        self, blank: Frame, *, fit: Fit = "contain", until_s: float | None = None
    ) -> Timeline:
        """See `TimelineSource.timeline_on`."""
        timelines = [
            bind_timeline(show, blank, fit=fit, loop=False, until_s=until_s) for show in self.shows
        ]
        return Timeline(
            [each for timeline in timelines for each in timeline.segments * timeline.turns]
        )

"""Several shows in a row, as they are named on a command line.

Must not know displays.
"""

from __future__ import annotations

from dataclasses import dataclass

from voxdisplay.frame import Fit, Frame
from voxdisplay.shows.frame_schedule import FrameSchedule
from voxdisplay.shows.playable import Playable, bind_schedule


@dataclass(frozen=True, slots=True)
class ShowSequence:
    """Shows in a row, each played once, as often as it says of itself.

    Attributes
    ----------
    shows : tuple
        Shows, scenes and playlists.

    """

    shows: tuple[Playable, ...]

    def schedule_on(
        self, blank: Frame, *, fit: Fit = "contain", until_s: float | None = None
    ) -> FrameSchedule:
        """See `ScheduleSource.schedule_on`."""
        schedules = [
            bind_schedule(show, blank, fit=fit, loop=False, until_s=until_s) for show in self.shows
        ]
        return FrameSchedule(
            [each for schedule in schedules for each in schedule.segments * schedule.turns]
        )

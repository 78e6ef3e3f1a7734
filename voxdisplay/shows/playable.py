"""Schedules of what can be played: shows, scenes and playlists, bound to a display's frames.

Must not know displays.
"""

from __future__ import annotations

import math
from typing import Protocol, TypeAlias, runtime_checkable

from voxdisplay.argument_checks import wrong_kind
from voxdisplay.frame import Drawable, Fit, Frame
from voxdisplay.shows.frame_schedule import FrameSchedule, Segment
from voxdisplay.shows.show import Show, ShowSource

STILL_FPS = 30.0
"""Frame rate of a still picture: it is shown at once, and for so long."""


class StillShow:
    """A still picture as a show of one frame.

    Parameters
    ----------
    frame : Frame

    """

    fps = STILL_FPS
    loop = False
    frame_count = 1
    duration = 0.0

    def __init__(self, frame: Frame) -> None:
        self._frame = frame

    def frame(self, number: int) -> Frame:
        """See `Show.frame`."""
        del number
        return self._frame


@runtime_checkable
class ScheduleSource(Protocol):
    """Several shows that become a schedule when the display is known, such as a playlist."""

    def schedule_on(
        self, blank: Frame, *, fit: Fit = "contain", until_s: float | None = None
    ) -> FrameSchedule:
        """Return the schedule as frames of the kind of a blank one."""


Playable: TypeAlias = Show | ShowSource | Drawable | ScheduleSource


def bind_show(playable: Show | ShowSource | Drawable, blank: Frame, fit: Fit) -> Show:
    """Return a show for a display.

    Parameters
    ----------
    playable : Show, ShowSource or Drawable
        A Drawable that is no show is a still picture.
    blank : Frame
        A blank frame of the display.
    fit : {"contain", "none", "content"}

    """
    show = _bind(playable, blank, fit)
    if blank.output is None:
        return show
    from voxdisplay.shows.oriented_show import OrientedShow  # noqa: PLC0415 - few displays need it

    return OrientedShow(show, blank.output)


def _bind(playable: Show | ShowSource | Drawable, blank: Frame, fit: Fit) -> Show:
    if isinstance(playable, ShowSource):
        return playable.show_on(blank, fit=fit)
    if isinstance(playable, Show):
        return playable
    if isinstance(playable, Frame):
        return StillShow(playable)
    if isinstance(playable, Drawable):
        frame = blank.copy()
        frame.draw(playable, fit=fit)
        return StillShow(frame)
    raise wrong_kind("show", "a show, a scene, a playlist or a frame", playable)


def bind_schedule(
    playable: Playable,
    blank: Frame,
    *,
    fit: Fit = "contain",
    loop: bool | None = None,
    until_s: float | None = None,
) -> FrameSchedule:
    """Return the schedule of something that can be played.

    Parameters
    ----------
    playable
        As of `bind_show`, or a playlist.
    blank : Frame
        A blank frame of the display.
    fit : {"contain", "none", "content"}
    loop : bool, optional
        Whether it is repeated for ever; by default, what it says of itself.
    until_s : float, optional
        Where it ends, in seconds of the show.

    """
    if isinstance(playable, ScheduleSource):
        schedule = playable.schedule_on(blank, fit=fit, until_s=until_s)
        return schedule if loop is None else schedule.repeated(0 if loop else schedule.turns or 1)
    show = bind_show(playable, blank, fit)
    repeats = show.loop if loop is None else loop
    segment = Segment(show, until_s=math.inf if until_s is None else until_s)
    return FrameSchedule([segment], turns=0 if repeats else 1)

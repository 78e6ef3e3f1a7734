"""`Display.play`: checks of its arguments, and a player with what it needs.

Must not know how a frame is paced.
"""

from __future__ import annotations

from collections.abc import Callable

from voxdisplay.argument_checks import choice, duration, flag, function, positive
from voxdisplay.display.connection import Clock
from voxdisplay.display.player import Late, Pacing, Player, Turn
from voxdisplay.frame import FITS, Fit, Frame
from voxdisplay.shows.play_report import PlayReport
from voxdisplay.shows.playable import Playable, bind_schedule
from voxdisplay.shows.preparing import FrameSource


def play_show(
    show: Playable,
    blank: Frame,
    turn: Turn,
    check_frame: Callable[[Frame], Frame],
    clock: Clock,
    note: Callable[[str], None],
    *,
    speed: float,
    start: float,
    until: float | None,
    loop: bool | None,
    pacing: Pacing,
    late: Late,
    fit: Fit,
    observer: Callable[[Player], None] | None,
) -> PlayReport:
    """Play a show: see `Display.play`.

    Parameters
    ----------
    blank : Frame
        A blank frame of the display.
    turn : callable
        As of `Player`.
    check_frame : callable
        Returns a frame for how the display stands; raises if it is not of the display's kind.
    clock : callable
        Returns seconds.
    note : callable
        Called with what a current limit has done to a frame.
    pacing : {"device", "host"}
        ``clock`` of `Display.play`.

    """
    choice("clock", pacing, ("device", "host"))
    choice("late", late, ("drop", "delay"))
    choice("fit", fit, FITS)
    function("observer", observer)
    speed = positive("speed", speed)
    start_s = duration("start", start)
    schedule = bind_schedule(
        show,
        blank,
        fit=fit,
        loop=None if loop is None else flag("loop", loop),
        until_s=None if until is None else positive("until", until),
    )
    if schedule.slot_at(start_s) is None:
        raise ValueError(f"start: the show ends at {schedule.duration_s:g} s")
    shows = [segment.show for segment in schedule.segments]
    source = FrameSource(shows, check=check_frame, clock=clock, note=note)
    try:
        player = Player(
            turn, clock, schedule, source, start_s=start_s, speed=speed, pacing=pacing, late=late,
            observer=observer,
        )  # fmt: skip
        return player.run()
    finally:
        source.close()

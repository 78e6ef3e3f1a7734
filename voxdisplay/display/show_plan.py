"""Wire cost of a moving picture before it is sent: its worst frame, and the mean of all.

Long ones are sampled, so that the work is bounded. Must not know ports, sessions or files.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from voxdisplay.display.plan import Line, Plan, Receiver, plan
from voxdisplay.frame import Frame

MOST_RANKED: Final = 240
"""Frames of which the worst is found."""
MOST_PLANNED: Final = 24
"""Frames that are planned for every line."""
_RANKING: Final = Line.of_baud(1_000_000)  # fast enough that no long search is made


@dataclass(frozen=True, slots=True)
class ShowPlan:
    """Wire cost of a moving picture.

    Attributes
    ----------
    worst : int
        Number of the frame of most bytes.
    worst_frame : Frame
    worst_plans : list of Plan
        Its cost on each line.
    mean_voxels : float
        Lit voxels of a frame in the mean.
    mean_bytes : list of float
        Bytes of a frame on each line, in the mean.
    looked_at : int
        Number of frames among which the worst was found.

    """

    worst: int
    worst_frame: Frame
    worst_plans: list[Plan]
    mean_voxels: float
    mean_bytes: list[float]
    looked_at: int


def plan_show(
    frame: Callable[[int], Frame],
    count: int,
    lines: Sequence[Line],
    receiver: Receiver,
) -> ShowPlan:
    """Return the wire cost of frames, each sent as a whole.

    Parameters
    ----------
    frame : callable
        Returns the frame of a number from 0 to ``count - 1``.
    count : int
    lines : sequence of Line
    receiver : Receiver

    """
    ranked = _spread(count, MOST_RANKED)
    sizes = [plan(frame(number), _RANKING, receiver) for number in ranked]
    worst = ranked[max(range(len(ranked)), key=lambda at: sizes[at].wire_bytes)]
    planned = [frame(number) for number in _spread(count, MOST_PLANNED)]
    means = [
        sum(plan(each, line, receiver).wire_bytes for each in planned) / len(planned)
        for line in lines
    ]
    heaviest = frame(worst)
    return ShowPlan(
        worst=worst,
        worst_frame=heaviest,
        worst_plans=[plan(heaviest, line, receiver) for line in lines],
        mean_voxels=sum(each.voxels for each in sizes) / len(sizes),
        mean_bytes=means,
        looked_at=len(ranked),
    )


def _spread(count: int, most: int) -> list[int]:
    """Return so many numbers below count, evenly spread, the first included."""
    return [i * count // min(count, most) for i in range(min(count, most))]
